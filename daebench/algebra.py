"""The *values* algebra: vectors are tuples, operations straight-line code generated for d positions and m constraints.

Structural zeros of G are left out of every product that has a Jacobian of constraints as its first factor.
"""

from collections.abc import Callable, Sequence

from daebench.codegen import function, pack

UNROLLED = 10
"""Unknowns up to which elimination of stages is unrolled; above, it would be compiled for longer than it is worth."""


def _sum(terms: Sequence[str]) -> str:
    return " + ".join(terms) or "0.0"


class Values:
    """Source of the functions declared in ``kernels/hole.py`` under *algebra*, for tuples of fixed length.

    Parameters
    ----------
    d, m : int
        Numbers of positions and of constraints.
    structure : sequence of sequence of bool, shape(m, d)
        Where G is not zero.
    inverse_mass : sequence of sequence of bool, shape(d, d)
        Where H_pp is not zero.
    stages : int
        Number of stages of the scheme.
    dtype : str
        Name of the run's number type.
    """

    def __init__(
        self,
        d: int,
        m: int,
        structure: Sequence[Sequence[bool]],
        inverse_mass: Sequence[Sequence[bool]],
        *,
        stages: int = 1,
        dtype: str = "float64",
    ) -> None:
        self.d, self.m, self.structure, self.inverse_mass = d, m, structure, inverse_mass
        self.stages, self.dtype = stages, dtype

    def source(self, name: str) -> str | None:
        """Return the source of the operation of this name, or None if there is none."""
        rule = self._rules.get(name)
        return None if rule is None else rule()

    @property
    def _rules(self) -> dict[str, Callable[[], str]]:
        d, m = range(self.d), range(self.m)
        columns = [[i for i in d if self.structure[a][i]] for a in m]
        rows = [[a for a in m if self.structure[a][i]] for i in d]

        def vector(signature: str, entry: str, over: range) -> Callable[[], str]:
            return lambda: function(signature, "return " + pack(entry.format(i=i) for i in over))

        def matrix(signature: str, entry: Callable[[int, int], str], left: range, right: range) -> Callable[[], str]:
            return lambda: function(signature, "return " + pack(pack(entry(i, j) for j in right) for i in left))

        return {
            "axpy": vector("axpy(w, x, y)", "w * x[{i}] + y[{i}]", d),
            "scale": vector("scale(w, x)", "w * x[{i}]", d),
            "axpy_m": vector("axpy_m(w, x, y)", "w * x[{i}] + y[{i}]", m),
            "scale_m": vector("scale_m(w, x)", "w * x[{i}]", m),
            "zero_m": vector("zero_m(q)", "0.0 * q[0]", m),
            "dot": lambda: function("dot(x, y)", "return " + _sum([f"x[{i}] * y[{i}]" for i in d])),
            "dot_moduli": lambda: function("dot_moduli(x, y)", "return " + _sum([f"abs(x[{i}] * y[{i}])" for i in d])),
            "norm": lambda: function("norm(x)", "return " + _sum([f"abs(x[{i}])" for i in d])),
            "norm_m": lambda: function("norm_m(x)", "return " + _sum([f"abs(x[{i}])" for i in m])),
            "mul": lambda: function("mul(X, v)", "return " + pack(_sum([f"X[{a}][{i}] * v[{i}]" for i in columns[a]]) for a in m)),
            "mul_full": lambda: function("mul_full(X, v)", "return " + pack(_sum([f"X[{a}][{i}] * v[{i}]" for i in d]) for a in m)),
            "mul_T": lambda: function("mul_T(X, y)", "return " + pack(_sum([f"X[{a}][{i}] * y[{a}]" for a in rows[i]]) for i in d)),
            "mul_full_T": lambda: function("mul_full_T(X, y)", "return " + pack(_sum([f"X[{a}][{i}] * y[{a}]" for a in m]) for i in d)),
            "gram": matrix("gram(X, Y)", lambda a, b: _sum([f"X[{a}][{i}] * Y[{b}][{i}]" for i in columns[a]]), m, m),
            "gram_full": matrix("gram_full(X, Y)", lambda a, b: _sum([f"X[{a}][{i}] * Y[{b}][{i}]" for i in d]), m, m),
            "plus_mm": matrix("plus_mm(X, Y)", lambda a, b: f"X[{a}][{b}] + Y[{a}][{b}]", m, m),
            "scale_mm": matrix("scale_mm(w, X)", lambda a, b: f"w * X[{a}][{b}]", m, m),
            "scale_dd": matrix("scale_dd(w, X)", lambda i, j: f"w * X[{i}][{j}]", d, d),
            "minus_md": matrix("minus_md(X, Y)", lambda a, i: f"X[{a}][{i}] - Y[{a}][{i}]", m, d),
            "jacobian_times": matrix(
                "jacobian_times(X, S)",
                lambda a, i: _sum([f"X[{a}][{j}] * S[{j}][{i}]" for j in columns[a] if self.inverse_mass[j][i]]),
                m,
                d,
            ),
            "scale_md": matrix("scale_md(w, X)", lambda a, i: f"w * X[{a}][{i}]", m, d),
            "outer_md": matrix("outer_md(y, x, X)", lambda a, i: f"y[{a}] * x[{i}] + X[{a}][{i}]", m, d),
            "apply_md": matrix("apply_md(S, X)", lambda a, i: _sum([f"S[{i}][{j}] * X[{a}][{j}]" for j in d]), m, d),
            "apply": lambda: function("apply(S, x)", "return " + pack(_sum([f"S[{i}][{j}] * x[{j}]" for j in d]) for i in d)),
            "axpy_dd": matrix("axpy_dd(w, X, Y)", lambda i, j: f"w * X[{i}][{j}] + Y[{i}][{j}]", d, d),
            "identity_plus": matrix("identity_plus(w, X)", lambda i, j: f"{'1.0 + ' * (i == j)}w * X[{i}][{j}]", d, d),
            "identity_d": matrix("identity_d(q)", lambda i, j: f"{float(i == j)} + 0.0 * q[0]", d, d),
            "transpose": matrix("transpose(X)", lambda i, j: f"X[{j}][{i}]", d, d),
            "product": matrix("product(X, Y)", lambda i, j: _sum([f"X[{i}][{k}] * Y[{k}][{j}]" for k in d]), d, d),
            "product_T": matrix("product_T(X, Y)", lambda i, j: _sum([f"X[{a}][{i}] * Y[{a}][{j}]" for a in m]), d, d),
            "solve": lambda: solver("solve", self.m, ()),
            "solve_d": lambda: solver("solve_d", self.d, ()),
            "solve_dm": lambda: solver("solve_dm", self.d, m),
            "solve_dd": lambda: solver("solve_dd", self.d, d),
            "solve_2m": self._solve_2m,
            "solve_stages": lambda: self._solve_blocks("solve_stages", self.stages, self.m),
            "solve_stages_but_one": lambda: self._solve_blocks("solve_stages_but_one", self.stages - 1, self.m),
            "solve_stages_twice": lambda: self._solve_blocks("solve_stages_twice", 2 * self.stages, self.m),
            "solve_stages_twice_d": lambda: self._solve_blocks("solve_stages_twice_d", 2 * self.stages, self.d),
            "solve_2d": self._solve_2d,
        }

    def _solve_blocks(self, name: str, blocks: int, size: int) -> str:
        """Source of name(B, b): sum_j B[i][j] x[j] = b[i] for so many blocks of one size."""
        n = blocks * size
        whole = pack(pack(f"B[{i // size}][{j // size}][{i % size}][{j % size}]" for j in range(n)) for i in range(n))
        right = pack(f"b[{i // size}][{i % size}]" for i in range(n))
        parts = pack(pack(f"z[{i * size + k}]" for k in range(size)) for i in range(blocks))
        main = function(f"{name}(B, b)", f"z, pivot = _{name}({whole}, {right})", f"return {parts}, pivot")
        inner = solver(f"_{name}", n, ()) if n <= UNROLLED else looping_solver(f"_{name}", n, self.dtype)
        return inner + main

    def _solve_2d(self) -> str:
        """Source of solve_2d(A, b): A (x, y) = b for two halves of the size of a state's."""
        halves = [pack(f"z[{i}]" for i in range(k * self.d, (k + 1) * self.d)) for k in (0, 1)]
        main = function("solve_2d(A, b)", "z, pivot = _solve_2d(A, b)", f"return {halves[0]}, {halves[1]}, pivot")
        return solver("_solve_2d", 2 * self.d, ()) + main

    def _solve_2m(self) -> str:
        """Source of solve_2m(A, B, C, D, b, c): the block system [[A, B], [C, D]] (x, y) = (b, c)."""
        m = self.m
        blocks = {(0, 0): "A", (0, 1): "B", (1, 0): "C", (1, 1): "D"}
        whole = pack(pack(f"{blocks[i // m, j // m]}[{i % m}][{j % m}]" for j in range(2 * m)) for i in range(2 * m))
        right = pack([f"b[{i}]" for i in range(m)] + [f"c[{i}]" for i in range(m)])
        halves = [pack(f"z[{i}]" for i in range(k * m, (k + 1) * m)) for k in (0, 1)]
        main = function("solve_2m(A, B, C, D, b, c)", f"z, pivot = _solve_2m({whole}, {right})", f"return {halves[0]}, {halves[1]}, pivot")
        return solver("_solve_2m", 2 * m, ()) + main


