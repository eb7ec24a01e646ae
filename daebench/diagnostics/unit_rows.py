"""The rows of G in the metric M^-1, of length one, and which of them depend on others: neither masses nor units matter."""

import numpy as np

from daebench.diagnostics.inverse_mass import root_of
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.systems.lazily import scipy

DEPENDENT = 1e-9
"""Sine of the angle between a row of G and the span of others, in the metric M^-1, below which the row is dependent."""

LARGEST = 200
"""Largest number of constraints that are compared with each other, which takes m^2 d operations."""


def root(ivp: ConstrainedIvp, q: Array) -> Array:
    """Return a root of M^-1 at q, one column for each position; the time, which has no mass, has a row of zeros."""
    n = ivp.moving
    padded = np.zeros((ivp.d, n))
    padded[:n] = root_of(ivp, ivp.p0, q)
    return padded


def unit_rows(ivp: ConstrainedIvp, q: Array) -> Array:
    """Return the rows of G at q in the metric M^-1, shape(m, d), each of length one but for those that are zero; without the time."""
    return of_length_one(np.array(ivp.value("G", q) @ root(ivp, q), dtype=float))


def of_length_one(rows: Array) -> Array:
    """Return rows of length one; those that are zero stay so."""
    length = np.linalg.norm(rows, axis=1)
    return np.asarray(rows / np.where(length > 0, length, 1.0)[:, None])


def across(rows: Array) -> Array:
    """Return orthonormal rows that are orthogonal to these, which may depend on each other, shape(d - rank, d)."""
    _, singular, basis = np.linalg.svd(rows)
    return np.asarray(basis[int(np.sum(singular > DEPENDENT * np.max(singular, initial=0.0))) :])


def condition(ivp: ConstrainedIvp, q: Array) -> float:
    """Return the condition number of G M^-1 G^T at q, scaled to have ones on its diagonal, without what redundant constraints add to it.

    Rounding of multipliers grows by it at most.
    """
    # From the rows, whose singular values are the roots of those of G M^-1 G^T: the product itself would lose half of the digits.
    rows = unit_rows(ivp, q)
    sizes = np.linalg.svd(rows, compute_uv=False)
    return float(sizes[0] / sizes[rank_of(rows) - 1]) ** 2


def dependent_rows(rows: Array) -> dict[int, list[int]]:
    """Return the rows that depend on those before them, each with the independent ones that it is a combination of."""
    # In the order of the file, not by size: a message then names the later constraint as the dependent one.
    basis: list[int] = []
    others: dict[int, list[int]] = {}
    for k, row in enumerate(rows):
        shares = np.linalg.lstsq(rows[basis].T, row, rcond=None)[0] if basis else np.empty(0)
        if np.linalg.norm(row - shares @ rows[basis]) > DEPENDENT:
            basis.append(k)
        else:
            others[k] = [j for j, share in zip(basis, shares, strict=True) if abs(share) > DEPENDENT]
    return others


def rank_of(rows: Array) -> int:
    """Return the number of independent rows, by column-pivoted QR of the transposed matrix."""
    size = np.abs(np.diagonal(scipy.linalg.qr(rows.T, mode="r", pivoting=True)[0]))
    return int(np.sum(size > DEPENDENT * size[0]))


def beyond_comparison(ivp: ConstrainedIvp) -> bool:
    """Return whether an initial value problem has too many constraints for full matrices."""
    return ivp.arrays or ivp.m > LARGEST
