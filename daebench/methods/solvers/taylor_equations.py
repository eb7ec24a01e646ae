"""Equations of motion as expressions of heyoka in quadruple precision: HLW (1.18), and those with any structure matrix."""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import mpmath as mp
import sympy as sp

from daebench.compiler.expressions import replaced
from daebench.errors import BadInput
from daebench.methods.solvers.drive import not_installed
from daebench.systems.lazily import heyoka as hy

INSTALL = "pip install 'daebench[certify]'"
FUNCTIONS = ("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log")
UNARY = {getattr(sp, name): name for name in FUNCTIONS}
"""Functions of one argument by their names, which are the same in heyoka."""

DIGITS = 40
"""Decimal digits in which numbers pass to and from quadruple precision, which has 34."""

Expression = Any
"""A heyoka expression."""


def library() -> Any:
    """Return heyoka."""
    if not_installed("heyoka"):
        raise BadInput(
            f"certification of a reference needs heyoka, which is not installed; install it by {INSTALL}.", "certification-needs-heyoka"
        )
    if not hasattr(hy, "real128"):
        raise BadInput(f"this heyoka has no quadruple precision; install heyoka from PyPI by {INSTALL}.", "heyoka-without-quadruple")
    return hy


class Translation:
    """SymPy expressions as expressions of heyoka with every constant in quadruple precision.

    A Python float among heyoka's expressions would be folded in double precision, x/5. to x*0.2; here rationals are divided in
    quadruple precision before they enter.
    """

    def __init__(self, values: Mapping[sp.Symbol, Expression]) -> None:
        library()
        self.known: dict[sp.Expr, Expression] = dict(values)

    def constant(self, value: sp.Expr) -> Expression:
        """Return a number as an expression."""
        with mp.workdps(DIGITS):
            return hy.expression(quad(sp.N(value, DIGITS)._to_mpmath(mp.mp.prec)))

    def __call__(self, expression: sp.Expr) -> Expression:
        """Return an expression; what was met before is the same node of heyoka's graph."""
        node = self.known.get(expression)
        if node is None:
            node = self.known[expression] = self._made(sp.sympify(expression))
        return node

    def _made(self, expression: sp.Expr) -> Expression:
        if expression.is_number:
            return self.constant(expression)
        if expression.is_Add:
            return hy.sum([self(part) for part in expression.args])
        if expression.is_Mul:
            return hy.prod([self(part) for part in expression.args])
        if expression.is_Pow and expression.exp.is_number:
            return self._power(self(expression.base), expression.exp)
        if expression.func in UNARY:
            return getattr(hy, UNARY[expression.func])(self(expression.args[0]))
        raise BadInput(
            f"{expression.func} in {expression} has no counterpart in quadruple precision; write the problem without it.",
            "no-quadruple-counterpart",
        )

    def _power(self, base: Expression, exponent: sp.Expr) -> Expression:
        if exponent == sp.Rational(1, 2):
            return hy.sqrt(base)
        if exponent.is_Integer and exponent > 2:  # the series of heyoka's own power divides by the base, which may be zero
            return hy.prod([base] * int(exponent))
        return base ** self.constant(exponent)


def quad(x: Any) -> Any:
    """Return an mpmath number in quadruple precision."""
    return hy.real128(mp.nstr(mp.mpf(x), DIGITS, strip_zeros=False))


def multiple(x: Any) -> Any:
    """Return a number of quadruple precision as an mpmath number."""
    return mp.mpf(str(x))


def solved(A: Sequence[Sequence[Expression]], b: Sequence[Expression]) -> list[Expression]:
    """Return x of A x = b by elimination without pivoting, as expressions that share their parts; A is symmetric and definite."""
    n, rows, x = len(b), [list(row) for row in A], list(b)
    for j in range(n):
        for i in range(j + 1, n):
            if is_zero(rows[i][j]):
                continue
            factor = rows[i][j] / rows[j][j]
            rows[i][j + 1 :] = [a if is_zero(c) else a - factor * c for a, c in zip(rows[i][j + 1 :], rows[j][j + 1 :], strict=True)]
            x[i] = x[i] - factor * x[j]
    for i in reversed(range(n)):
        for j in range(i + 1, n):
            if not is_zero(rows[i][j]):
                x[i] = x[i] - rows[i][j] * x[j]
        x[i] = x[i] / rows[i][i]
    return x


