"""Gaussian elimination by loops over the entries of an array, for many unknowns."""

from typing import Any

from numpy import empty

from daebench.schemes.kernels.language import INF
from daebench.schemes.kernels.sizes import COLUMNS, UNKNOWNS


def solve(a: Any) -> Any:
    """Replace B by the solution X of A X = B, given a = (A, B), shape(UNKNOWNS, COLUMNS); return the smallest relative pivot.

    It is elimination with scaled partial pivoting. A pivot is taken relative to the sum of moduli of the terms that it was computed
    from: it is the fraction that remains after cancellation. A scaling of rows or columns of A, for example by masses between 1e-8 and 1e8,
    does not change it. It is 0 or NaN where A is exactly singular.
    """
    s = empty((UNKNOWNS, UNKNOWNS), a.real.dtype)
    scale = empty(UNKNOWNS, a.real.dtype)
    measure(a, s, scale)
    pivot = INF
    for k in range(UNKNOWNS):
        exchange(a, s, scale, k)
        # 0 times the scale: a zero of the run's number type, and NaN if the row has an entry that is not finite.
        share = abs(a[k, k]) / s[k, k] if s[k, k] > 0.0 else 0.0 * scale[k]
        if not share >= pivot:  # so that NaN is taken too
            pivot = share
        reduce(a, s, k)
    substitute(a)
    return pivot


def measure(a: Any, s: Any, scale: Any) -> None:
    """Put the moduli of A in s, and the largest of each row in ``scale``."""
    for i in range(UNKNOWNS):
        scale[i] = abs(a[i, 0])
        for j in range(UNKNOWNS):
            s[i, j] = abs(a[i, j])
            scale[i] = max(scale[i], s[i, j])


def exchange(a: Any, s: Any, scale: Any, k: int) -> None:
    """Exchange row k for that, from k on, whose entry in column k is largest relative to the scale of its row."""
    best = k
    for i in range(k + 1, UNKNOWNS):
        # Multiplied out, because the scale of a row of zeros is 0, and 0/0 loses every comparison.
        if abs(a[i, k]) * scale[best] > abs(a[best, k]) * scale[i]:
            best = i
    if best != k:
        for j in range(k, COLUMNS):
            a[k, j], a[best, j] = a[best, j], a[k, j]
        for j in range(k, UNKNOWNS):
            s[k, j], s[best, j] = s[best, j], s[k, j]
        scale[k], scale[best] = scale[best], scale[k]


def reduce(a: Any, s: Any, k: int) -> None:
    """Subtract multiples of row k from those below it, and add the moduli of what was subtracted to s."""
    for i in range(k + 1, UNKNOWNS):
        f = a[i, k] / a[k, k]
        for j in range(k + 1, COLUMNS):
            a[i, j] -= f * a[k, j]
        for j in range(k + 1, UNKNOWNS):
            s[i, j] += abs(f) * s[k, j]


def substitute(a: Any) -> None:
    """Solve with the upper triangle of A for each right side."""
    for r in range(UNKNOWNS, COLUMNS):
        for k in range(UNKNOWNS - 1, -1, -1):
            for j in range(k + 1, UNKNOWNS):
                a[k, r] -= a[k, j] * a[j, r]
            a[k, r] = a[k, r] / a[k, k]