def looping_solver(name: str, n: int, dtype: str) -> str:
    """Source of the same elimination as :func:`solver`'s, in loops over arrays: slower for few unknowns, and soon compiled for many."""
    return function(
        f"{name}(A, b)",
        f"a = numpy.empty(({n}, {n + 1}), dtype=numpy.{dtype})",
        *(f"a[{i}, {j}] = A[{i}][{j}]" for i in range(n) for j in range(n)),
        *(f"a[{i}, {n}] = b[{i}]" for i in range(n)),
        f"s = numpy.abs(a[:, :{n}])",
        f"scale = numpy.empty({n}, dtype=s.dtype)",
        f"for i in range({n}):",
        "    scale[i] = s[i].max()",
        "pivot = INF",
        f"for k in range({n}):",
        "    best = k",
        f"    for i in range(k + 1, {n}):",
        "        if abs(a[i, k]) * scale[best] > abs(a[best, k]) * scale[i]:",
        "            best = i",
        "    if best != k:",
        f"        for j in range(k, {n + 1}):",
        "            a[k, j], a[best, j] = a[best, j], a[k, j]",
        f"        for j in range(k, {n}):",
        "            s[k, j], s[best, j] = s[best, j], s[k, j]",
        "        scale[k], scale[best] = scale[best], scale[k]",
        "    share = abs(a[k, k]) / s[k, k] if s[k, k] > 0.0 else 0.0 * scale[k]",
        "    if not share >= pivot:",
        "        pivot = share",
        f"    for i in range(k + 1, {n}):",
        "        f = a[i, k] / a[k, k]",
        f"        for j in range(k + 1, {n}):",
        "            a[i, j] -= f * a[k, j]",
        "            s[i, j] += abs(f) * s[k, j]",
        f"        a[i, {n}] -= f * a[k, {n}]",
        f"for k in range({n - 1}, -1, -1):",
        f"    for j in range(k + 1, {n}):",
        f"        a[k, {n}] -= a[k, j] * a[j, {n}]",
        f"    a[k, {n}] = a[k, {n}] / a[k, k]",
        f"return {pack(f'a[{i}, {n}]' for i in range(n))}, pivot",
    )


