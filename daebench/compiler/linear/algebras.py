"""The algebras: how the operations of a scheme on vectors and matrices are carried out.

*Values* are tuples, whose numbers are computed one by one. In *loops*, vectors are arrays of one axis and matrices of two, for so many
unknowns that straight-line code would be too long. *Arrays* have any length, and operations of NumPy. The structural zeros of G are left
out of each product that has a Jacobian of constraints as its first factor. Entries are texts, because loops are written of them.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

from daebench.compiler.linear.elimination import Solvers, Target
from daebench.compiler.linear.kernels import array_solver, solver
from daebench.compiler.syntax import Lines, function, one_of, pack


class Operation(NamedTuple):
    """An operation, entry by entry."""

    parameters: str
    shape: str
    """Lengths of the result: "" of a number, a letter of a vector, two of a matrix."""
    entry: str
    """The entry with the indices i and j, or its terms, with k."""
    over: str = ""
    """What is summed over: "d" or "m"; "row", the entries of row i of G that are not 0; "column" and "light", which reverse this."""


OPERATIONS: Mapping[str, Operation] = {
    "axpy": Operation("w, x, y", "d", "w * x[i] + y[i]"),
    "axpy_m": Operation("w, x, y", "m", "w * x[i] + y[i]"),
    "scale": Operation("w, x", "d", "w * x[i]"),
    "scale_m": Operation("w, x", "m", "w * x[i]"),
    "zero_m": Operation("q", "m", "0.0 * q[0]"),
    "dot": Operation("x, y", "", "x[k] * y[k]", "d"),
    "dot_moduli": Operation("x, y", "", "abs(x[k] * y[k])", "d"),
    "exceeding": Operation("y, bound", "", "exceeds(y[k], bound[k])", "m"),
    "norm_m": Operation("x", "", "modulus(x[k])", "m"),
    "mul": Operation("X, v", "m", "X[i][k] * v[k]", "row"),
    "mul_moduli": Operation("X, x, least", "m", "abs(X[i][k]) * (abs(x[k]) + least)", "row"),
    "mul_full": Operation("X, v", "m", "X[i][k] * v[k]", "d"),
    "mul_T": Operation("X, y", "d", "X[k][i] * y[k]", "column"),
    "mul_full_T": Operation("X, y", "d", "X[k][i] * y[k]", "m"),
    "apply": Operation("S, x", "d", "S[i][k] * x[k]", "d"),
    "gram": Operation("X, Y", "mm", "X[i][k] * Y[j][k]", "row"),
    "gram_full": Operation("X, Y", "mm", "X[i][k] * Y[j][k]", "d"),
    "jacobian_times": Operation("X, S", "md", "X[i][k] * S[k][j]", "light"),
    "apply_md": Operation("S, X", "md", "S[j][k] * X[i][k]", "d"),
    "product": Operation("X, Y", "dd", "X[i][k] * Y[k][j]", "d"),
    "product_T": Operation("X, Y", "dd", "X[k][i] * Y[k][j]", "m"),
    "scale_mm": Operation("w, X", "mm", "w * X[i][j]"),
    "scale_dd": Operation("w, X", "dd", "w * X[i][j]"),
    "scale_md": Operation("w, X", "md", "w * X[i][j]"),
    "plus_mm": Operation("X, Y", "mm", "X[i][j] + Y[i][j]"),
    "minus_md": Operation("X, Y", "md", "X[i][j] - Y[i][j]"),
    "outer_md": Operation("y, x, X", "md", "y[i] * x[j] + X[i][j]"),
    "axpy_dd": Operation("w, X, Y", "dd", "w * X[i][j] + Y[i][j]"),
    "identity_plus": Operation("w, X", "dd", "1.0 + w * X[i][j] if i == j else w * X[i][j]"),
    "identity_minus": Operation("w, X", "mm", "1.0 - w * X[i][j] if i == j else -w * X[i][j]"),
    "identity_d": Operation("q", "dd", "float(i == j) + 0.0 * q[0]"),
    "transpose": Operation("X", "dd", "X[j][i]"),
}
"""The operations that :mod:`daebench.compiler.shapes` and ``kernels/language.py`` name, but norms and solutions."""

UNITS = {
    "identity_plus": "(1.0 if i == j else 0.0) + w * X[i][j]",
    "identity_minus": "(1.0 if i == j else 0.0) - w * X[i][j]",
    "identity_d": "(1.0 if i == j else 0.0) + 0.0 * q[0]",
}
"""Entries in loops, where it is not known whether indices are equal."""

SUMMED = {"row": "filled[i]", "column": "rows[i]", "light": "light[i][j]"}
"""What is summed over in tuples."""


class Values:
    """Operations on tuples of fixed length. Shapes: structure (m, d); inverse_mass (d, d)."""

    elementwise = True
    """Whether entries may be arrays in place of numbers, so that a function applies to many states at once."""

    def __init__(
        self,
        d: int,
        m: int,
        structure: Sequence[Sequence[Any]],
        inverse_mass: Sequence[Sequence[Any]],
        target: Target,
        mass: Sequence[Sequence[int]] | None = None,
        unmeasured: int = 0,
    ) -> None:
        self.d, self.m, self.target, self.measured = d, m, target, d - unmeasured
        self.structure, self.inverse_mass = ([[int(bool(entry)) for entry in row] for row in rows] for rows in (structure, inverse_mass))
        self.mass = [list(block) for block in mass or [range(d)]]
        self.solvers = Solvers(d, m, self.mass, target)
        self.filled = [[i for i in range(d) if row[i]] for row in self.structure]

    def __repr__(self) -> str:
        return f"Values{(self.d, self.m, self.structure, self.inverse_mass, self.target, self.mass, self.d - self.measured)!r}"

    @property
    def names(self) -> Lines:
        """Names of its operations."""
        return [*OPERATIONS, *self._others({}, _sum), *self.solvers.names]

    def provide(self, name: str, space: Any) -> None:
        """Bring an operation into the names of a module."""
        if name in self.solvers.names:
            self.solvers.provide(name, space)
            return
        total = partial(_sum, none=space.names["float32"](0.0)) if self.target.dtype == "float32" else _sum
        others = self._others(space.names, total)
        space.take(name, others[name] if name in others else self._operation(OPERATIONS[name], space.names, total))

    def _operation(self, rule: Operation, names: Any, total: Callable[..., Any]) -> Any:
        d, m = range(self.d), range(self.m)
        entry = f"total({rule.entry} for k in {SUMMED.get(rule.over, rule.over)})" if rule.over else rule.entry
        for index, length in reversed([*zip("ij", rule.shape, strict=False)]):
            entry = f"tuple([{entry} for {index} in {'range(len(x))' if entry.startswith('w * x[i]') else length}])"
        space = {"d": d, "m": m, "total": total, "filled": self.filled, "modulus": self._modulus(names)}
        if rule.over == "column":
            space["rows"] = [[a for a in m if self.structure[a][i]] for i in d]
        elif rule.over == "light":
            space["light"] = [[[j for j in self.filled[a] if self.inverse_mass[j][i]] for i in d] for a in m]
        elif "exceeds" in entry:
            space["exceeds"] = names["exceeds"]
        return eval(f"lambda {rule.parameters}: {entry}", space)

    def _modulus(self, names: Any) -> Any:
        return names.get("modulus", abs) if self.target.directions else abs

    def _others(self, names: Any, total: Callable[..., Any]) -> dict[str, Callable[..., Any]]:
        """Return the norm, and operations on the halves u and v of a Poisson system's state (u, v, c)."""
        m, d, measured, modulus = self.m, self.d, self.measured, self._modulus(names)
        return {
            "norm": lambda x: total(modulus(x[i]) if i < measured else 0.0 * modulus(x[i]) for i in range(d)),
            "first_half": lambda y: tuple(y[:m]),
            "second_half": lambda y: tuple(y[m : 2 * m]),
            "joined": lambda u, v, y: (*u, *v, *(y[i] for i in range(2 * m, d))),
        }


