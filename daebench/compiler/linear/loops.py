"""The *loops* algebra: vectors are arrays of one axis, matrices of two, for so many unknowns that straight-line code would be too long.

Each operation returns a new array, because schemes change nothing in place. Structural zeros of G are left out as in
:mod:`daebench.compiler.linear.tuples`, by tables of the nonzero columns.
"""

from collections.abc import Callable, Sequence

from daebench.compiler.linear.elimination import Space
from daebench.compiler.linear.kernels import DEPENDENT, lines
from daebench.compiler.linear.tuples import Values
from daebench.compiler.syntax import function


class Arrays:
    """Source of the operations that :mod:`daebench.compiler.shapes` and ``kernels/language.py`` name, for arrays of any length."""

    elementwise = False
    """Whether entries may be arrays in place of numbers."""

    def __init__(self, n: int) -> None:
        self.n = n

    def __repr__(self) -> str:
        return f"Arrays({self.n})"

    names = ("axpy", "axpy_m", "scale", "first_half", "second_half", "joined", "norm", "norm_m")
    """Names of its operations."""

    def provide(self, name: str, space: Space) -> None:
        """Bring an operation into the names of a module."""
        space.add(self.source(name))

    def source(self, name: str) -> str:
        """Return the source of the operation of this name."""
        half = self.n // 2
        bodies = {
            "axpy(w, x, y)": "w * x + y",
            "axpy_m(w, x, y)": "w * x + y",
            "scale(w, x)": "w * x",
            "first_half(y)": f"y[:{half}]",
            "second_half(y)": f"y[{half}:]",
        }
        if name in ("norm", "norm_m"):
            return function(f"{name}(x)", "found = abs(x[0])", "for i in range(1, x.shape[0]):", "    found += abs(x[i])", "return found")
        if name == "joined":
            lines = ["out = empty(y.shape[0], dtype=y.dtype)", f"out[:{half}] = u", f"out[{half}:] = v", "return out"]
            return function("joined(u, v, y)", *lines)
        sources = {signature.partition("(")[0]: function(signature, f"return {body}") for signature, body in bodies.items()}
        return sources[name]


