"""Means of an error over windows, in which the oscillation averages out and the secular part remains."""

import numpy as np

from daebench.runs.trajectory import Array

MOST = 31
"""Windows at most."""

PERIODS = 2.0
"""Periods of the oscillation in a window: a tapered mean leaves at most 3 parts in 100 of it."""


def window_count(oscillations: int) -> int:
    """Return how many windows, each overlapping the next by half, hold two periods of the oscillation each."""
    return min(MOST, int(2 * oscillations / PERIODS) - 1)


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
    values : ndarray, shape(n,) or shape(n, m)
        Errors, one column each.
    windows : int
        How many.

    Returns
    -------
    ndarray, shape(windows,) or shape(windows, m)
    """
    length = 2.0 / (windows + 1)
    bounds = np.searchsorted(u, 0.5 * length * np.arange(windows + 2))
    bounds[-1] = len(u)
    means = []
    for k in range(windows):
        part = slice(bounds[k], max(bounds[k + 2], bounds[k] + 1))
        taper = np.sin(np.pi * (u[part] / length - 0.5 * k)) ** 2 + 1e-12
        means.append(taper @ values[part] / np.sum(taper))
    return np.array(means)


def leakage(periods: float) -> float:
    """Return 1 / (pi x (x^2 - 1)), the part of an oscillation that the mean over a window of x of its periods leaves, at most."""
    return min(1.0, 1 / (np.pi * periods * (periods**2 - 1))) if periods > 1 else 1.0


def smooth(u: Array, values: Array) -> Array:
    """Return the means over :data:`MOST` windows, carried on between their middles by cubics.

    Parameters
    ----------
    u, values : ndarray, shape(n,)
        Times, scaled to 0 ... 1, and errors.
    """
    from scipy.interpolate import CubicSpline

    middles = np.arange(1, MOST + 1) / (MOST + 1)
    return np.asarray(CubicSpline(middles, window_means(u, values, MOST))(u))
