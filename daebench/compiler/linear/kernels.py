"""Kernels of linear algebra from files of ``schemes/kernels``, as one function each, with the procedures that they call inlined.

Loops over a small array run twice as fast if the array is not passed to another function.
"""

import ast
from collections.abc import Mapping, Sequence

from daebench.compiler.syntax import function, pack
from daebench.systems.files.package import text_of

DEPENDENT = {"float64": "4e-11", "float32": "2e-05", "complex128": "4e-11"}
"""Tolerance below which least squares treat constraints as dependent: eps^(2/3) of the number type. For G M^-1 G^T: a squared angle."""


class _Settled(ast.NodeTransformer):
    """Replaces constants by their sources, and calls of other functions of the file by their bodies, which use the same names."""

    def __init__(self, functions: Mapping[str, ast.FunctionDef], constants: Mapping[str, str]) -> None:
        self.functions, self.constants = functions, constants

    def visit_Name(self, node: ast.Name) -> ast.expr:
        return ast.parse(self.constants[node.id], mode="eval").body if node.id in self.constants else node

    def visit_Expr(self, node: ast.Expr) -> list[ast.stmt]:
        return self._inlined(node.value) or []

    def visit_Assign(self, node: ast.Assign) -> ast.AST | list[ast.stmt]:
        return self._inlined(node.value) or self.generic_visit(node)

    def _inlined(self, node: ast.expr) -> list[ast.stmt]:
        """Return the statements of a called function of this file, without its return; none for another expression."""
        known = isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and self.functions.get(node.func.id)
        body = self.visit(known).body if known else []
        return body[:-1] if body and isinstance(body[-1], ast.Return) else body


def lines(file: str, constants: Mapping[str, str], name: str = "solve") -> list[str]:
    """Return the lines of a function of a file, with these sources of constants; the last line of ``solve`` returns the pivot."""
    functions = {
        node.name: node for node in ast.parse(text_of(f"daebench.schemes.kernels.{file}")).body if isinstance(node, ast.FunctionDef)
    }
    settled = _Settled(functions, constants).visit(functions[name])
    return "\n".join(map(ast.unparse, settled.body)).splitlines()


def array_solver(file: str, name: str, n: int, dtype: str, rows: int | None = None) -> str:
    """Source of ``name(A, b)``, or ``name(A, b, X)`` with this many rows of X, which fills an array for a file's kernel."""
    sides = _sides(rows)
    signature = f"{name}(A, b{', X' * (rows is not None)})"
    constants = {"UNKNOWNS": str(n), "COLUMNS": str(n + len(sides)), "DEPENDENT": DEPENDENT[dtype]}
    *body, pivot = lines(file, constants)
    solution, *others = (pack(f"a[{i}, {n + r}]" for i in range(n)) for r in range(len(sides)))
    result: Sequence[str] = [solution, *([pack(others)] if rows is not None else []), pivot.removeprefix("return ")]
    return function(
        signature,
        f"a = numpy.empty(({n}, {n + len(sides)}), dtype=numpy.{dtype})",
        *(f"a[{i}, {j}] = A[{i}][{j}]" for i in range(n) for j in range(n)),
        *(f"a[{i}, {n + r}] = {side}[{i}]" for r, side in enumerate(sides) for i in range(n)),
        *body,
        f"return {', '.join(result)}",
    )


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


def _sides(rows: int | None) -> list[str]:
    """Names of the right sides."""
    return ["b", *(f"X[{r}]" for r in range(rows or 0))]


def _moved(n: int, k: int, sides: Sequence[str], lines_of: Sequence[str]) -> list[str]:
    """Source of an array ``w`` with derivatives of A, derivatives of the right sides, and zeros; followed by lines that use it."""
    right, width = n * k, k * len(sides)
    return [
        f"w = numpy.zeros(({n}, {right + 2 * width}))",
        *(f"put(w, {i}, {k * j}, A[{i}][{j}])" for i in range(n) for j in range(n)),
        *(f"put(w, {i}, {right + k * s}, {side}[{i}])" for s, side in enumerate(sides) for i in range(n)),
        *(line.format(n=n, k=k, sides=len(sides), right=right, width=width) for line in lines_of),
    ]


def eliminating_dual(name: str, n: int, k: int, rows: int | None = None) -> str:
    """Source of ``name(A, b)``, or ``name(A, b, X)`` with this many rows of X, by elimination in loops, for k directions."""
    sides = _sides(rows)
    *body, pivot = lines("elimination", {"UNKNOWNS": str(n), "COLUMNS": str(2 * n + len(sides))})
    column = n * k + k * len(sides)
    first, *others = (pack(f"take(w, {i}, {column + k * s}, a[{i}, {n + s}], {k})" for i in range(n)) for s in range(len(sides)))
    return function(
        f"{name}(A, b{', X' * (rows is not None)})",
        f"a = numpy.zeros(({n}, {2 * n + len(sides)}))",
        *(f"a[{i}, {j}] = value(A[{i}][{j}])" for i in range(n) for j in range(n)),
        *(f"a[{i}, {n + s}] = value({side}[{i}])" for s, side in enumerate(sides) for i in range(n)),
        *(f"a[{i}, {n + len(sides) + i}] = 1.0" for i in range(n)),
        *body,
        *_moved(n, k, sides, [*REMAINDERS, *PRODUCTS]),
        f"return {', '.join([first, *([pack(others)] if rows is not None else []), pivot.removeprefix('return ')])}",
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