class Loops:
    """Source of the operations that :mod:`daebench.compiler.shapes` and ``kernels/language.py`` name, for arrays."""

    elementwise = False
    """Whether entries may be arrays in place of numbers."""

    def __init__(self, values: Values) -> None:
        self.values = values
        self.d, self.m, self.target, self.measured = values.d, values.m, values.target, values.measured
        columns = [[i for i in range(self.d) if row[i]] for row in values.structure]
        starts = [sum(map(len, columns[:a])) for a in range(self.m + 1)]
        self.tables = {"STARTS": f"numpy.array({starts})", "FILLED": f"numpy.array({[i for row in columns for i in row]})"}
        self.massless = sorted(set(range(self.d)) - {i for block in values.mass for i in block})

    def __repr__(self) -> str:
        return f"Loops({self.values!r})"

    @property
    def names(self) -> list[str]:
        """Names of its operations."""
        return list(self._rules)

    def provide(self, name: str, space: Space) -> None:
        """Bring an operation into the names of a module."""
        space.add(self.source(name))

    def source(self, name: str) -> str:
        """Return the source of the operation of this name."""
        return self._rules[name]()

    @property
    def _rules(self) -> dict[str, Callable[[], str]]:
        """Source of each operation, by its name."""
        return self._vectors | self._products | self._matrices | self._solvers

    def _new(self, shape: str, body: Sequence[str], *, filled: str = "empty") -> list[str]:
        """Lines that make an array and fill it."""
        return [f"out = numpy.{filled}({shape}, dtype=numpy.{self.target.dtype})", *body, "return out"]

    def _each(self, signature: str, entry: str, n: int, *, symmetric: int = 0) -> Callable[[], str]:
        """Return the writer of a function that returns an array with n entries, or with n times ``symmetric`` entries."""
        inner = [f"for i in range({n}):", f"    out[i] = {entry}"]
        if symmetric:
            inner = [f"for i in range({n}):", f"    for j in range({symmetric}):", f"        out[i, j] = {entry}"]
        shape = f"({n}, {symmetric})" if symmetric else str(n)
        return lambda: function(signature, *self._new(shape, inner))

    def _total(self, signature: str, entry: str, n: int, start: str = "") -> Callable[[], str]:
        """Return the writer of a function that returns a sum of n terms."""
        first = entry.replace("[i]", "[0]")
        return lambda: function(
            signature, f"found = {start or first}", f"for i in range({0 if start else 1}, {n}):", f"    found += {entry}", "return found"
        )

    @property
    def _vectors(self) -> dict[str, Callable[[], str]]:
        """Operations on vectors and multipliers."""
        d, m = self.d, self.m
        unmeasured = [f"found += 0.0 * abs(x[{i}])" for i in range(self.measured, d)]
        return {
            "axpy": self._each("axpy(w, x, y)", "w * x[i] + y[i]", d),
            "scale": self._each("scale(w, x)", "w * x[i]", d),
            "axpy_m": self._each("axpy_m(w, x, y)", "w * x[i] + y[i]", m),
            "scale_m": self._each("scale_m(w, x)", "w * x[i]", m),
            "zero_m": self._each("zero_m(q)", "0.0 * q[0]", m),
            "dot": self._total("dot(x, y)", "x[i] * y[i]", d),
            "dot_moduli": self._total("dot_moduli(x, y)", "abs(x[i] * y[i])", d),
            "exceeding": self._total("exceeding(y, bound)", "(1.0 if abs(y[i]) > bound[i] else 0.0)", m, start="0.0"),
            "norm": lambda: function(
                "norm(x)",
                "found = abs(x[0])",
                f"for i in range(1, {self.measured}):",
                "    found += abs(x[i])",
                *unmeasured,
                "return found",
            ),
            "norm_m": self._total("norm_m(x)", "abs(x[i])", m),
        }

    def _sums(self, signature: str, rows: int, columns: int, over: str, term: str) -> Callable[[], str]:
        """Return the writer of a function that returns sums of products over a range, or over the nonzero entries of row i."""
        depth = "    " * (2 if columns else 1)
        entry, head = (
            ("out[i, j]", ["for i in range({0}):", "    for j in range({1}):"]) if columns else ("out[i]", ["for i in range({0}):"])
        )
        inner = [f"{depth}{entry} = 0.0", f"{depth}for {over}:", f"{depth}    {entry} += {term}"]
        shape = f"({rows}, {columns})" if columns else str(rows)
        return lambda: function(signature, *self._new(shape, [*(line.format(rows, columns) for line in head), *inner]))

    def _scattered(self, signature: str, shape: str, head: Sequence[str], statement: str) -> Callable[[], str]:
        """Return the writer of a function that adds up products with the nonzero entries of G."""
        loops = [f"for a in range({self.m}):", "    for e in range(STARTS[a], STARTS[a + 1]):", "        j = FILLED[e]"]
        body = [*loops, *(f"        {line}" for line in head), "        " + "    " * len(head) + statement]
        return lambda: function(signature, *self._new(shape, body, filled="zeros"))

    @property
    def _products(self) -> dict[str, Callable[[], str]]:
        """Products."""
        d, m, filled = self.d, self.m, "e in range(STARTS[i], STARTS[i + 1])"
        return {
            "mul": self._sums("mul(X, v)", m, 0, filled, "X[i, FILLED[e]] * v[FILLED[e]]"),
            "mul_moduli": self._moduli,
            "mul_full": self._sums("mul_full(X, v)", m, 0, f"k in range({d})", "X[i, k] * v[k]"),
            "mul_T": self._scattered("mul_T(X, y)", str(d), (), "out[j] += X[a, j] * y[a]"),
            "mul_full_T": self._sums("mul_full_T(X, y)", d, 0, f"a in range({m})", "X[a, i] * y[a]"),
            "apply": self._sums("apply(S, x)", d, 0, f"k in range({d})", "S[i, k] * x[k]"),
            "gram": self._sums("gram(X, Y)", m, m, filled, "X[i, FILLED[e]] * Y[j, FILLED[e]]"),
            "gram_full": self._sums("gram_full(X, Y)", m, m, f"k in range({d})", "X[i, k] * Y[j, k]"),
            "jacobian_times": self._scattered(
                "jacobian_times(X, S)", f"({m}, {d})", [f"for i in range({d}):"], "out[a, i] += X[a, j] * S[j, i]"
            ),
            "apply_md": self._sums("apply_md(S, X)", m, d, f"k in range({d})", "S[j, k] * X[i, k]"),
            "product": self._sums("product(X, Y)", d, d, f"k in range({d})", "X[i, k] * Y[k, j]"),
            "product_T": self._sums("product_T(X, Y)", d, d, f"a in range({m})", "X[a, i] * Y[a, j]"),
        }

    def _moduli(self) -> str:
        """Source of mul_moduli(X, x, least), whose result is real."""
        real = "float32" if self.target.dtype == "float32" else "float64"
        head = [f"out = numpy.zeros({self.m}, dtype=numpy.{real})", f"for i in range({self.m}):"]
        inner = ["    for e in range(STARTS[i], STARTS[i + 1]):", "        out[i] += abs(X[i, FILLED[e]]) * (abs(x[FILLED[e]]) + least)"]
        return function("mul_moduli(X, x, least)", *head, *inner, "return out")

    @property
    def _matrices(self) -> dict[str, Callable[[], str]]:
        """Operations on entries of matrices."""
        d, m = self.d, self.m
        return {
            "plus_mm": self._each("plus_mm(X, Y)", "X[i, j] + Y[i, j]", m, symmetric=m),
            "scale_mm": self._each("scale_mm(w, X)", "w * X[i, j]", m, symmetric=m),
            "scale_dd": self._each("scale_dd(w, X)", "w * X[i, j]", d, symmetric=d),
            "minus_md": self._each("minus_md(X, Y)", "X[i, j] - Y[i, j]", m, symmetric=d),
            "scale_md": self._each("scale_md(w, X)", "w * X[i, j]", m, symmetric=d),
            "outer_md": self._each("outer_md(y, x, X)", "y[i] * x[j] + X[i, j]", m, symmetric=d),
            "axpy_dd": self._each("axpy_dd(w, X, Y)", "w * X[i, j] + Y[i, j]", d, symmetric=d),
            "identity_plus": self._each("identity_plus(w, X)", "(1.0 if i == j else 0.0) + w * X[i, j]", d, symmetric=d),
            "identity_d": self._each("identity_d(q)", "(1.0 if i == j else 0.0) + 0.0 * q[0]", d, symmetric=d),
            "transpose": self._each("transpose(X)", "X[j, i]", d, symmetric=d),
            "identity_minus": self._each("identity_minus(w, X)", "(1.0 if i == j else 0.0) - w * X[i, j]", m, symmetric=m),
        }

    @property
    def _solvers(self) -> dict[str, Callable[[], str]]:
        """Solutions of linear systems."""
        d, m, stages = self.d, self.m, self.target.stages
        return {
            "solve": lambda: self._solver("solve(A, b)", m, least_squares=True),
            "solve_d": lambda: self._solver("solve_d(A, b)", d),
            "solve_dm": lambda: self._solver("solve_dm(A, b, X)", d, m),
            "solve_dd": lambda: self._solver("solve_dd(A, b, X)", d, d),
            "solve_mass": lambda: self._solver("solve_mass(A, b)", d, massless=self.massless),
            "solve_mass_m": lambda: self._solver("solve_mass_m(A, b, X)", d, m, massless=self.massless),
            "solve_mass_d": lambda: self._solver("solve_mass_d(A, b, X)", d, d, massless=self.massless),
            "solve_2m": self._solve_2m,
            "solve_stages": lambda: self._solve_blocks("solve_stages", stages, m),
            "solve_stages_but_one": lambda: self._solve_blocks("solve_stages_but_one", stages - 1, m),
            "solve_stages_twice": lambda: self._solve_blocks("solve_stages_twice", 2 * stages, m),
            "solve_stages_twice_d": lambda: self._solve_blocks("solve_stages_twice_d", 2 * stages, d),
        }

    def _kernel(self, n: int, columns: int, *, least_squares: bool) -> tuple[list[str], str]:
        """Lines that solve the system in the array ``a``, and the source of the pivot."""
        file = "least_squares" if least_squares and self.target.least_squares and n > 1 else "elimination"
        *body, pivot = lines(file, {"UNKNOWNS": str(n), "COLUMNS": str(columns), "DEPENDENT": DEPENDENT[self.target.dtype]})
        return body, pivot.removeprefix("return ")

    def _solver(self, signature: str, n: int, rows: int = 0, *, least_squares: bool = False, massless: Sequence[int] = ()) -> str:
        """Source of the solutions for b and the rows of X; entries without mass are 0, as if their rows were infinite."""
        body, pivot = self._kernel(n, n + 1 + rows, least_squares=least_squares)
        fill = [f"for i in range({n}):", f"    for j in range({n}):", "        a[i, j] = A[i, j]", f"    a[i, {n}] = b[i]"]
        fill += [f"    for r in range({rows}):", f"        a[i, {n + 1} + r] = X[r, i]"] * bool(rows)
        for k in massless:
            fill += [f"a[{k}, :] = 0.0", f"a[:{n}, {k}] = 0.0", f"a[{k}, {k}] = 1.0"]
        result = f"return a[:, {n}].copy(), {pivot}"
        if rows:
            back = [
                f"Y = numpy.empty(({rows}, {n}), dtype=numpy.{self.target.dtype})",
                f"for r in range({rows}):",
                f"    for i in range({n}):",
            ]
            body = [*body, *back, f"        Y[r, i] = a[i, {n + 1} + r]"]
            result = f"return a[:, {n}].copy(), Y, {pivot}"
        return function(signature, f"a = numpy.empty(({n}, {n + 1 + rows}), dtype=numpy.{self.target.dtype})", *fill, *body, result)

    def _solve_blocks(self, name: str, blocks: int, size: int) -> str:
        """Source of name(B, b): sum_j B[i][j] x[j] = b[i] for this many blocks of equal size."""
        n, K = blocks * size, range(blocks)
        body, pivot = self._kernel(n, n + 1, least_squares=size == self.m)
        fill = [f"for i in range({size}):", f"    for j in range({size}):"]
        fill += [f"        a[{r * size} + i, {c * size} + j] = B[{r}][{c}][i, j]" for r in K for c in K]
        fill += [f"    a[{r * size} + i, {n}] = b[{r}][i]" for r in K]
        parts = "".join(f"a[{r * size}:{(r + 1) * size}, {n}].copy(), " for r in K)
        return function(
            f"{name}(B, b)", f"a = numpy.empty(({n}, {n + 1}), dtype=numpy.{self.target.dtype})", *fill, *body, f"return ({parts}), {pivot}"
        )

    def _solve_2m(self) -> str:
        """Source of solve_2m(A, B, C, D, b, c): the block system [[A, B], [C, D]] (x, y) = (b, c)."""
        blocks = self._solve_blocks("_solve_2m", 2, self.m)
        return blocks + function("solve_2m(A, B, C, D, b, c)", "z, pivot = _solve_2m(((A, B), (C, D)), (b, c))", "return z[0], z[1], pivot")
