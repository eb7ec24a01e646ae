"""Gaussian elimination of any size, as machine code, for code that Python executes too."""

import types
from functools import cache
from typing import Any

from daebench.compiler.cache import generated, written
from daebench.compiler.linear.kernels import kernel
from daebench.compiler.syntax import function


def eliminating() -> str:
    """Return the source of ``eliminate(A, B)``, a function of A, shape(n, n), and B, shape(n, k), which replaces B by the solution.

    Entries are copied one by one: the checks of the shapes of slices would double the compilation time.
    """
    copy = ["n, sides = B.shape", "a = empty((n, n + sides), B.dtype)", "for i in range(n):", "    for j in range(n):"]
    copy += ["        a[i, j] = A[i, j]", "    for j in range(sides):", "        a[i, n + j] = B[i, j]", "pivot = elimination(a)"]
    back = ["for i in range(n):", "    for j in range(sides):", "        B[i, j] = a[i, n + j]", "return pivot"]
    sizes = {"UNKNOWNS": "a.shape[0]", "COLUMNS": "a.shape[1]", "INF": "inf"}
    return kernel("elimination", "elimination", sizes) + function("eliminate(A, B)", *copy, *back)


@cache
def _solver() -> types.ModuleType:
    """Return the module of ``eliminate``, for arrays of real or complex numbers."""
    return generated("solvers", "solvers", lambda: written("Gaussian elimination.", ("eliminate",), [eliminating()]))


def eliminate(A: Any, B: Any) -> float:
    """Replace B, shape(n, k), by X with A X = B, for A, shape(n, n); return the smallest relative pivot."""
    return float(_solver().eliminate(A, B))
