"""Elimination, compiled by numba once for all generated modules that call it: it takes longer to compile than most of its callers."""

import inspect

from daebench.compiler.cache import generated
from daebench.compiler.codegen import function
from daebench.compiler.linear import elimination
from daebench.compiler.linear.kernels import lines

HEADER = '''"""Gaussian elimination."""

from typing import Any

from daebench.compiler.machine_code import njit
from numpy import absolute, empty, inf
'''

BOTH = (
    "n, sides = B.shape",
    "a = empty((n, n + sides))",
    "for i in range(n):",
    "    for j in range(n):",
    "        a[i, j] = A[i, j]",
    "    for j in range(sides):",
    "        a[i, n + j] = B[i, j]",
)
BACK = ("for i in range(n):", "    for j in range(sides):", "        B[i, j] = a[i, n + j]")
"""Copies of A and B into one matrix, and of X back, entry by entry: the shape checks of slices would double the compilation time."""


def source(cached: bool) -> str:
    """Return the source of a module with the functions of :mod:`daebench.compiler.linear.elimination` named below, decorated for numba."""
    *body, pivot = lines("elimination", {"UNKNOWNS": "n", "COLUMNS": "a.shape[1]", "INF": "inf"})
    written = function("eliminate(A, B)", *BOTH, *body, *BACK, pivot)
    texts = [written, inspect.getsource(elimination.finite), inspect.getsource(elimination.finite_matrix)]
    decorator = f"@njit(error_model='numpy'{', cache=True' * cached})"
    return "\n\n".join([HEADER, *(f"{decorator}\n{text}" for text in texts)])


_MODULE = generated("elimination", "elimination", source)
eliminate, finite, finite_matrix = _MODULE.eliminate, _MODULE.finite, _MODULE.finite_matrix