def solver(name: str, n: int, extra: Sequence[int]) -> str:
    """Source of Gaussian elimination with scaled partial pivoting, unrolled.

    ``name(A, b)`` returns x and the smallest relative pivot; with extra right sides ``name(A, b, X)`` returns x, the solutions for
    the rows of X, and the pivot. A pivot is taken relative to the sum of moduli of the terms that it was computed from: it is the
    share that cancellation has left, and scaling rows or columns (masses between 1e-8 and 1e8, say) does not change it. For a matrix
    of one entry nothing can cancel: its relative pivot is 1, or 0 if it is 0.
    """
    N = range(n)
    sides = ["x", *(f"y{r}_" for r in extra)]
    lines = [f"a{i}_{j} = A[{i}][{j}]" for i in N for j in N] + [f"x{i} = b[{i}]" for i in N]
    lines += [f"y{r}_{i} = X[{r}][{i}]" for r in extra for i in N]
    lines += [f"s{i}_{j} = abs(a{i}_{j})" for i in N for j in N] if n > 1 else []
    lines += [f"scale{i} = " + _largest([f"s{i}_{j}" for j in N]) for i in N] if n > 1 else []
    for k in N:
        lines += _elimination(k, n, sides)
    for k in reversed(N):
        for side in sides:
            lines += [f"{side}{k} = {side}{k} - a{k}_{j} * {side}{j}" for j in range(k + 1, n)]
            lines.append(f"{side}{k} = {side}{k} / a{k}_{k}")
    if n == 1:
        lines.append("pivot = 1.0 if abs(a0_0) > 0.0 else 0.0")
    else:
        lines.append("pivot = abs(a0_0) / s0_0 if s0_0 > 0.0 else 0.0")
        lines += [f"pivot = min(pivot, abs(a{k}_{k}) / s{k}_{k} if s{k}_{k} > 0.0 else 0.0)" for k in N if k]
    solution = pack(f"x{i}" for i in N)
    if not extra:
        return function(f"{name}(A, b)", *lines, f"return {solution}, pivot")
    others = pack(pack(f"y{r}_{i}" for i in N) for r in extra)
    return function(f"{name}(A, b, X)", *lines, f"return {solution}, {others}, pivot")


def _largest(items: Sequence[str]) -> str:
    return items[0] if len(items) == 1 else f"max({', '.join(items)})"


def _elimination(k: int, n: int, sides: Sequence[str]) -> list[str]:
    """Source of step k: the largest of the column's rest is swapped up to the pivot's place, then what is below it eliminated."""
    lines = []
    names = [f"{matrix}{{0}}_{j}" for matrix in "as" for j in range(k, n)] + [f"{side}{{0}}" for side in (*sides, "scale")]
    for i in range(k + 1, n):
        upper, lower = (", ".join(x.format(r) for x in names) for r in (k, i))
        lines.append(f"if abs(a{i}_{k}) * scale{k} > abs(a{k}_{k}) * scale{i}: {upper}, {lower} = {lower}, {upper}")
    for i in range(k + 1, n):
        lines.append(f"f = a{i}_{k} / a{k}_{k}")
        lines += [f"a{i}_{j} = a{i}_{j} - f * a{k}_{j}" for j in range(k + 1, n)]
        lines += [f"s{i}_{j} = s{i}_{j} + abs(f) * s{k}_{j}" for j in range(k + 1, n)]
        lines += [f"{side}{i} = {side}{i} - f * {side}{k}" for side in sides]
    return lines
