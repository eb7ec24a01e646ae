"""Solvers of any size, compiled by numba once for all code that calls them: they take longer to compile than most of their callers.

Code that is not compiled calls them too, for more unknowns than are written out: loops over entries would take most of its time.
"""

import inspect

from daebench.compiler.cache import generated
from daebench.compiler.codegen import function
from daebench.compiler.linear import health
from daebench.compiler.linear.kernels import lines

HEADER = '''"""Gaussian elimination and least squares."""

from typing import Any

from daebench.compiler.machine_code import njit
from numpy import arange, empty, inf, sqrt, zeros
'''


def _in_place(signature: str, kernel: str) -> str:
    """Return the source of a function of A, shape(n, n), and B, shape(n, k), which replaces B by the solution of a kernel.

    Least squares are for one right side, k = 1.
    Entries are copied one by one: the checks of the shapes of slices would double the compilation time.
    """
    *body, pivot = lines(kernel, {"UNKNOWNS": "n", "COLUMNS": "(n + sides)", "INF": "inf", "DEPENDENT": "dependent"})
    head = ["n, sides = B.shape", "a = empty((n, n + sides), B.dtype)", "for i in range(n):", "    for j in range(n):"]
    head += ["        a[i, j] = A[i, j]", "    for j in range(sides):", "        a[i, n + j] = B[i, j]"]
    back = ["for i in range(n):", "    for j in range(sides):", "        B[i, j] = a[i, n + j]"]
    return function(signature, *head, *body, *back, pivot)


def source(cached: bool) -> str:
    """Return the source of a module with solvers and the functions of :mod:`daebench.compiler.linear.health`, decorated for numba."""
    texts = [_in_place("eliminate(A, B)", "elimination"), _in_place("least_squares(A, B, dependent)", "least_squares")]
    texts += [inspect.getsource(health.finite), inspect.getsource(health.finite_matrix)]
    decorator = f"@njit(error_model='numpy'{', cache=True' * cached})"
    return "\n\n".join([HEADER, *(f"{decorator}\n{text}" for text in texts)])


_MODULE = generated("solvers", "solvers", source)
eliminate, least_squares, finite, finite_matrix = _MODULE.eliminate, _MODULE.least_squares, _MODULE.finite, _MODULE.finite_matrix
