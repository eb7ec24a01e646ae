"""Kernels of linear algebra from files of ``schemes/kernels``, as one function each, with the procedures that they call inlined.

Loops over a small array run twice as fast if the array is not passed to another function.
"""

import ast
from collections.abc import Mapping, Sequence

from daebench.compiler.python_text import function, pack
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


def array_solver(file: str, name: str, n: int, dtype: str, rows: int = 0) -> str:
    """Source of ``name(A, b)``, or ``name(A, b, X)`` with this many rows of X, which fills an array for a file's kernel."""
    sides = ["b", *(f"X[{r}]" for r in range(rows))]
    signature = f"{name}(A, b{', X' * bool(rows)})"
    constants = {"UNKNOWNS": str(n), "COLUMNS": str(n + len(sides)), "DEPENDENT": DEPENDENT[dtype]}
    *body, pivot = lines(file, constants)
    solution, *others = (pack(f"a[{i}, {n + r}]" for i in range(n)) for r in range(len(sides)))
    result: Sequence[str] = [solution, *([pack(others)] if rows else []), pivot.removeprefix("return ")]
    return function(
        signature,
        f"a = numpy.empty(({n}, {n + len(sides)}), dtype=numpy.{dtype})",
        *(f"a[{i}, {j}] = A[{i}][{j}]" for i in range(n) for j in range(n)),
        *(f"a[{i}, {n + r}] = {side}[{i}]" for r, side in enumerate(sides) for i in range(n)),
        *body,
        f"return {', '.join(result)}",
    )
