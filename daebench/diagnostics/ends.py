"""Changes of errors at the ends of the time that are too fast for windows, and a bound on all changes that windows may hide."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from daebench.diagnostics.secular import Secular
from daebench.runs.trajectory import Array
from daebench.systems.lazily import scipy

PERIODIC = 20
"""Fewer oscillations than this are compared one by one at the ends, because windows of several hide a fast change."""

ENOUGH = 15
"""Number of windows that is enough."""

EDGE = 1 / 8
"""Part of the time at either end in which a change may be too fast for windows."""

MARGIN = 1.25
"""Ratio of the bound to the range of window means."""

SAMPLES = 16
"""Smallest number of samples of a mean at an end."""


@dataclass(frozen=True)
class Windows:
    """Numbers of window means of m errors, and their ranges with both ends of the time, shape(m,)."""

    count: NDArray[np.int64]
    least: Array
    most: Array

    @classmethod
    def none(cls, m: int) -> Self:
        """Return empty windows for m errors."""
        return cls(np.zeros(m, dtype=np.int64), np.empty(m), np.empty(m))

    def put(self, members: NDArray[np.int64], means: Array) -> None:
        """Store the window means of some errors, shape(members, windows)."""
        # The middle of the outermost window is one difference away from the end: twice as much allows for a change that speeds up.
        ends = means[:, 0] - 2 * (means[:, 1] - means[:, 0]), means[:, -1] + 2 * (means[:, -1] - means[:, -2])
        self.count[members] = means.shape[1]
        self.least[members] = np.minimum.reduce([np.min(means, axis=1), *ends])
        self.most[members] = np.maximum.reduce([np.max(means, axis=1), *ends])


def change_bound(u: Array, error: Array, windows: Windows, swings: NDArray[np.int64]) -> Array:
    """Return an upper bound on the change of the mean of each error, shape(m,).

    It is a quarter more than the range of the window means, carried on to both ends of the time by twice their last differences, and of
    the plain means over two oscillations at either end where these are shorter than a window. Where oscillations and windows are few,
    the differences of the first and the last oscillation from their neighbours are added.

    Parameters
    ----------
    u : ndarray, shape(n,)
        Times, scaled to 0 ... 1.
    error : ndarray, shape(m, n)
        Errors, a row each.
    windows : Windows
        Their window means.
    swings : ndarray of int, shape(m,)
        Numbers of oscillations.
    """
    length = 2 / np.maximum(swings, 1)
    shorter = length < 2 / (windows.count + 1)
    at_start, at_end = _plain_means(u, error, np.maximum(length, SAMPLES / len(u)))
    ends = [np.where(shorter, mean, windows.least) for mean in (at_start, at_end)]
    least, most = (extreme.reduce([bound, *ends]) for extreme, bound in ((np.minimum, windows.least), (np.maximum, windows.most)))
    bound = MARGIN * (most - least)
    few = np.flatnonzero((swings > 0) & (swings < PERIODIC) & (windows.count < ENOUGH))
    if len(few):
        bound[few] += _unlike(error[few], swings[few])
    return np.asarray(bound)


def _plain_means(u: Array, error: Array, length: Array) -> tuple[Array, Array]:
    """Return the means of each error over a length at the start of the time and at its end."""
    sums, rows = np.cumsum(error, axis=1), np.arange(len(error))
    first, last = np.searchsorted(u, length, side="right"), np.searchsorted(u, 1 - length)
    return sums[rows, first - 1] / first, (sums[:, -1] - sums[rows, last - 1] * (last > 0)) / (len(u) - last)


def _unlike(error: Array, swings: NDArray[np.int64]) -> Array:
    """Return the largest differences of the first and the last period of each oscillation from their neighbours, shape(m,)."""
    n = error.shape[1]
    lag = _periods(error, swings)
    k = np.arange(np.max(lag))
    first = np.take_along_axis(error, np.minimum(k + lag[:, None], n - 1), axis=1) - error[:, : len(k)]
    last = error[:, n - len(k) :] - np.take_along_axis(error, np.maximum(np.arange(n - len(k), n) - lag[:, None], 0), axis=1)
    within = k < lag[:, None]
    apart = np.maximum(np.abs(first), np.abs(last[:, ::-1]))
    return np.asarray(np.where(lag > 0, np.max(apart, axis=1, where=within, initial=0.0), np.ptp(error, axis=1)))


def _periods(error: Array, swings: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the number of samples after which each oscillation repeats best, near its mean period, shape(m,); 0 if that is too long."""
    n = error.shape[1]
    likeness = np.full((len(error), n // 2), np.inf)
    differences = _mean_squares(error)
    for count in np.unique(swings).tolist():
        # Around the mean period, which a count of swings gives roughly: swings may be missed, or noise may add some.
        lags = np.unique(np.linspace(0.6, 1.6, 60) * n / count).astype(int)
        lags = lags[(lags > 0) & (lags < n // 2)]
        rows = np.flatnonzero(swings == count)[:, None]
        likeness[rows, lags] = differences[rows, lags]
    # A lag of 0 is chosen only where no other was allowed: it marks an oscillation that is too long to be compared.
    likeness[:, 0] = np.finfo(float).max
    return np.asarray(np.argmin(likeness, axis=1))


def _mean_squares(error: Array) -> Array:
    """Return the mean squares of the differences of values that are 0, 1, 2, ... samples apart, up to half of them, shape(m, n // 2)."""
    n = error.shape[1]
    length = scipy.fft.next_fast_len(n + n // 2, real=True)  # products of values up to n/2 apart meet no others
    transform = np.fft.rfft(error, length)
    correlated = np.fft.irfft(transform.real**2 + transform.imag**2, length)[:, : n // 2]
    squares = np.cumsum(error**2, axis=1)
    both = squares[:, ::-1][:, : n // 2] + squares[:, -1:] - np.pad(squares[:, : n // 2 - 1], ((0, 0), (1, 0)))
    return np.asarray((both - 2 * correlated) / np.arange(n, n - n // 2, -1))


def edge_changes(u: Array, error: Array, noise: Array) -> tuple[NDArray[Any], Secular]:
    """Return the errors with a first value far from all later ones, or a last one far from all earlier ones, and their changes.

    Far is beyond their range by more than the range. Such a change is over within an eighth of the time, or begins there.

    Parameters
    ----------
    u : ndarray, shape(n,)
        Times, scaled to 0 ... 1.
    error : ndarray, shape(m, n)
        Errors, a row each.
    noise : ndarray, shape(m,)
        Round-off of one value of each.

    Returns
    -------
    members : ndarray of int, shape(k,)
        Indices of these errors.
    changes : Secular
        Those of these k.
    """
    # Each end is compared with everything outside of its own eighth, in which the change may still go on.
    late, early = error[:, np.searchsorted(u, EDGE, side="right") :], error[:, : np.searchsorted(u, 1 - EDGE)]
    first = _outside(error[:, 0], late, noise)
    last = _outside(error[:, -1], early, noise) & ~first
    members = np.flatnonzero(first | last)
    at_first, zero = first[members], np.zeros(len(members))
    change = np.where(at_first, np.mean(late[members], axis=1) - error[members, 0], error[members, -1] - np.mean(early[members], axis=1))
    law = np.where(at_first, "saturated", "exponential")
    return members, Secular(law, np.full(len(members), 2 / EDGE), change, np.abs(change), zero, zero, zero)


def _outside(value: Array, others: Array, noise: Array) -> NDArray[np.bool_]:
    least, most = np.min(others, axis=1), np.max(others, axis=1)
    return np.asarray(np.maximum(least - value, value - most) > most - least + noise)
