"""Quadruple precision by heyoka: its numbers, SymPy expressions in it, and linear systems of expressions."""

from collections.abc import Mapping, Sequence
from typing import Any

import mpmath as mp
import sympy as sp

from daebench.errors import BadInput

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
    try:
        import heyoka
    except ImportError as error:
        raise BadInput(f"certification of a reference needs heyoka, which is not installed; install it by {INSTALL}.") from error
    if not hasattr(heyoka, "real128"):
        raise BadInput(f"this heyoka has no quadruple precision; install heyoka from PyPI by {INSTALL}.")
    return heyoka


class Translation:
    """SymPy expressions as expressions of heyoka with every constant in quadruple precision.

    A Python float among heyoka's expressions would be folded in double precision, x/5. to x*0.2; here rationals are divided in
    quadruple precision before they enter.
    """

    def __init__(self, values: Mapping[sp.Symbol, Expression]) -> None:
        self.hy = library()
        self.known: dict[sp.Expr, Expression] = dict(values)

    def constant(self, value: sp.Expr) -> Expression:
        """Return a number as an expression."""
        with mp.workdps(DIGITS):
            return self.hy.expression(quad(sp.N(value, DIGITS)._to_mpmath(mp.mp.prec)))

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
            return self.hy.sum([self(part) for part in expression.args])
        if expression.is_Mul:
            return self.hy.prod([self(part) for part in expression.args])
        if expression.is_Pow and expression.exp.is_number:
            return self._power(self(expression.base), expression.exp)
        if expression.func in UNARY:
            return getattr(self.hy, UNARY[expression.func])(self(expression.args[0]))
        raise BadInput(f"{expression.func} in {expression} has no counterpart in quadruple precision; write the problem without it.")

    def _power(self, base: Expression, exponent: sp.Expr) -> Expression:
        if exponent == sp.Rational(1, 2):
            return self.hy.sqrt(base)
        if exponent.is_Integer and exponent > 2:  # the series of heyoka's own power divides by the base, which may be zero
            return self.hy.prod([base] * int(exponent))
        return base ** self.constant(exponent)


def quad(x: Any) -> Any:
    """Return an mpmath number in quadruple precision."""
    return library().real128(mp.nstr(mp.mpf(x), DIGITS, strip_zeros=False))


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
    hy = library()
    return bool(x == hy.expression(hy.real128(0)))


def dotted(a: Sequence[Expression], b: Sequence[Expression]) -> Expression:
    """Return the sum of products, those with a constant zero left out."""
    hy = library()
    return hy.sum([x * y for x, y in zip(a, b, strict=True) if not (is_zero(x) or is_zero(y))])
