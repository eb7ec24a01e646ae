"""Source of linear solvers for matrices of fixed size: Gaussian elimination with scaled partial pivoting, unrolled or with arrays."""

from collections.abc import Sequence
from typing import NamedTuple

from daebench.compiler.codegen import function, pack
from daebench.compiler.linear.dual_solvers import derivatives_written_out, eliminating_dual
from daebench.compiler.linear.kernels import array_solver

UNROLLED = 10
"""Number of unknowns up to which elimination is unrolled; with ten, loops take twice as long, and compile four times as fast."""

UNROLLED_ENTRIES = 40
"""Number of entries of matrix and right sides up to which elimination with several right sides is unrolled; with 42, loops are as fast."""


class Target(NamedTuple):
    """Properties of the code that an algebra is written for.

    Parameters
    ----------
    dtype : str
        Name of the number type.
    compiled : bool
        Whether functions are compiled.
    stages : int
        Number of stages of the scheme.
    least_squares : bool
        Whether systems of constraints are solved by least squares, which leave out dependent constraints.
    directions : int
        Number of directions in which numbers carry derivatives.
    lanes : bool
        Whether numbers are lanes.
    """

    dtype: str
    compiled: bool
    stages: int
    least_squares: bool
    directions: int = 0
    lanes: bool = False


def eliminating(name: str, n: int, target: Target, rows: int = 0) -> str:
    """Source of elimination with this many extra right sides, unrolled or not according to its size."""
    unrolled = n * (n + rows) <= UNROLLED_ENTRIES if rows else n <= UNROLLED
    return (solver if unrolled else large_solver)(name, n, target, rows)


def large_solver(name: str, n: int, target: Target, rows: int = 0) -> str:
    """Source of elimination for many unknowns, in loops that compile quickly."""
    if target.directions:
        return eliminating_dual(name, n, target.directions, rows)
    return array_solver("elimination", name, n, target.dtype, rows, compiled=target.compiled)


def blocked(name: str, n: int, blocks: Sequence[Sequence[int]], target: Target, rows: int = 0) -> str:
    """Source of elimination block by block, for a symmetric matrix whose rows couple only within these sets of indices.

    Entries of the solution for an index in no set are 0, as if its row of the matrix were infinite.
    """
    if len(blocks) == 1 and len(blocks[0]) == n:
        return eliminating(name, len(blocks[0]), target, rows)
    sizes = sorted({len(block) for block in blocks})
    inner = "".join(eliminating(f"_{name}_{size}", size, target, rows) for size in sizes)
    lines = []
    for k, block in enumerate(blocks):
        arguments = [pack(pack(f"A[{i}][{j}]" for j in block) for i in block), pack(f"b[{i}]" for i in block)]
        arguments += [pack(pack(f"X[{r}][{i}]" for i in block) for r in range(rows))] if rows else []
        lines.append(f"x{k}, {f'y{k}, ' if rows else ''}pivot{k} = _{name}_{len(block)}({', '.join(arguments)})")
    place = {i: (k, j) for k, block in enumerate(blocks) for j, i in enumerate(block)}
    where = [place.get(i) for i in range(n)]
    outputs = [pack(f"x{at[0]}[{at[1]}]" if at else "0.0 * x0[0]" for at in where)]
    outputs += [pack(pack(f"y{at[0]}[{r}][{at[1]}]" if at else "0.0 * x0[0]" for at in where) for r in range(rows))] if rows else []
    pivots = [f"pivot{k}" for k in range(len(blocks))]
    outputs.append(f"min({', '.join(pivots)})" if len(pivots) > 1 else pivots[0])
    return inner + function(f"{name}(A, b{', X' * bool(rows)})", *lines, f"return {', '.join(outputs)}")


