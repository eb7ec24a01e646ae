"""Means of an error over windows, in which the oscillation averages out and the secular part remains."""

import numpy as np
from numpy.typing import NDArray

from daebench.runs.trajectory import Array
from daebench.systems.lazily import scipy

MOST = 31
"""Windows at most."""

PERIODS = 2.0
"""Periods of the oscillation in a window: a tapered mean leaves at most 3 parts in 100 of it."""


def window_count(oscillations: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the number of windows, each overlapping the next by half, that hold two periods of each oscillation."""
    return np.minimum(MOST, (2 * oscillations / PERIODS).astype(np.int64) - 1)


def window_means(u: Array, values: Array, windows: int) -> Array:
    """Return tapered means over windows of equal length, each overlapping the next by half.

    ::

        mean_k = sum w_k(u_i) e_i / sum w_k(u_i)        w_k(u) = sin^2( pi (u - a_k) / L ),   a_k <= u <= a_k + L

    with L = 2 / (windows + 1) and a_k = k L/2. The taper lets frequencies f beyond 2/L through by f^-3 only, where the plain mean lets
    them through by 1/f, at which an oscillation that is a thousand times the drift hides it.

    Parameters
    ----------
    u : ndarray, shape(n,)
        Times, scaled to 0 ... 1.
    values : ndarray, shape(..., n)
        Errors, a row each.
    windows : int
        How many.

    Returns
    -------
    ndarray, shape(..., windows)
    """
    length = 2.0 / (windows + 1)
    bounds = np.searchsorted(u, 0.5 * length * np.arange(windows + 2))
    bounds[-1] = len(u)
    means = np.empty((*values.shape[:-1], windows))
    for first, taper in ((0, np.sin), (1, np.cos)):  # every other window begins where the last but one ends
        starts, end = bounds[first:windows:2], bounds[first + 2 : windows + 2 : 2][-1]
        # A window with samples at its ends only has weights of zero: the small number keeps 0/0 away.
        weights = taper(np.pi / length * u[:end]) ** 2 + 1e-12
        means[..., first::2] = np.add.reduceat(values[..., :end] * weights, starts, axis=-1) / np.add.reduceat(weights, starts)
    return means


def leakage(periods: Array) -> Array:
    """Return 1 / (pi x (x^2 - 1)), the part of an oscillation that the mean over a window of x of its periods leaves, at most."""
    resolved = np.maximum(periods, 1.0)
    with np.errstate(divide="ignore"):
        return np.asarray(np.minimum(1.0, 1 / (np.pi * resolved * (resolved**2 - 1))))


def smooth(u: Array, values: Array) -> Array:
    """Return the means over :data:`MOST` windows, carried on between their middles by cubics.

    Parameters
    ----------
    u : ndarray, shape(n,)
        Times, scaled to 0 ... 1.
    values : ndarray, shape(m, n)
        Errors, a row each.
    """
    middles = np.arange(1, MOST + 1) / (MOST + 1)
    # Contiguous rows, so that sums along each have the same order, and bits, as if it were alone.
    return np.ascontiguousarray(scipy.interpolate.CubicSpline(middles, window_means(u, values, MOST), axis=-1)(u))
