"""Small systems of linear equations for many states at once: the last axis of every array is that of the states.

NumPy's own routines take a stack of matrices one by one, which for two or three equations is ten times as slow.
"""

import numpy as np
from numpy.typing import NDArray

from daebench.runs.ivp import Array

Rows = NDArray[np.intp]
"""Numbers of members, or of chains."""


def times(A: Array, x: Array) -> Array:
    """Return A x, shape(c, n), of A, shape(c, l, n)."""
    return np.asarray(np.sum(A * x, axis=1), dtype=float)


def transposed_times(A: Array, y: Array) -> Array:
    """Return A^T y, shape(l, n), of A, shape(c, l, n)."""
    return np.asarray(np.sum(A * y[:, None], axis=0), dtype=float)


def product(A: Array, B: Array) -> Array:
    """Return A B of matrices in the first two axes."""
    return np.stack([np.sum(row[:, None] * B, axis=0) for row in A])


def gram(A: Array, B: Array) -> Array:
    """Return A B^T, shape(c, c, n), of matrices of shape(c, l, n)."""
    return np.stack([np.sum(row * B, axis=1) for row in A])


def solved(A: Array, b: Array) -> Array:
    """Return A^-1 b, shape(c, n), by elimination without pivoting.

    That is stable for A = C C^T. Of products C(y) C(x)^T, which are nearly of this kind, it may fail: what comes out is then not finite, or
    no solution, and Newton's iteration goes on from there or does not converge.
    """
    A, x = A.copy(), b.copy()
    c = len(A)
    for k in range(c - 1):
        factors = A[k + 1 :, k] / A[k, k]
        A[k + 1 :, k + 1 :] -= factors[:, None] * A[k, k + 1 :]
        x[k + 1 :] -= factors * x[k]
    for k in reversed(range(c)):
        x[k] = (x[k] - np.sum(A[k, k + 1 :] * x[k + 1 :], axis=0)) / A[k, k]
    return x


def log_det(A: Array) -> Array:
    """Return log det A of symmetric A, shape(c, c, n); NaN or -inf where it is not positive definite."""
    A, total = A.copy(), np.zeros(A.shape[2])
    for k in range(len(A)):
        total += np.log(A[k, k])
        A[k + 1 :, k + 1 :] -= (A[k + 1 :, k] / A[k, k])[:, None] * A[k, k + 1 :]
    return total