def orthogonally(A: Sequence[Sequence[Expression]], b: Sequence[Expression]) -> list[Expression]:
    """Return x of A x = b by orthogonalising the columns of A one after the other: no divisor vanishes unless A is singular.

    ::

        A = Q R      Q^T Q diagonal, R unit upper triangular      R x = (Q^T Q)^-1 Q^T b
    """
    n, columns = len(b), [list(column) for column in zip(*A, strict=True)]
    squares, R, rest, y = [], {}, list(b), []
    for j in range(n):
        squares.append(dotted(columns[j], columns[j]))
        for k in range(j + 1, n):
            R[j, k] = dotted(columns[j], columns[k]) / squares[j]
            columns[k] = [a - R[j, k] * c for a, c in zip(columns[k], columns[j], strict=True)]
        y.append(dotted(columns[j], rest) / squares[j])
        rest = [a - y[j] * c for a, c in zip(rest, columns[j], strict=True)]
    for j in reversed(range(n)):
        for k in range(j + 1, n):
            y[j] = y[j] - R[j, k] * y[k]
    return y


def is_zero(x: Expression) -> bool:
    """Return whether an expression is the constant zero."""
    return bool(x == hy.expression(hy.real128(0)))


def dotted(a: Sequence[Expression], b: Sequence[Expression]) -> Expression:
    """Return the sum of products, those with a constant zero left out."""
    return hy.sum([x * y for x, y in zip(a, b, strict=True) if not (is_zero(x) or is_zero(y))])


Equations = list[tuple[Expression, Expression]]
"""A variable and its rate, for each unknown."""


class Exact(Protocol):
    """A problem in exact numbers."""

    @property
    def derivation(self) -> Any:
        """Derivation of the problem's definition."""

    @property
    def parameters(self) -> Mapping[sp.Symbol, sp.Rational]:
        """Values of the parameters by their symbols."""


def own_coordinates(definition: Exact) -> Equations:
    """Return the index-reduced equation, HLW (1.18), in q and p.

    ::

        q' = H_p      p' = -H_q - G^T lam(p, q)      with lam(p, q) solved from (1.12) in the equations themselves
    """
    derivation = definition.derivation
    q, p = ([hy.make_vars(str(x)) for x in part] for part in (derivation.problem.q, derivation.problem.p))
    say = Translation(dict(zip([*derivation.problem.q, *derivation.problem.p], [*q, *p], strict=True)))
    numbers = {**definition.parameters, **dict.fromkeys(derivation.lam, sp.S.Zero)}

    def spelled(matrix: sp.Matrix) -> list[list[Expression]]:
        said = list(map(say, replaced(list(matrix), numbers)))
        return [said[i : i + matrix.cols] for i in range(0, len(said), matrix.cols)]

    def column(matrix: sp.Matrix) -> list[Expression]:
        return [row[0] for row in spelled(matrix)]

    G = spelled(derivation.G)
    if derivation.explicit:
        v, force = column(derivation.H_p), [-x for x in column(derivation.H_q)]
        H_pp = spelled(derivation.H_pp)
        W = [[dotted(entries, row) for entries in H_pp] for row in G]
        rest = column(derivation.a)
    else:
        massive = sorted(i for indices in derivation.coupled for i in indices)
        M = spelled(derivation.M[massive, massive])
        say.known |= dict(zip((derivation.v[i] for i in massive), solved(M, [p[i] for i in massive]), strict=True))
        v, force = column(derivation.velocity), column(derivation.T_q - derivation.U_q)
        by_mass = [dict(zip(massive, solved(M, [row[i] for i in massive]), strict=True)) for row in G]
        W = [[row.get(i, 0 * p[0]) for i in range(derivation.d)] for row in by_mass]
        pull = column(derivation.U_q + derivation.c)
        rest = [a - dotted(w, pull) for a, w in zip(column(derivation.g_qv * derivation.velocity), W, strict=True)]
    if not G:
        return list(zip([*q, *p], [*v, *force], strict=True))
    lam = solved([[dotted(row, w) for w in W] for row in G], rest)
    rates = [f - dotted(column_of_G, lam) for f, column_of_G in zip(force, zip(*G, strict=True), strict=True)]
    return list(zip([*q, *p], [*v, *rates], strict=True))


def hamiltonian(definition: Exact, z: Sequence[sp.Symbol], B: sp.Matrix, K: sp.Expr) -> Equations:
    """Return z' = B(z) grad K(z) with the parameters' values; gradient and product are taken here, and nothing is simplified."""
    variables = [hy.make_vars(f"z{i + 1}") for i in range(len(z))]
    say = Translation(dict(zip(z, variables, strict=True)))
    K_z = list(map(say, replaced([sp.diff(K, x) for x in z], definition.parameters)))
    rates = [dotted(list(map(say, replaced(list(B.row(i)), definition.parameters))), K_z) for i in range(len(z))]
    return list(zip(variables, rates, strict=True))
