"""Gaussian elimination that says how close to singular the matrix was; read as text into generated modules, and run as it stands."""

from typing import Any

import numpy as np

SINGULAR = 1e-14
"""Relative pivots up to this size are round-off: the matrix is singular for all that can be told."""


def eliminate(A: Any, B: Any) -> float:
    """Solve A X = B in place by elimination with scaled partial pivoting; return the smallest relative pivot.

    A pivot is taken relative to the sum of moduli of the terms that it was computed from, so that scaling rows or columns of A
    (masses between 1e-8 and 1e8, say) does not change it: it is the share that cancellation has left.

    Parameters
    ----------
    A : ndarray, shape(k, k)
        Matrix; destroyed.
    B : ndarray, shape(k, c)
        Right sides; X on return, unless the smallest relative pivot is 0.

    Returns
    -------
    float
        0 where A is exactly singular, NaN where a pivot is not a number.
    """
    k = A.shape[0]
    size, scale = moduli(A)
    smallest = 1.0
    for column in range(k):
        best = pivot_row(A, scale, column)
        swap(A, column, best)
        swap(size, column, best)
        swap(B, column, best)
        scale[column], scale[best] = scale[best], scale[column]
        if A[column, column] == 0.0:
            return 0.0
        share = abs(A[column, column]) / size[column, column]
        if not share >= smallest:
            smallest = share
        reduce(A, size, B, column)
    substitute(A, B)
    return smallest


def moduli(A: Any) -> Any:
    """Return the moduli of A, shape(k, k), and the largest of each row, shape(k,); loops compile much faster than array expressions."""
    k = A.shape[0]
    size, scale = np.empty((k, k)), np.empty(k)
    for i in range(k):
        scale[i] = 0.0
        for j in range(k):
            size[i, j] = abs(A[i, j])
            if size[i, j] > scale[i]:
                scale[i] = size[i, j]
    return size, scale


def pivot_row(A: Any, scale: Any, column: int) -> int:
    """Return the row, from ``column`` on, whose entry in this column is largest relative to the scale of its row."""
    best = column
    for row in range(column + 1, A.shape[0]):
        if abs(A[row, column]) * scale[best] > abs(A[best, column]) * scale[row]:
            best = row
    return best


def swap(X: Any, i: int, k: int) -> None:
    """Exchange rows i and k."""
    for j in range(X.shape[1]):
        X[i, j], X[k, j] = X[k, j], X[i, j]


def reduce(A: Any, size: Any, B: Any, column: int) -> None:
    """Subtract multiples of the pivot row from those below it, and add the moduli of what was subtracted to ``size``."""
    for row in range(column + 1, A.shape[0]):
        factor = A[row, column] / A[column, column]
        for j in range(column + 1, A.shape[0]):
            A[row, j] -= factor * A[column, j]
            size[row, j] += abs(factor) * size[column, j]
        for j in range(B.shape[1]):
            B[row, j] -= factor * B[column, j]


def substitute(A: Any, B: Any) -> None:
    """Solve with the upper triangle of A in place."""
    k = A.shape[0]
    for row in range(k - 1, -1, -1):
        for j in range(B.shape[1]):
            for column in range(row + 1, k):
                B[row, j] -= A[row, column] * B[column, j]
            B[row, j] /= A[row, row]


def finite(health: float, values: Any) -> float:
    """Return ``health``, or NaN if any of the values, shape(k,), is not finite."""
    for value in values:
        health += 0.0 * value
    return health


FUNCTIONS = (eliminate, moduli, pivot_row, swap, reduce, substitute, finite)
"""What a generated module needs of this file."""
