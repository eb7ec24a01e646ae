"""The least-squares solution of small linear systems, possibly singular."""

from typing import Any

from numpy import arange, sqrt, zeros

from daebench.schemes.kernels.sizes import COLUMNS, DEPENDENT, UNKNOWNS


def solve(a: Any) -> Any:
    """Replace b by the x of least norm that minimises |A x - b|, given a = (A, b), shape(UNKNOWNS, UNKNOWNS + 1).

    Return the smallest diagonal entry of R that was kept, relative to the first; 0 if there is none, NaN if A is not finite.
    Rows, then columns, are first scaled to have a largest modulus of 1, so that units do not matter; the norm is that of the scaled x.
    A P = Q R is found by modified Gram-Schmidt with column pivoting and with b as a last column, and ended where the remainder of the
    columns is below DEPENDENT. Products are taken without conjugation, so that the imaginary part is a derivative.
    """
    r, x, null = zeros((UNKNOWNS, COLUMNS), a.dtype), zeros(UNKNOWNS, a.dtype), zeros((UNKNOWNS, UNKNOWNS), a.dtype)
    size, order = zeros(UNKNOWNS, a.real.dtype), arange(UNKNOWNS)
    total = scale_rows(a, size)
    scale_columns(a, size)
    rank, pivot = factorised(a, r, order, total)
    for k in range(rank - 1, -1, -1):
        x[k] = r[k, UNKNOWNS]
        for j in range(k + 1, rank):
            x[k] -= r[k, j] * x[j]
        x[k] = x[k] / r[k, k]
    least_norm(r, x, null, rank)
    for k in range(UNKNOWNS):
        a[order[k], UNKNOWNS] = x[k] / size[order[k]]
    # ``total`` is 0, or NaN of a matrix that is not finite: comparisons alone would overlook a NaN.
    return pivot + total


def scale_rows(a: Any, size: Any) -> Any:
    """Scale the rows of a; return 0, or NaN where A is not finite."""
    total = 0.0 * size[0]
    for i in range(UNKNOWNS):
        most = 0.0 * total
        for j in range(UNKNOWNS):
            most = max(most, abs(a[i, j]))
            total += 0.0 * abs(a[i, j])
        if most > 0.0:
            for j in range(COLUMNS):
                a[i, j] = a[i, j] / most
    return total


def scale_columns(a: Any, size: Any) -> None:
    """Scale the columns of A by their largest moduli, which are put in ``size``."""
    for j in range(UNKNOWNS):
        size[j] = 0.0
        for i in range(UNKNOWNS):
            size[j] = max(size[j], abs(a[i, j]))
        if not size[j] > 0.0:
            size[j] = 1.0
        for i in range(UNKNOWNS):
            a[i, j] = a[i, j] / size[j]


def factorised(a: Any, r: Any, order: Any, total: Any) -> Any:
    """Put Q of A P = Q R in a, R in r and P in ``order``; return the rank and the smallest entry of R's diagonal, relative to the first."""
    rank, first, pivot = 0, 0.0 * total, 0.0 * total
    for k in range(UNKNOWNS):
        best, most = longest(a, k, total)
        most = sqrt(most)
        if k == 0:
            first = most
        if not most > DEPENDENT * first:
            break
        rank, pivot = k + 1, most / first
        if best != k:
            order[k], order[best] = order[best], order[k]
            for i in range(UNKNOWNS):
                a[i, k], a[i, best] = a[i, best], a[i, k]
                r[i, k], r[i, best] = r[i, best], r[i, k]
        orthogonalise(a, r, k)
    return rank, pivot


def longest(a: Any, k: int, total: Any) -> Any:
    """Return the longest column of A, from k on, and the square of its length."""
    best, most = k, 0.0 * total
    for j in range(k, UNKNOWNS):
        # Computed anew at each step: a square that is updated by differences loses its digits where columns depend on each other.
        left = 0.0 * total
        for i in range(UNKNOWNS):
            left += abs(a[i, j]) * abs(a[i, j])
        if left > most:
            best, most = j, left
    return best, most


def orthogonalise(a: Any, r: Any, k: int) -> None:
    """Normalise column k of a and subtract the components along it from the columns behind."""
    # Not the modulus, which ``longest`` has: the square carries the derivative in the imaginary part.
    square = 0.0 * a[0, k]
    for i in range(UNKNOWNS):
        square += a[i, k] * a[i, k]
    r[k, k] = sqrt(square)
    for i in range(UNKNOWNS):
        a[i, k] = a[i, k] / r[k, k]
    for j in range(k + 1, COLUMNS):
        for i in range(UNKNOWNS):
            r[k, j] += a[i, k] * a[i, j]
        for i in range(UNKNOWNS):
            a[i, j] -= r[k, j] * a[i, k]


def least_norm(r: Any, x: Any, null: Any, rank: int) -> None:
    """Find an orthogonal basis of the null space of R, and subtract from x its components along it."""
    for free in range(rank, UNKNOWNS):
        null[free, free] = 1.0
        for k in range(rank - 1, -1, -1):
            null[free, k] = -r[k, free]
            for j in range(k + 1, rank):
                null[free, k] -= r[k, j] * null[free, j]
            null[free, k] = null[free, k] / r[k, k]
        next_of_basis(x, null, rank, free)
        along, square = 0.0 * x[0], 0.0 * x[0]
        for j in range(UNKNOWNS):
            along += null[free, j] * x[j]
            square += null[free, j] * null[free, j]
        for j in range(UNKNOWNS):
            x[j] -= along / square * null[free, j]


def next_of_basis(x: Any, null: Any, rank: int, free: int) -> None:
    """Make a vector of the null space orthogonal to those before it."""
    for other in range(rank, free + 1):
        along, square = 0.0 * x[0], 0.0 * x[0]
        for j in range(UNKNOWNS):
            along += null[other, j] * null[free, j]
            square += null[other, j] * null[other, j]
        if other < free:
            for j in range(UNKNOWNS):
                null[free, j] -= along / square * null[other, j]
