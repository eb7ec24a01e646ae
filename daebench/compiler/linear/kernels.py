"""Solvers of linear systems, by kernels of linear algebra from files of ``schemes/kernels``."""

import re
import types
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from typing import Any

from daebench.compiler.syntax import Lines, function, pack, text_of

DEPENDENT = {"float64": "4e-11", "float32": "2e-05", "complex128": "4e-11"}
"""Tolerance below which least squares treat constraints as dependent: eps^(2/3) of the number type. For G M^-1 G^T: a squared angle."""


def kernel(file: str, name: str, constants: Mapping[str, str]) -> str:
    """Source of the functions of a file with these constants: ``solve`` under this name, others under names that begin with it."""
    module = import_module(f"daebench.schemes.kernels.{file}")
    functions = {key: x for key, x in vars(module).items() if isinstance(x, types.FunctionType) and x.__module__ == module.__name__}
    names = {**{key: f"{name}_{key}" for key in functions}, "solve": name, **constants}
    text = "\n\n".join(map(text_of, functions.values()))
    return re.sub(r"\w+", lambda word: names.get(word[0], word[0]), text) + "\n\n"


def solver(
    file: str,
    signature: str,
    n: int,
    columns: int,
    dtype: str,
    fill: Sequence[str],
    results: Sequence[str],
    *,
    after: Sequence[str] = (),
    make: str = "empty",
) -> str:
    """Source of a function that fills an array for a file's kernel; it returns ``results`` and the smallest relative pivot."""
    name = f"{signature.partition('(')[0]}_{file}"
    constants = {"UNKNOWNS": str(n), "COLUMNS": str(columns), "DEPENDENT": DEPENDENT[dtype]}
    body = [f"a = numpy.{make}(({n}, {columns}), dtype=numpy.{dtype})", *fill, f"pivot = {name}(a)", *after]
    return kernel(file, name, constants) + function(signature, *body, f"return {', '.join([*results, 'pivot'])}")


def filled(n: int, rows: int | None, entry: Callable[[Any, str], str]) -> Lines:
    """Lines that put A, b and this many rows of X into columns of an array; ``entry`` writes one, given its column and its source.

    The loops are unrolled where A is a tuple.
    """
    matrix = [f"for i in range({n}):", f"    for j in range({n}):", f"        {entry('j', 'A[i][j]')}", f"    {entry(n, 'b[i]')}"]
    return matrix + [f"    for r in range({rows}):", f"        {entry(f'({n + 1} + r)', 'X[r][i]')}"] * bool(rows)


def array_solver(file: str, name: str, n: int, dtype: str, rows: int | None = None, massless: Sequence[int] | None = None) -> str:
    """Source of ``name(A, b)``, or ``name(A, b, X)`` with this many rows of X. Solutions are tuples, or arrays where ``massless`` is given.

    Entries of ``massless`` are 0, as if their rows were infinite.
    """
    fill = filled(n, rows, lambda column, x: f"a[i, {column}] = {x}")
    for k in massless or ():
        fill += [f"a[{k}, :] = 0.0", f"a[:{n}, {k}] = 0.0", f"a[{k}, {k}] = 1.0"]
    if massless is None:
        solution, *others = (pack(f"a[{i}, {n + r}]" for i in range(n)) for r in range(1 + (rows or 0)))
    else:
        solution, others = f"a[:, {n}].copy()", []
    results = [solution, *[pack(others) if massless is None else f"a[:, {n + 1}:].T.copy()"] * (rows is not None)]
    return solver(file, f"{name}(A, b{', X' * (rows is not None)})", n, n + 1 + (rows or 0), dtype, fill, results)


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


def _moved(n: int, k: int, rows: int | None, lines_of: Sequence[str]) -> Lines:
    """Source of an array ``w`` with derivatives of A, derivatives of the right sides, and zeros; followed by lines that use it."""
    sides, right = 1 + (rows or 0), n * k
    return [
        f"w = numpy.zeros(({n}, {right + 2 * k * sides}))",
        *filled(n, rows, lambda column, x: f"put(w, i, {k} * {column}, {x})"),
        *(line.format(n=n, k=k, sides=sides, right=right, width=k * sides) for line in lines_of),
    ]


def eliminating_dual(name: str, n: int, k: int, rows: int | None = None) -> str:
    """Source of ``name(A, b)``, or ``name(A, b, X)`` with this many rows of X, by elimination in loops, for k directions."""
    sides = 1 + (rows or 0)
    column, unit = (n + sides) * k, [f"a[{i}, {n + sides + i}] = 1.0" for i in range(n)]
    fill = filled(n, rows, lambda column, x: f"a[i, {column}] = value({x})") + unit
    first, *others = (pack(f"take(w, {i}, {column + k * s}, a[{i}, {n + s}], {k})" for i in range(n)) for s in range(sides))
    results, after = [first, *[pack(others)] * (rows is not None)], _moved(n, k, rows, [*REMAINDERS, *PRODUCTS])
    signature = f"{name}(A, b{', X' * (rows is not None)})"
    return solver("elimination", signature, n, 2 * n + sides, "float64", fill, results, after=after, make="zeros")


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
        *_moved(n, k, None, REMAINDERS),
        f"for c in range({n * k}, {n * k + k}):",
        f"    y_, _ = _{name}_values(A_, {pack(f'w[{i}, c]' for i in range(n))})",
        *(f"    w[{i}, c] = y_[{i}]" for i in range(n)),
        f"return {pack(f'take(w, {i}, {n * k}, x_[{i}], {k})' for i in range(n))}, smallest",
    )
