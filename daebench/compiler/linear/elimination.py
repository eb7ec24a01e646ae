"""Gaussian elimination by operations on whole rows, for code that is not compiled; it returns how close to singular the matrix was.

Each number is computed by the same operations in the same order as in the loops over entries of ``schemes/kernels/elimination.py``, which
take seven times as long with 24 unknowns if they are not compiled.
"""

from typing import Any

import numpy as np

SINGULAR = 1e-14
"""Relative pivots up to this size are round-off: the matrix may be singular."""


def eliminate(A: Any, B: Any) -> float:
    """Solve A X = B in place by elimination with scaled partial pivoting; return the smallest relative pivot.

    Parameters
    ----------
    A : ndarray, shape(k, k)
        Matrix.
    B : ndarray, shape(k, c)
        Right sides; X on return, unless the smallest relative pivot is 0 or NaN.

    Returns
    -------
    float
        Smallest relative pivot: 0 or NaN if A is exactly singular, NaN if a pivot is not a number.
    """
    a = np.concatenate((A, B), axis=1)
    with np.errstate(all="ignore"):
        pivot = solve_rows(a)
    B[:] = a[:, len(A) :]
    return float(pivot)


def solve_rows(a: Any) -> Any:
    """Replace B by X, where A X = B, given a = (A, B); return the smallest relative pivot."""
    pivot = reduced(a, np.abs(a[:, : len(a)]))
    substitute(a)
    return pivot


def reduced(a: Any, s: Any) -> Any:
    """Make a, shape(n, n + sides), upper triangular, where s, shape(n, n), holds sums of moduli; return the smallest relative pivot."""
    n = len(a)
    scale, pivot = s.max(axis=1), np.inf
    for k in range(n):
        best = pivot_row(np.abs(a[k:, k]).tolist(), scale[k:].tolist()) + k
        if best != k:
            for rows in (a, s, scale):
                rows[[k, best]] = rows[[best, k]]
        share = abs(a[k, k]) / s[k, k] if s[k, k] > 0.0 else 0.0 * scale[k]
        if not share >= pivot:
            pivot = share
        f = a[k + 1 :, k : k + 1] / a[k, k]
        a[k + 1 :, k + 1 :] -= f * a[k, k + 1 :]
        s[k + 1 :, k + 1 :] += np.abs(f) * s[k, k + 1 :]
    return pivot


def pivot_row(moduli: list[float], scale: list[float]) -> int:
    """Return the first row whose modulus is the largest relative to its scale."""
    best = 0
    for i in range(1, len(moduli)):
        if moduli[i] * scale[best] > moduli[best] * scale[i]:
            best = i
    return best


def substitute(a: Any) -> None:
    """Replace the right sides by the solution, given a, shape(n, n + sides), upper triangular; terms are subtracted from left to right."""
    n = len(a)
    for k in range(n - 1, -1, -1):
        terms = a[k, k + 1 : n, None] * a[k + 1 :, n:]
        a[k, n:] = np.subtract.reduce(np.concatenate((a[k : k + 1, n:], terms))) / a[k, k]


def finite(health: float, values: Any) -> float:
    """Return ``health``, or NaN if any of the values, shape(k,), is not finite."""
    wrong = False
    for value in values:
        wrong |= value - value != 0.0  # true if infinite or NaN; no operation waits for the one before, as in a sum
    return float("nan") if wrong else health


def finite_matrix(health: float, matrix: Any) -> float:
    """Return ``health``, or NaN if any entry of a matrix, shape(n, k), is not finite."""
    wrong = False
    for row in matrix:
        for value in row:
            wrong |= value - value != 0.0
    return float("nan") if wrong else health