def _sum(terms: Any, none: Any = 0.0) -> Any:
    """Return a sum from the first term on; if there is none, zero."""
    first, *others = [*terms] or [none]
    for term in others:
        first = first + term
    return first


class Loops:
    """Source of operations on arrays. Each returns a new array, because schemes change nothing in place."""

    elementwise = False
    """Whether entries may be arrays in place of numbers."""

    def __init__(self, values: Values) -> None:
        self.values = values
        self.d, self.m, self.target, self.measured = values.d, values.m, values.target, values.measured
        starts = [sum(map(len, values.filled[:a])) for a in range(self.m + 1)]
        self.tables = {"STARTS": f"numpy.array({starts})", "FILLED": f"numpy.array({[i for row in values.filled for i in row]})"}
        self.massless = sorted(set(range(self.d)) - {i for block in values.mass for i in block})

    def __repr__(self) -> str:
        return f"Loops({self.values!r})"

    @property
    def names(self) -> Lines:
        """Names of its operations."""
        return [*OPERATIONS, "norm", *(name for name in self.values.solvers.names if name != "solve_2d")]

    def provide(self, name: str, space: Any) -> None:
        """Bring an operation into the names of a module."""
        space.add(self.source(name))

    def source(self, name: str) -> str:
        """Return the source of the operation of this name."""
        if name in OPERATIONS:
            return self._operation(name, OPERATIONS[name])
        return self._norm() if name == "norm" else self._solution(name)

    def _operation(self, name: str, rule: Operation) -> str:
        lengths, signature = {"d": self.d, "m": self.m}, f"{name}({rule.parameters})"
        entry = UNITS.get(name, rule.entry).replace("][", ", ").replace("modulus", "abs")
        if not rule.shape:
            if not lengths[rule.over]:
                return function(signature, f"return numpy.{self.target.dtype}(0)")
            first, over = entry.replace("[k]", "[0]"), f"for k in range(1, {lengths[rule.over]}):"
            return function(signature, f"found = {first}", over, f"    found += {entry}", "return found")
        indices = dict(zip("ij", rule.shape, strict=False))
        place, heads = f"out[{', '.join(indices)}]", [f"for {index} in range({lengths[letter]}):" for index, letter in indices.items()]
        if rule.over == "column":
            body = [f"for k in range({self.m}):", *_filled("k", "i"), f"{place} += {entry}"]
        elif rule.over == "light":
            body = [heads[0], *_filled("i", "k"), heads[1], f"{place} += {entry}"]
        elif rule.over:
            inner = _filled("i", "k") if rule.over == "row" else [f"for k in range({lengths[rule.over]}):"]
            body = [*heads, f"{place} = 0.0", *inner, f"{place} += {entry}"]
        else:
            body = [*heads, f"{place} = {entry}"]
        dtype = "float64" if name == "mul_moduli" and self.target.dtype == "complex128" else self.target.dtype
        make, shape = "zeros" if rule.over in ("column", "light") else "empty", tuple(lengths[letter] for letter in rule.shape)
        return function(signature, f"out = numpy.{make}({shape}, dtype=numpy.{dtype})", *_nested(body), "return out")

    def _norm(self) -> str:
        unmeasured = [f"found += 0.0 * abs(x[{i}])" for i in range(self.measured, self.d)]
        over = [f"for i in range(1, {self.measured}):", "    found += abs(x[i])"]
        return function("norm(x)", "found = abs(x[0])", *over, *unmeasured, "return found")

    def _solution(self, name: str) -> str:
        """Source of the solution of a linear system."""
        solvers = self.values.solvers
        if name not in solvers.blocks:
            n, rows = solvers.plain[name] if name in solvers.plain else (self.d, solvers.of_mass[name])
            massless = self.massless if name in solvers.of_mass else ()
            return array_solver(self._file(n, of_constraints=name == "solve"), name, n, self.target.dtype, rows, massless)
        blocks = self._solve_blocks(f"{'_' * (name == 'solve_2m')}{name}", *solvers.blocks[name])
        if name != "solve_2m":
            return blocks
        return blocks + function("solve_2m(A, B, C, D, b, c)", "z, pivot = _solve_2m(((A, B), (C, D)), (b, c))", "return z[0], z[1], pivot")

    def _file(self, n: int, *, of_constraints: bool) -> str:
        """Return the file that solves a system of n unknowns."""
        return "least_squares" if of_constraints and self.target.least_squares and n > 1 else "elimination"

    def _solve_blocks(self, name: str, blocks: int, size: int) -> str:
        """Source of name(B, b): sum_j B[i][j] x[j] = b[i] for this many blocks of equal size."""
        n, K = blocks * size, range(blocks)
        fill = [f"for i in range({size}):", f"    for j in range({size}):"]
        fill += [f"        a[{r * size} + i, {c * size} + j] = B[{r}][{c}][i, j]" for r in K for c in K]
        fill += [f"    a[{r * size} + i, {n}] = b[{r}][i]" for r in K]
        parts = pack(f"a[{r * size}:{(r + 1) * size}, {n}].copy()" for r in K)
        return solver(self._file(n, of_constraints=size == self.m), f"{name}(B, b)", n, n + 1, self.target.dtype, fill, [parts])


