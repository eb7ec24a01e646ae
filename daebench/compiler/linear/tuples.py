"""The *values* algebra: vectors are tuples, operations straight-line code generated for d positions and m constraints.

Structural zeros of G are left out of every product that has a Jacobian of constraints as its first factor.
"""

from collections.abc import Callable, Sequence

from daebench.compiler.codegen import function, pack
from daebench.compiler.linear.dual_solvers import least_squares_dual
from daebench.compiler.linear.elimination_source import Target, blocked, eliminating
from daebench.compiler.linear.kernels import array_solver


def _sum(terms: Sequence[str]) -> str:
    return " + ".join(terms) or "0.0"


def _halves(n: int) -> str:
    """Source of a return statement for a solution z of 2 n entries: its two halves, and the pivot."""
    return f"return {pack(f'z[{i}]' for i in range(n))}, {pack(f'z[{i}]' for i in range(n, 2 * n))}, pivot"


def _matrix(signature: str, entry: Callable[[int, int], str], left: range, right: range) -> Callable[[], str]:
    """Return the writer of a function with this signature that returns a matrix of these entries."""
    return lambda: function(signature, "return " + pack(pack(entry(i, j) for j in right) for i in left))


class Values:
    """Source of the operations that :mod:`daebench.compiler.shapes` and ``kernels/language.py`` name, for tuples of fixed length.

    Parameters
    ----------
    d, m : int
        Numbers of positions and of constraints.
    structure : sequence of sequence of bool, shape(m, d)
        Pattern of the nonzero entries of G.
    inverse_mass : sequence of sequence of bool, shape(d, d)
        Pattern of the nonzero entries of H_pp.
    target : Target
        Properties of the code that it is written for.
    mass : sequence of sequence of int, optional
        Sets of positions that M couples with each other; one set if left out. A position in no set has no mass.
    unmeasured : int
        Number of last entries that norms leave out unless they are not finite.
    """

    elementwise = True
    """Whether entries may be arrays in place of numbers, so that a function applies to many states at once."""

    def __init__(
        self,
        d: int,
        m: int,
        structure: Sequence[Sequence[bool]],
        inverse_mass: Sequence[Sequence[bool]],
        target: Target,
        mass: Sequence[Sequence[int]] | None = None,
        unmeasured: int = 0,
    ) -> None:
        self.d, self.m, self.structure, self.inverse_mass = d, m, structure, inverse_mass
        self.target, self.mass, self.measured = target, mass or [range(d)], d - unmeasured

    def source(self, name: str) -> str | None:
        """Return the source of the operation of this name, or None if there is none."""
        rule = self._rules.get(name)
        return None if rule is None else rule()

    @property
    def _rules(self) -> dict[str, Callable[[], str]]:
        """Source of each operation, by its name."""
        return self._vectors | self._matrices | self._halves | self._solvers

    @property
    def _columns(self) -> list[list[int]]:
        """Columns in which each row of G is not zero."""
        return [[i for i in range(self.d) if row[i]] for row in self.structure]

    @property
    def _vectors(self) -> dict[str, Callable[[], str]]:
        """Operations that return a vector, a multiplier or a number."""
        d, m, columns = range(self.d), range(self.m), self._columns
        rows = [[a for a in m if self.structure[a][i]] for i in d]
        modulus = "modulus" if self.target.directions else "abs"

        def vector(signature: str, entry: str, over: range) -> Callable[[], str]:
            return lambda: function(signature, "return " + pack(entry.format(i=i) for i in over))

        return {
            "axpy": vector("axpy(w, x, y)", "w * x[{i}] + y[{i}]", d),
            "scale": vector("scale(w, x)", "w * x[{i}]", d),
            "axpy_m": vector("axpy_m(w, x, y)", "w * x[{i}] + y[{i}]", m),
            "scale_m": vector("scale_m(w, x)", "w * x[{i}]", m),
            "zero_m": vector("zero_m(q)", "0.0 * q[0]", m),
            "dot": lambda: function("dot(x, y)", "return " + _sum([f"x[{i}] * y[{i}]" for i in d])),
            "dot_moduli": lambda: function("dot_moduli(x, y)", "return " + _sum([f"abs(x[{i}] * y[{i}])" for i in d])),
            "mul_moduli": lambda: function(
                "mul_moduli(X, x, least)",
                "return " + pack(_sum([f"abs(X[{a}][{i}]) * (abs(x[{i}]) + least)" for i in columns[a]]) for a in m),
            ),
            "exceeding": lambda: function(
                "exceeding(y, bound)", "return " + _sum([f"(1.0 if abs(y[{a}]) > bound[{a}] else 0.0)" for a in m])
            ),
            "norm": lambda: function("norm(x)", "return " + _sum([f"{'0.0 * ' * (i >= self.measured)}{modulus}(x[{i}])" for i in d])),
            "norm_m": lambda: function("norm_m(x)", "return " + _sum([f"{modulus}(x[{i}])" for i in m])),
            "mul": lambda: function("mul(X, v)", "return " + pack(_sum([f"X[{a}][{i}] * v[{i}]" for i in columns[a]]) for a in m)),
            "mul_full": lambda: function("mul_full(X, v)", "return " + pack(_sum([f"X[{a}][{i}] * v[{i}]" for i in d]) for a in m)),
            "mul_T": lambda: function("mul_T(X, y)", "return " + pack(_sum([f"X[{a}][{i}] * y[{a}]" for a in rows[i]]) for i in d)),
            "mul_full_T": lambda: function("mul_full_T(X, y)", "return " + pack(_sum([f"X[{a}][{i}] * y[{a}]" for a in m]) for i in d)),
            "apply": lambda: function("apply(S, x)", "return " + pack(_sum([f"S[{i}][{j}] * x[{j}]" for j in d]) for i in d)),
        }

    @property
    def _matrices(self) -> dict[str, Callable[[], str]]:
        """Operations that return a matrix."""
        d, m, columns = range(self.d), range(self.m), self._columns
        return {
            "gram": _matrix("gram(X, Y)", lambda a, b: _sum([f"X[{a}][{i}] * Y[{b}][{i}]" for i in columns[a]]), m, m),
            "gram_full": _matrix("gram_full(X, Y)", lambda a, b: _sum([f"X[{a}][{i}] * Y[{b}][{i}]" for i in d]), m, m),
            "plus_mm": _matrix("plus_mm(X, Y)", lambda a, b: f"X[{a}][{b}] + Y[{a}][{b}]", m, m),
            "scale_mm": _matrix("scale_mm(w, X)", lambda a, b: f"w * X[{a}][{b}]", m, m),
            "scale_dd": _matrix("scale_dd(w, X)", lambda i, j: f"w * X[{i}][{j}]", d, d),
            "minus_md": _matrix("minus_md(X, Y)", lambda a, i: f"X[{a}][{i}] - Y[{a}][{i}]", m, d),
            "jacobian_times": _matrix(
                "jacobian_times(X, S)",
                lambda a, i: _sum([f"X[{a}][{j}] * S[{j}][{i}]" for j in columns[a] if self.inverse_mass[j][i]]),
                m,
                d,
            ),
            "scale_md": _matrix("scale_md(w, X)", lambda a, i: f"w * X[{a}][{i}]", m, d),
            "outer_md": _matrix("outer_md(y, x, X)", lambda a, i: f"y[{a}] * x[{i}] + X[{a}][{i}]", m, d),
            "apply_md": _matrix("apply_md(S, X)", lambda a, i: _sum([f"S[{i}][{j}] * X[{a}][{j}]" for j in d]), m, d),
            "axpy_dd": _matrix("axpy_dd(w, X, Y)", lambda i, j: f"w * X[{i}][{j}] + Y[{i}][{j}]", d, d),
            "identity_plus": _matrix("identity_plus(w, X)", lambda i, j: f"{'1.0 + ' * (i == j)}w * X[{i}][{j}]", d, d),
            "identity_d": _matrix("identity_d(q)", lambda i, j: f"{float(i == j)} + 0.0 * q[0]", d, d),
            "transpose": _matrix("transpose(X)", lambda i, j: f"X[{j}][{i}]", d, d),
            "product": _matrix("product(X, Y)", lambda i, j: _sum([f"X[{i}][{k}] * Y[{k}][{j}]" for k in d]), d, d),
            "product_T": _matrix("product_T(X, Y)", lambda i, j: _sum([f"X[{a}][{i}] * Y[{a}][{j}]" for a in m]), d, d),
            "identity_minus": _matrix("identity_minus(w, X)", lambda a, b: f"{'1.0 ' * (a == b)}- w * X[{a}][{b}]", m, m),
        }

    @property
    def _halves(self) -> dict[str, Callable[[], str]]:
        """Operations on the halves u and v of a Poisson system's state (u, v, c)."""
        m = range(self.m)
        return {
            "first_half": lambda: function("first_half(y)", "return " + pack(f"y[{a}]" for a in m)),
            "second_half": lambda: function("second_half(y)", "return " + pack(f"y[{self.m + a}]" for a in m)),
            "joined": lambda: function(
                "joined(u, v, y)",
                "return " + pack([f"{half}[{a}]" for half in "uv" for a in m] + [f"y[{i}]" for i in range(2 * self.m, self.d)]),
            ),
        }

    @property
    def _solvers(self) -> dict[str, Callable[[], str]]:
        """Solutions of linear systems."""
        return {
            "solve": lambda: self._of_constraints("solve", self.m) or eliminating("solve", self.m, self.target),
            "solve_d": lambda: eliminating("solve_d", self.d, self.target),
            "solve_dm": lambda: eliminating("solve_dm", self.d, self.target, self.m),
            "solve_dd": lambda: eliminating("solve_dd", self.d, self.target, self.d),
            "solve_mass": lambda: blocked("solve_mass", self.d, self.mass, self.target),
            "solve_mass_m": lambda: blocked("solve_mass_m", self.d, self.mass, self.target, self.m),
            "solve_mass_d": lambda: blocked("solve_mass_d", self.d, self.mass, self.target, self.d),
            "solve_2m": self._solve_2m,
            "solve_stages": lambda: self._solve_blocks("solve_stages", self.target.stages, self.m),
            "solve_stages_but_one": lambda: self._solve_blocks("solve_stages_but_one", self.target.stages - 1, self.m),
            "solve_stages_twice": lambda: self._solve_blocks("solve_stages_twice", 2 * self.target.stages, self.m),
            "solve_stages_twice_d": lambda: self._solve_blocks("solve_stages_twice_d", 2 * self.target.stages, self.d),
            "solve_2d": self._solve_2d,
        }

    def _of_constraints(self, name: str, n: int) -> str:
        """Source of the least-squares solution of a system of n unknown multipliers, if requested and if n can be positive."""
        if not self.target.least_squares or n == 1:
            return ""
        if self.target.directions:
            return least_squares_dual(name, n, self.target.directions)
        return array_solver("least_squares", name, n, self.target.dtype, compiled=self.target.compiled)

    def _solve_blocks(self, name: str, blocks: int, size: int) -> str:
        """Source of name(B, b): sum_j B[i][j] x[j] = b[i] for this many blocks of equal size."""
        n = blocks * size
        whole = pack(pack(f"B[{i // size}][{j // size}][{i % size}][{j % size}]" for j in range(n)) for i in range(n))
        right = pack(f"b[{i // size}][{i % size}]" for i in range(n))
        parts = pack(pack(f"z[{i * size + k}]" for k in range(size)) for i in range(blocks))
        main = function(f"{name}(B, b)", f"z, pivot = _{name}({whole}, {right})", f"return {parts}, pivot")
        inner = self._of_constraints(f"_{name}", n) if size == self.m else ""
        return (inner or eliminating(f"_{name}", n, self.target)) + main

    def _solve_2d(self) -> str:
        """Source of solve_2d(A, b): A (x, y) = b for two halves, each of half the size of a state."""
        return eliminating("_solve_2d", 2 * self.d, self.target) + function("solve_2d(A, b)", "z, pivot = _solve_2d(A, b)", _halves(self.d))

    def _solve_2m(self) -> str:
        """Source of solve_2m(A, B, C, D, b, c): the block system [[A, B], [C, D]] (x, y) = (b, c)."""
        m = self.m
        blocks = {(0, 0): "A", (0, 1): "B", (1, 0): "C", (1, 1): "D"}
        whole = pack(pack(f"{blocks[i // m, j // m]}[{i % m}][{j % m}]" for j in range(2 * m)) for i in range(2 * m))
        right = pack([f"b[{i}]" for i in range(m)] + [f"c[{i}]" for i in range(m)])
        main = function("solve_2m(A, B, C, D, b, c)", f"z, pivot = _solve_2m({whole}, {right})", _halves(m))
        return (self._of_constraints("_solve_2m", 2 * m) or eliminating("_solve_2m", 2 * m, self.target)) + main
