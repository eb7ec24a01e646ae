"""Changes of an error at the ends of the time, where they are too fast for windows, and a bound on all that windows may hide."""

import numpy as np

from daebench.diagnostics.secular import Secular
from daebench.runs.trajectory import Array

PERIODIC = 20
"""Fewer oscillations than this are compared one by one at the ends, where windows of several hide a fast change."""

ENOUGH = 15
"""Windows that are not few."""

EDGE = 1 / 8
"""Part of the time at either end in which a change may be too fast for windows."""

MARGIN = 1.25
"""The bound is this times the range of window means."""

SAMPLES = 16
"""Fewest samples of a mean at an end."""


def change_bound(u: Array, error: Array, means: Array, swings: int) -> float:
    """Return an upper bound on the change of the mean.

    It is a quarter more than the range of the window means, carried on to both ends of the time by twice their last differences, and of
    the plain means over two oscillations at either end where these are shorter than a window. Where oscillations and windows are few,
    the differences of the first and the last oscillation from their neighbours are added.

    Parameters
    ----------
    u, error : ndarray, shape(n,)
        Times, scaled to 0 ... 1, and errors.
    means : ndarray, shape(windows,)
        Window means.
    swings : int
        Number of oscillations.
    """
    ends = [means[0] - 2 * (means[1] - means[0]), means[-1] + 2 * (means[-1] - means[-2])]
    length = 2 / max(swings, 1)
    if length < 2 / (len(means) + 1):
        short = max(length, SAMPLES / len(u))
        ends += [float(np.mean(error[u <= short])), float(np.mean(error[u >= 1 - short]))]
    unlike = _unlike(error, swings) if 0 < swings < PERIODIC and len(means) < ENOUGH else 0.0
    return MARGIN * float(np.ptp(np.concatenate([means, ends]))) + unlike


def _unlike(error: Array, swings: int) -> float:
    """Return by how much the first and the last period of an oscillation differ from their neighbours, at most."""
    n = len(error)
    lags = np.unique(np.linspace(0.6, 1.6, 60) * n / swings).astype(int)
    lags = lags[(lags > 0) & (lags < n // 2)]
    if not len(lags):
        return float(np.ptp(error))
    lag = min(lags, key=lambda k: float(np.mean((error[k:] - error[:-k]) ** 2)))
    apart = np.abs(error[lag:] - error[:-lag])
    return float(max(np.max(apart[:lag]), np.max(apart[-lag:])))


def edge_change(u: Array, error: Array, noise: float) -> Secular | None:
    """Return the change of an error whose first value is far from all that are later, or its last from all that are earlier.

    Far is beyond their range by more than the range. Such a change is over within an eighth of the time, or begins there.

    Parameters
    ----------
    u, error : ndarray, shape(n,)
        Times, scaled to 0 ... 1, and errors.
    noise : float
        Round-off of one value.

    Returns
    -------
    Secular or None
        None if there is none.
    """
    late, early = error[u > EDGE], error[u < 1 - EDGE]
    if _outside(error[0], late, noise):
        change = float(np.mean(late) - error[0])
        return Secular("saturated", 2 / EDGE, change, abs(change), 0.0, 0.0, 0.0)
    if _outside(error[-1], early, noise):
        change = float(error[-1] - np.mean(early))
        return Secular("exponential", 2 / EDGE, change, abs(change), 0.0, 0.0, 0.0)
    return None


def _outside(value: float, others: Array, noise: float) -> bool:
    least, most = float(np.min(others)), float(np.max(others))
    return max(least - value, value - most) > most - least + noise
