"""Elimination as ``elimination_source.looping_solver`` writes it, by operations on whole rows: for modules that are not compiled."""

from typing import Any

import numpy as np


def solved(A: Any, b: Any, dtype: str, X: Any = ()) -> tuple[Any, ...]:
    """Return x with A x = b, the solutions for the rows of X where there are any, and the smallest relative pivot.

    It is Gaussian elimination with scaled partial pivoting, and pivots are taken relative to the sum of moduli of the terms that they
    were computed from. Each number is computed by the same operations in the same order as in the loops over entries, which take
    seven times as long with 24 unknowns where they are not compiled.

    Parameters
    ----------
    A : sequence of sequence of number, shape(n, n)
        Matrix.
    b : sequence of number, shape(n,)
        Right side.
    dtype : str
        Name of the number type.
    X : sequence of sequence of number, shape(r, n)
        More right sides.
    """
    n = len(b)
    a = np.empty((n, n + 1 + len(X)), dtype=dtype)
    a[:, :n], a[:, n] = A, b
    if X:
        a[:, n + 1 :] = np.transpose(X)
    pivot = reduced(a, np.abs(a[:, :n]))
    substitute(a)
    others = (tuple(map(tuple, a[:, n + 1 :].T)),) if X else ()
    return tuple(a[:, n]), *others, pivot


def reduced(a: Any, s: Any) -> Any:
    """Make a of shape(n, n + sides) upper triangular, s of shape(n, n) the sums of moduli; return the smallest relative pivot."""
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
    """Solve with the upper triangle of a, shape(n, n + sides), in the place of the sides; terms are subtracted from left to right."""
    n = len(a)
    for k in range(n - 1, -1, -1):
        terms = a[k, k + 1 : n, None] * a[k + 1 :, n:]
        a[k, n:] = np.subtract.reduce(np.concatenate((a[k : k + 1, n:], terms))) / a[k, k]
