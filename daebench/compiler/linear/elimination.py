"""Linear solvers for matrices of fixed size: Gaussian elimination with scaled partial pivoting, number by number or with arrays."""

from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

from daebench.compiler.linear.kernels import array_solver, eliminating_dual, least_squares_dual

UNROLLED = 10
"""Number of unknowns up to which elimination is unrolled; with ten, loops take twice as long, and compile four times as fast."""

UNROLLED_ENTRIES = 40
"""Number of entries of matrix and right sides up to which elimination with several right sides is unrolled; with 42, loops are as fast."""

CHOICES = """
def exchanged(test, x, y):
    if test:
        x, y = y, x
    return x, y


def share(x, s):
    return x / s if s > 0.0 else 0.0


def nonzero(x):
    return 1.0 if abs(x) > 0.0 else 0.0


def exceeds(x, bound):
    return 1.0 if abs(x) > bound else 0.0
"""
"""Source of the choices that operations make between numbers which may not be known yet."""


class Target(NamedTuple):
    """Properties of the code that an algebra is written for."""

    dtype: str
    """Name of the number type."""
    stages: int
    """Number of stages of the scheme."""
    least_squares: bool
    """Whether systems of constraints are solved by least squares, which leave out dependent constraints."""
    directions: int = 0
    """Number of directions in which numbers carry derivatives."""
    lanes: bool = False
    """Whether numbers are lanes."""


class Solvers:
    """Solutions of linear systems, by the names of ``kernels/language.py``; the parameters are those of the algebra of tuples."""

    def __init__(self, d: int, m: int, mass: Sequence[Sequence[int]], target: Target) -> None:
        self.d, self.m, self.mass, self.target = d, m, mass, target
        s = target.stages
        self.plain: dict[str, tuple[int, int | None]] = {"solve": (m, None), "solve_d": (d, None), "solve_dm": (d, m), "solve_dd": (d, d)}
        self.of_mass: dict[str, int | None] = {"solve_mass": None, "solve_mass_m": m, "solve_mass_d": d}
        self.blocks = {"solve_stages": (s, m), "solve_stages_but_one": (s - 1, m), "solve_stages_twice": (2 * s, m)}
        self.blocks |= {"solve_stages_twice_d": (2 * s, d), "solve_2m": (2, m), "solve_2d": (2, d)}
        self.names = [*self.plain, *self.of_mass, *self.blocks]

    def provide(self, name: str, space: Any) -> None:
        """Bring a solver into a module: ``space`` has the names that operations call, adds source, and takes operations."""
        if name in self.plain:
            n, rows = self.plain[name]
            self._provide(name, n, rows, space, of_constraints=name == "solve")
        elif name in self.of_mass:
            self._provide_blocked(name, self.of_mass[name], space)
        else:
            blocks, size = self.blocks[name]
            self._provide(f"_{name}", blocks * size, None, space, of_constraints=size == self.m and name != "solve_2d")
            whole = _of_four if name == "solve_2m" else _of_halves if name == "solve_2d" else _of_blocks
            space.take(name, partial(whole, space.names[f"_{name}"], blocks, size))

    def _provide(self, name: str, n: int, rows: int | None, space: Any, *, of_constraints: bool = False) -> None:
        """Bring a solver of n unknowns, and this many right sides more, into a module: by least squares, by elimination, or in loops."""
        target = self.target
        if of_constraints and target.least_squares and n != 1:
            space.add(
                least_squares_dual(name, n, target.directions)
                if target.directions
                else array_solver("least_squares", name, n, target.dtype)
            )
        elif n * (n + rows) <= UNROLLED_ENTRIES if rows else n <= UNROLLED:
            space.take(name, partial(eliminated, n, target, space.names))
        elif target.directions:
            space.add(eliminating_dual(name, n, target.directions, rows))
        else:
            space.add(array_solver("elimination", name, n, target.dtype, rows))

    def _provide_blocked(self, name: str, rows: int | None, space: Any) -> None:
        """Bring a solver block by block into a module, for a symmetric matrix whose rows couple only within sets of indices."""
        if len(self.mass) == 1 and len(self.mass[0]) == self.d:
            self._provide(name, self.d, rows, space)
            return
        for size in sorted({len(block) for block in self.mass}):
            self._provide(f"_{name}_{size}", size, rows, space)
        space.take(name, partial(_block_by_block, space.names, name, self.d, self.mass))


