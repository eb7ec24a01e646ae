"""Solvers of any size, as machine code: for code that Python executes too, for more unknowns than are written out."""

import types
from functools import cache
from typing import Any

from daebench.compiler.cache import generated
from daebench.compiler.written import written

TITLE = "Gaussian elimination and least squares."


def _in_place(signature: str, kernel: str) -> str:
    """Return the source of a function of A, shape(n, n), and B, shape(n, k), which replaces B by the solution of a kernel.

    Least squares are for one right side, k = 1.
    Entries are copied one by one: the checks of the shapes of slices would double the compilation time.
    """
    from daebench.compiler.codegen import function  # SymPy, which a later process does without
    from daebench.compiler.linear.kernels import lines

    *body, pivot = lines(kernel, {"UNKNOWNS": "n", "COLUMNS": "(n + sides)", "INF": "inf", "DEPENDENT": "dependent"})
    head = ["n, sides = B.shape", "a = empty((n, n + sides), B.dtype)", "for i in range(n):", "    for j in range(n):"]
    head += ["        a[i, j] = A[i, j]", "    for j in range(sides):", "        a[i, n + j] = B[i, j]"]
    back = ["for i in range(n):", "    for j in range(sides):", "        B[i, j] = a[i, n + j]"]
    return function(signature, *head, *body, *back, pivot)


def eliminating() -> str:
    """Return the source of ``eliminate``."""
    return _in_place("eliminate(A, B)", "elimination")


@cache
def _solvers() -> types.ModuleType:
    """Return the module of solvers, for arrays of real or complex numbers."""

    def build() -> str:
        texts = {"eliminate": eliminating(), "least_squares": _in_place("least_squares(A, B, dependent)", "least_squares")}
        return written(TITLE, tuple(texts), list(texts.values()))

    return generated("solvers", "solvers", build)


def eliminate(A: Any, B: Any) -> float:
    """Replace B, shape(n, k), by X with A X = B, for A, shape(n, n); return the smallest relative pivot."""
    return float(_solvers().eliminate(A, B))


def least_squares(A: Any, B: Any, dependent: float) -> float:
    """Replace B, shape(n, 1), by the least solution of A X = B in the sense of least squares; return the smallest relative pivot."""
    return float(_solvers().least_squares(A, B, dependent))
