"""Whether the mean over the members of an ensemble drifts, compared with its own scatter and with that of independent members."""

from dataclasses import replace

import numpy as np

from daebench.diagnostics.secular import factors
from daebench.diagnostics.trend import Trend, beyond, trend
from daebench.diagnostics.window_means import MOST, window_means
from daebench.runs.trajectory import Array

SIGNIFICANT = 4.5
"""The mean of the members' changes is a drift above this multiple of its standard error."""

EXPLAINED = 2.0
"""Independent members explain a scatter of their mean up to this multiple of its average."""

SPREAD_EARLY = 4.0
"""A growing scatter of the mean is that of the members if it is within this multiple of their standard error."""


def ensemble_trend(t: Array, error: Array, noise: float) -> Trend:
    """Return the change of the mean over members.

    Parameters
    ----------
    t : ndarray, shape(n,)
        Times, equally spaced.
    error : ndarray, shape(N, n)
        Errors of the members, of modulus at most about 1.
    noise : float
        Round-off of one value.
    """
    mean = np.mean(error, axis=0)
    mean_trend = trend(t, mean, noise)
    means = window_means((t - t[0]) / (t[-1] - t[0]), error, MOST)
    standard_error = float(np.sqrt(np.mean(np.var(means, axis=0, ddof=1)) / len(error)))
    if mean_trend.spreads:
        return (
            mean_trend
            if _common(error, mean)
            else replace(mean_trend, drifts=False, spreads=False, reason="the members' own scatter grows")
        )
    # Independent members allow a test that one error does not: the scatter of their own changes, each fitted with the common shape.
    changes = factors(means, mean_trend.secular)
    deviation = float(np.std(changes, ddof=1)) / np.sqrt(len(error))
    clear = abs(float(np.mean(changes))) > SIGNIFICANT * deviation and mean_trend.secular.seen > noise
    bound = mean_trend.bound + SIGNIFICANT * deviation
    if clear and (mean_trend.drifts or (mean_trend.secular.scatter <= EXPLAINED * standard_error and beyond(mean_trend.secular))):
        return replace(mean_trend, drifts=True, reason="", bound=bound)
    if mean_trend.drifts:
        return replace(mean_trend, drifts=False, reason="the change of the mean is within the scatter of independent members", bound=bound)
    # Members scatter about the mean, so that a bound below their scatter is small, too: the mean itself may hardly oscillate.
    small = bound < max(float(np.ptp(mean)), 2 * float(np.max(np.std(error, axis=0))))
    return replace(
        mean_trend, bound=bound, reason="" if small and mean_trend.reason.startswith(("too short", "a single")) else mean_trend.reason
    )


def _common(error: Array, mean: Array) -> bool:
    """Return whether the scatter of the mean at the end is more than that of independent members."""
    last = slice(-(len(mean) // 4), None)
    residual = mean[last] - np.mean(mean[last])
    variance = float(np.mean(np.var(error[:, last], axis=0, ddof=1))) / len(error)
    return float(np.mean(residual**2)) > SPREAD_EARLY**2 * variance