def _of_blocks(solver: Any, blocks: int, size: int, B: Any, b: Any) -> Any:
    """Return the x with sum_j B[i][j] x[j] = b[i], for this many blocks of equal size, and the pivot."""
    n = range(blocks * size)
    A = tuple([tuple([B[i // size][j // size][i % size][j % size] for j in n]) for i in n])
    z, pivot = solver(A, tuple([b[i // size][i % size] for i in n]))
    return tuple([tuple([z[i * size + k] for k in range(size)]) for i in range(blocks)]), pivot


def _of_four(solver: Any, blocks: int, size: int, A: Any, B: Any, C: Any, D: Any, b: Any, c: Any) -> Any:
    """Return x and y with [[A, B], [C, D]] (x, y) = (b, c), and the pivot."""
    (x, y), pivot = _of_blocks(solver, blocks, size, ((A, B), (C, D)), (b, c))
    return x, y, pivot


def _of_halves(solver: Any, blocks: int, size: int, A: Any, b: Any) -> Any:
    """Return both halves of the x with A x = b, and the pivot."""
    z, pivot = solver(A, b)
    return tuple(z[:size]), tuple(z[size:]), pivot


def _block_by_block(names: Any, name: str, n: int, blocks: Sequence[Sequence[int]], A: Any, b: Any, *others: Any) -> Any:
    """Return the solution; entries for an index in no block are 0, as if its row of the matrix were infinite."""
    place = {i: (k, j) for k, block in enumerate(blocks) for j, i in enumerate(block)}
    solutions = []
    for block in blocks:
        part = [tuple([tuple([A[i][j] for j in block]) for i in block]), tuple([b[i] for i in block])]
        part += [tuple([tuple([row[i] for i in block]) for row in X]) for X in others]
        solutions.append(names[f"_{name}_{len(block)}"](*part))

    # Without a block, 0 is a product: so it is a number of the type of the others, with derivatives if they have some.
    def joined(parts: Sequence[Any]) -> tuple[Any, ...]:
        return tuple([parts[place[i][0]][place[i][1]] if i in place else 0.0 * solutions[0][0][0] for i in range(n)])

    x = joined([part[0] for part in solutions])
    rows = [tuple([joined([part[1][r] for part in solutions]) for r in range(len(X))]) for X in others]
    pivots = [part[-1] for part in solutions]
    return x, *rows, names["min"](*pivots) if len(pivots) > 1 else pivots[0]


def eliminated(n: int, target: Target, names: Any, A: Any, b: Any, *others: Any) -> Any:
    """Return x with A x = b, the solutions for the rows of X where there are some, and the smallest relative pivot.

    It is Gaussian elimination with scaled partial pivoting. A pivot is taken relative to the sum of moduli of the terms that it was
    computed from: it is the fraction that cancellation has left, and scaling rows or columns (masses between 1e-8 and 1e8, say) does not
    change it. In a matrix with one entry nothing can cancel: its relative pivot is 1, or 0 if it is 0.
    """
    N, sides, dual = range(n), (b, *(row for X in others for row in X)), target.directions > 0
    read = names["value"] if dual else lambda x: x
    rows = []
    for i in N:
        entries = [read(A[i][j]) for j in N]
        moduli = [abs(x) for x in entries] if n > 1 else []
        rows.append((entries, [read(side[i]) for side in sides], [*moduli, names["max"](*moduli)] if n > 1 else []))
    steps = [_step(k, rows, names["exchanged"]) for k in N]
    solutions = []
    for r in range(len(sides)):
        x: dict[int, Any] = {}
        for k in reversed(N):
            remainder = steps[k].sides[r]
            for j in range(k + 1, n):
                remainder = remainder - steps[k].entries[j - k] * x[j]
            x[k] = remainder / steps[k].entries[0]
        solutions.append(tuple([x[k] for k in N]))
    if dual:
        solutions = [_differentiated(A, side, steps, x, names) for side, x in zip(sides, solutions, strict=True)]
    solution, *rest = solutions
    return solution, *([tuple(rest)] if others else []), _pivot(steps, target, names)


class Step(NamedTuple):
    """A step of elimination: the row of the pivot, its right sides and sums of moduli, and exchanges and factors of the rows below."""

    entries: Sequence[Any]
    sides: Sequence[Any]
    moduli: Sequence[Any]
    exchanges: Sequence[Any]
    factors: Sequence[Any]


def _step(k: int, rows: list[Any], exchanged: Any) -> Step:
    """Exchange the row with the largest pivot with row k, and eliminate the entries below the pivot."""
    exchanges, factors = [], []
    for i in range(k + 1, len(rows)):
        top, row = rows[k], rows[i]
        test = abs(row[0][0]) * top[2][-1] > abs(top[0][0]) * row[2][-1]
        exchanges.append(test)
        rows[k], rows[i] = exchanged(test, tuple(map(tuple, top)), tuple(map(tuple, row)))
    entries, sides, moduli = rows[k]
    for i in range(k + 1, len(rows)):
        of_row, of_sides, sums = rows[i]
        f = of_row[0] / entries[0]
        factors.append(f)
        below = [x - f * y for x, y in zip(of_row[1:], entries[1:], strict=True)]
        right = [x - f * y for x, y in zip(of_sides, sides, strict=True)]
        size = [x + abs(f) * y for x, y in zip(sums[1:-1], moduli[1:-1], strict=True)]
        rows[i] = below, right, [*size, sums[-1]]
    return Step(entries, sides, moduli, exchanges, factors)


def _pivot(steps: Sequence[Step], target: Target, names: Any) -> Any:
    """Return the smallest relative pivot; 1 of a system without unknowns, which is regular."""
    if not steps:
        return 1.0
    first, *others = [(abs(step.entries[0]), step.moduli[0] if step.moduli else None) for step in steps]
    if not others:
        return names["nonzero"](steps[0].entries[0])
    if target.lanes:
        return names["smallest_share"](first[1], tuple([x for x, _ in others]), tuple([s for _, s in others]))
    pivot = names["share"](*first)
    for other in others:
        pivot = names["min"](pivot, names["share"](*other))
    return pivot


def _differentiated(A: Any, side: Any, steps: Sequence[Step], x: Sequence[Any], names: Any) -> tuple[Any, ...]:
    """Return a solution with its derivatives, A dx = db - dA x, from exchanges and factors of the elimination."""
    N, select = range(len(x)), names["select"]
    r = []
    for i in N:
        product = A[i][0] * x[0]
        for j in N[1:]:
            product = product + A[i][j] * x[j]
        r.append(side[i] - product)
    for k in N:
        for i, test in zip(N[k + 1 :], steps[k].exchanges, strict=True):
            r[k], r[i] = select(test, r[i], r[k]), select(test, r[k], r[i])
        for i, f in zip(N[k + 1 :], steps[k].factors, strict=True):
            r[i] = r[i] - f * r[k]
    for k in reversed(N):
        for j in N[k + 1 :]:
            r[k] = r[k] - steps[k].entries[j - k] * r[j]
        r[k] = r[k] / steps[k].entries[0]
    return tuple([names["with_tangents"](x[i], r[i]) for i in N])
