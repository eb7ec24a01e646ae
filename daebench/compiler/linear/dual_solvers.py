"""Source of linear solvers for dual numbers: values are computed as for float64, and the derivatives follow with the same matrix.

::

A x = b,      A dx = db - dA x
"""

from collections.abc import Sequence

from daebench.compiler.linear.kernels import array_solver, lines
from daebench.compiler.python_text import function, pack

REMAINDERS = [
    "for side in range({sides}):",
    "    for i in range({n}):",
    "        for j in range({n}):",
    "            for c in range({k}):",
    "                w[i, {right} + {k} * side + c] -= w[i, {k} * j + c] * a[j, {n} + side]",
]
"""db - dA x of each right side, given dA and db in ``w``, from its columns 0 and ``right`` on, and x in ``a``."""

PRODUCTS = [
    "for i in range({n}):",
    "    for j in range({n}):",
    "        for c in range({width}):",
    "            w[i, {right} + {width} + c] += a[i, {n} + {sides} + j] * w[j, {right} + c]",
]
"""dx, stored after the remainders, from the inverse of A in ``a``."""


def _sides(rows: int) -> list[str]:
    """Names of the right sides."""
    return ["b", *(f"X[{r}]" for r in range(rows))]


def _moved(n: int, k: int, sides: Sequence[str], lines_of: Sequence[str]) -> list[str]:
    """Source of an array ``w`` with derivatives of A, derivatives of the right sides, and zeros; followed by lines that use it."""
    right, width = n * k, k * len(sides)
    return [
        f"w = numpy.zeros(({n}, {right + 2 * width}))",
        *(f"put(w, {i}, {k * j}, A[{i}][{j}])" for i in range(n) for j in range(n)),
        *(f"put(w, {i}, {right + k * s}, {side}[{i}])" for s, side in enumerate(sides) for i in range(n)),
        *(line.format(n=n, k=k, sides=len(sides), right=right, width=width) for line in lines_of),
    ]


def eliminating_dual(name: str, n: int, k: int, rows: int = 0) -> str:
    """Source of ``name(A, b)``, or ``name(A, b, X)`` with this many rows of X, by elimination in loops, for k directions."""
    sides = _sides(rows)
    *body, pivot = lines("elimination", {"UNKNOWNS": str(n), "COLUMNS": str(2 * n + len(sides))})
    column = n * k + k * len(sides)
    first, *others = (pack(f"take(w, {i}, {column + k * s}, a[{i}, {n + s}], {k})" for i in range(n)) for s in range(len(sides)))
    return function(
        f"{name}(A, b{', X' * bool(rows)})",
        f"a = numpy.zeros(({n}, {2 * n + len(sides)}))",
        *(f"a[{i}, {j}] = value(A[{i}][{j}])" for i in range(n) for j in range(n)),
        *(f"a[{i}, {n + s}] = value({side}[{i}])" for s, side in enumerate(sides) for i in range(n)),
        *(f"a[{i}, {n + len(sides) + i}] = 1.0" for i in range(n)),
        *body,
        *_moved(n, k, sides, [*REMAINDERS, *PRODUCTS]),
        f"return {', '.join([first, *([pack(others)] if rows else []), pivot.removeprefix('return ')])}",
    )


def least_squares_dual(name: str, n: int, k: int) -> str:
    """Source of ``name(A, b)`` by least squares, for k directions.

    The contribution of the null space of A to the derivatives of x is left out. It belongs to dependent constraints, and no force depends
    on it.
    """
    return array_solver("least_squares", f"_{name}_values", n, "float64") + function(
        f"{name}(A, b)",
        "A_ = values(A)",
        f"x_, smallest = _{name}_values(A_, values(b))",
        f"a = numpy.empty(({n}, {n + 1}))",
        *(f"a[{i}, {n}] = x_[{i}]" for i in range(n)),
        *_moved(n, k, ["b"], REMAINDERS),
        f"for c in range({n * k}, {n * k + k}):",
        f"    y_, _ = _{name}_values(A_, {pack(f'w[{i}, c]' for i in range(n))})",
        *(f"    w[{i}, c] = y_[{i}]" for i in range(n)),
        f"return {pack(f'take(w, {i}, {n * k}, x_[{i}], {k})' for i in range(n))}, smallest",
    )