def solver(name: str, n: int, target: Target, rows: int = 0) -> str:
    """Source of Gaussian elimination with scaled partial pivoting, unrolled.

    ``name(A, b)`` returns x and the smallest relative pivot. With extra right sides ``name(A, b, X)`` returns x, the solutions for
    the rows of X, and the pivot. A pivot is taken relative to the sum of moduli of the terms that it was computed from: it is the
    fraction that cancellation has left, and scaling rows or columns (masses between 1e-8 and 1e8, say) does not change it. In a matrix
    with one entry nothing can cancel: its relative pivot is 1, or 0 if it is 0.
    """
    N, extra, dual = range(n), range(rows), target.directions > 0
    sides, lines = ["x", *(f"y{r}_" for r in extra)], _first_rows(n, rows, "value({})" if dual else "{}")
    for k in N:
        lines += _elimination(k, n, sides, noted=dual)
    for k in reversed(N):
        for side in sides:
            terms = [f" - a{k}_{j} * {side}{j}" for j in range(k + 1, n)]
            lines.append(f"{side}{k} = ({side}{k}_{''.join(terms)}) / a{k}_{k}")
    if n == 1:
        lines.append("pivot = 1.0 if abs(a0_0) > 0.0 else 0.0")
    elif target.lanes:
        terms = [pack(f"abs(a{k}_{k})" for k in N if k), pack(f"s{k}_{k}" for k in N if k)]
        lines.append(f"pivot = smallest_share(s0_0, {', '.join(terms)})")
    else:
        lines.append("pivot = abs(a0_0) / s0_0 if s0_0 > 0.0 else 0.0")
        lines += [f"pivot = min(pivot, abs(a{k}_{k}) / s{k}_{k} if s{k}_{k} > 0.0 else 0.0)" for k in N if k]
    lines += derivatives_written_out(n, rows) if dual else []
    solution = pack(f"x{i}" for i in N)
    if not extra:
        return function(f"{name}(A, b)", *lines, f"return {solution}, pivot")
    others = pack(pack(f"y{r}_{i}" for i in N) for r in extra)
    return function(f"{name}(A, b, X)", *lines, f"return {solution}, {others}, pivot")


def _first_rows(n: int, rows: int, read: str) -> list[str]:
    """Source of the rows of step 0, see :func:`_elimination`; ``read`` is the format of an entry that is read."""
    N, lines = range(n), []
    for i in N:
        entries, moduli = [f"e{i}_{j}" for j in N], [f"m{i}_{j}" for j in N]
        lines += [f"{entry} = {read.format(f'A[{i}][{j}]')}" for j, entry in enumerate(entries)]
        lines += [f"{modulus} = abs({entry})" for modulus, entry in zip(moduli, entries, strict=True) if n > 1]
        sides = [read.format(f"b[{i}]"), *(read.format(f"X[{r}][{i}]") for r in range(rows))]
        scaling = [*moduli, f"max({', '.join(moduli)})"] if n > 1 else []
        lines.append(f"row0_{i} = {pack([*entries, *sides, *scaling])}")
    return lines


def _elimination(k: int, n: int, sides: Sequence[str], *, noted: bool) -> list[str]:
    """Source of step k: the row with the largest pivot is exchanged with row k, then the entries below the pivot are eliminated.

    A row is one tuple: its entries from column k on, its right sides, and, if there are several rows, its sums of moduli and its scale.
    Exchanges have names if derivatives are computed from them, as they are from the factors.
    """
    left, right = range(k + 1, n), n - k + len(sides)
    top, last = f"row{k}_{k}", right + n - k
    lines = []
    for i in left:
        row = f"row{k}_{i}"
        test = f"abs({row}[0]) * {top}[{last}] > abs({top}[0]) * {row}[{last}]"
        lines += [f"c{k}_{i} = {test}"] if noted else []
        lines.append(f"if {f'c{k}_{i}' if noted else test}: {top}, {row} = {row}, {top}")
    lines += [f"a{k}_{j} = {top}[{j - k}]" for j in range(k, n)] + [f"{side}{k}_ = {top}[{n - k + r}]" for r, side in enumerate(sides)]
    lines += [f"s{k}_{j} = {top}[{right + j - k}]" for j in range(k, n)] if n > 1 else []
    for i in left:
        row, f = f"row{k}_{i}", f"f{k}_{i}"
        entries = [f"{row}[{j - k}] - {f} * a{k}_{j}" for j in left]
        entries += [f"{row}[{n - k + r}] - {f} * {side}{k}_" for r, side in enumerate(sides)]
        entries += [f"{row}[{right + j - k}] + abs({f}) * s{k}_{j}" for j in left]
        lines += [f"{f} = {row}[0] / a{k}_{k}", f"row{k + 1}_{i} = {pack([*entries, f'{row}[{last}]'])}"]
    return lines