def _filled(row: str, column: str) -> Lines:
    """Lines that go through the columns of a row of G whose entries are not 0."""
    return [f"for e in range(STARTS[{row}], STARTS[{row} + 1]):", f"{column} = FILLED[e]"]


def _nested(body: Sequence[str]) -> Lines:
    """Return lines of which each loop has all that follow in it."""
    depths = [sum(line.endswith(":") for line in body[:k]) for k in range(len(body))]
    return ["    " * depth + line for depth, line in zip(depths, body, strict=True)]


class Arrays:
    """Source of operations on arrays of any length."""

    elementwise = False
    """Whether entries may be arrays in place of numbers."""

    names = ("axpy", "axpy_m", "scale", "first_half", "second_half", "joined", "norm", "norm_m")
    """Names of its operations."""

    def __init__(self, n: int) -> None:
        self.n = n

    def __repr__(self) -> str:
        return f"Arrays({self.n})"

    def provide(self, name: str, space: Any) -> None:
        """Bring an operation into the names of a module."""
        half = self.n // 2
        absolute = ["found = abs(x[0])", "for i in range(1, x.shape[0]):", "    found += abs(x[i])", "return found"]
        bodies = {
            "axpy(w, x, y)": ["return w * x + y"],
            "axpy_m(w, x, y)": ["return w * x + y"],
            "scale(w, x)": ["return w * x"],
            "first_half(y)": [f"return y[:{half}]"],
            "second_half(y)": [f"return y[{half}:]"],
            "norm(x)": absolute,
            "norm_m(x)": absolute,
            "joined(u, v, y)": ["out = empty(y.shape[0], dtype=y.dtype)", f"out[:{half}] = u", f"out[{half}:] = v", "return out"],
        }
        space.add(one_of(bodies, name))
