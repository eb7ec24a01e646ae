"""Whether the means of errors change, by their window means, the scatter of these and the number of oscillations."""

from dataclasses import dataclass, fields, replace
from itertools import pairwise
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from daebench.diagnostics.ends import ENOUGH, Windows, change_bound, edge_changes
from daebench.diagnostics.growth import FEWEST
from daebench.diagnostics.oscillations import aliased, oscillations, rough
from daebench.diagnostics.secular import Secular, secular
from daebench.diagnostics.window_means import MOST, leakage, smooth, window_count, window_means
from daebench.runs.trajectory import Array

OSCILLATIONS = 5
"""Fewest oscillations from which an error is called bounded."""

WINDOWS = 9
"""Fewest windows whose scatter is known well enough to hold a drift against it."""

NOISE, FEW_WINDOWS, SLOW, WALK, NO_WINDOWS = 4.5, 8.0, 7.0, 20.0, 15.0
"""Numbers of standard deviations of the window means that a drift exceeds: for noise; for noise in fewer than 15 windows; for an
oscillation with a period near the whole time; for a random walk; and if windows hold no whole oscillations."""

LEFT = 2.5
"""Multiple of the part of the oscillation that the windows leave, which a drift exceeds; the range of that part is twice its size."""

RED = 0.25
"""Correlation of neighbouring window means above which they are not noise; a fifth of it for few windows."""

SPREADING = 4.0
"""The scatter of an error grows where it grows by this factor from the first quarter of the time to the last."""

LEAST_WINDOWS = 4
"""Fewest windows to which shapes are fitted."""

SMALL, SMALL_ONE_WAY = 0.5, 0.1
"""Largest range of the window means of a bounded error, relative to the range of the error; and the largest if they go one way."""

ALIKE, BY_CHANCE = 0.3, 3.5
"""Window means go one way if Kendall's correlation with time exceeds the first, and the second times its standard deviation for noise."""


ALIASED = "aliased output: the oscillation has fewer than five outputs per period, so a slow change may be its alias"
WALKS = "a random walk of a single run, or a similar error: an ensemble can decide"
FEW = f"fewer than {OSCILLATIONS} oscillations"
SHORT = "too short: window means scatter nearly as much as the error"
ONE_WAY = "too short: the mean moves one way by a large part of the oscillation, but no further than its own scatter may take it"


@dataclass(frozen=True)
class Trend:
    """How the means of m errors change over the time, in the errors' unit; of one error each entry is one.

    Parameters
    ----------
    secular : Secular
        The shapes that fit best.
    drifts : ndarray of bool, shape(m,)
        Whether the mean changes by more than the scatter of window means, or the oscillation grows.
    bound : ndarray, shape(m,)
        Upper bound on the modulus of the change.
    reason : ndarray of str, shape(m,)
        The reason for an undetermined verdict; "" if it is decided.
    spreads : ndarray of bool, shape(m,)
        Whether it is the oscillation that grows.
    windows : ndarray of int, shape(m,)
        How many windows the law is read from, see :func:`daebench.diagnostics.growth.law`.
    leak : ndarray, shape(m,)
        What these leave of the oscillation, at most.
    fast : ndarray of bool, shape(m,)
        Whether the change is over within an eighth of the time, or begins there.
    """

    secular: Secular
    drifts: Any
    bound: Any
    reason: Any
    spreads: Any
    windows: Any
    leak: Any
    fast: Any

    def one(self, i: int) -> Self:
        """Return the trend of one error."""
        numbers = {field.name: getattr(self, field.name)[i] for field in fields(self)[1:]}
        return replace(self, secular=self.secular.one(i), **{name: np.asarray(x).item() for name, x in numbers.items()})


@dataclass(frozen=True)
class _Residuals:
    """Errors less their secular parts, and the oscillations in them: swings of the whole, and those that are faster than windows."""

    rows: Array
    swings: NDArray[np.int64]
    ripples: NDArray[np.int64]
    ripple_range: Array

    def leak(self, windows: NDArray[np.int64]) -> Array:
        """Return the largest part of the fast oscillations that means over these numbers of windows leave."""
        return np.asarray(leakage(2 * self.ripples / (windows + 1)) * self.ripple_range / 2)


@dataclass(frozen=True)
class _Means:
    """The ranges of the window means of errors, and whether they go one way."""

    range: Array
    one_way: NDArray[np.bool_]


def trend(t: Array, error: Array, noise: float) -> Trend:
    """Return the change of the mean of one error, see :func:`trends`."""
    return trends(t, error[None], np.array([noise])).one(0)


def trends(t: Array, error: Array, noise: Array) -> Trend:
    """Return the change of the mean of each error; each result is independent of the other errors, to the bit.

    Parameters
    ----------
    t : ndarray, shape(n,)
        Times, increasing and about equally spaced; n is at least 32.
    error : ndarray, shape(m, n)
        Errors of modulus at most about 1, finite, a row each.
    noise : ndarray, shape(m,)
        Round-off of one value of each.
    """
    u = (t - t[0]) / (t[-1] - t[0])
    # A first fit by the most windows: the number of oscillations can be counted only after the secular part is taken away.
    coarse = secular(window_means(u, error, MOST))
    residuals = _residuals(u, error - coarse.along(u))
    windows = window_count(residuals.ripples)
    part, bound, left, means = _by_windows(u, error, coarse, residuals, windows)
    changed = part.seen > np.maximum.reduce([noise, _thresholds(part, windows, residuals.rows) * part.scatter, LEFT * left])
    alias = changed.copy()
    # A change beyond the range of what oscillates cannot be the alias of it.
    alias[changed] = aliased(residuals.rows[changed]) & (part.seen < np.ptp(residuals.rows, axis=1))[changed]
    drifts = changed & ~alias
    spreads = ~changed & (residuals.swings >= OSCILLATIONS) & _spreads(residuals.rows, noise)
    # The bound on a drift is never smaller than the change that is stated beside it.
    bound = np.where(drifts, np.maximum(bound, np.abs(part.change)), bound)
    reason = np.where(alias, ALIASED, "").astype(object)
    open_ = np.flatnonzero(~changed & ~spreads)
    reason[open_] = _doubts(error, residuals, part, bound, noise, means, open_)
    edges, edge = edge_changes(u, error, noise)
    part.put(edges, edge)
    bound[edges] = np.maximum(bound[edges], np.abs(edge.change))
    drifts = drifts | spreads
    drifts[edges], spreads[edges], reason[edges] = True, False, ""
    read = np.where(windows >= FEWEST, windows, MOST)
    return Trend(part, drifts, bound, reason, spreads, read, residuals.leak(read), np.isin(np.arange(len(error)), edges))


def _residuals(u: Array, rows: Array) -> _Residuals:
    ripple = rows - smooth(u, rows)
    return _Residuals(rows, oscillations(rows), oscillations(ripple), np.ptp(ripple, axis=1))


def _by_windows(
    u: Array, error: Array, coarse: Secular, residuals: _Residuals, windows: NDArray[np.int64]
) -> tuple[Secular, Array, Array, "_Means"]:
    """Return the numbers of an error that take its windows: its secular part, the bound on its change, residuals, and means."""
    part = replace(coarse, **{field.name: getattr(coarse, field.name).copy() for field in fields(coarse)})
    counts, left, taken = np.where(windows >= LEAST_WINDOWS, windows, MOST), np.zeros(len(error)), Windows.none(len(error))
    moved = _Means(np.zeros(len(error)), np.zeros(len(error), dtype=bool))
    for count in np.unique(counts).tolist():
        members = np.flatnonzero(counts == count)
        means = window_means(u, error[members], count)
        taken.put(members, means)
        moved.range[members], moved.one_way[members] = np.ptp(means, axis=1), goes_one_way(means)
        # Fewer windows leave too few degrees of freedom; the first fit is kept for these errors.
        known = windows[members] >= WINDOWS
        if known.any():
            part.put(members[known], secular(means[known]))
    known = windows >= WINDOWS
    left[known] = residuals.leak(counts)[known]
    return part, change_bound(u, error, taken, residuals.swings) + 2 * left, left, moved


def goes_one_way(means: Array) -> NDArray[np.bool_]:
    """Return whether window means go up or down with time, by the signs of all of their differences, shape(m,).

    Kendall's correlation is the sum of the signs over their number n (n - 1) / 2, and has the variance 2 (2 n + 5) / (9 n (n - 1)) where
    the means are independent.

    Parameters
    ----------
    means : ndarray, shape(m, n)
        Means over n windows, a row for each error.
    """
    n = means.shape[1]
    signs = sum(np.sum(np.sign(means[:, k:] - means[:, :-k]), axis=1) for k in range(1, n))
    correlation = np.abs(signs) / (n * (n - 1) / 2)
    return np.asarray((correlation > ALIKE) & (correlation > BY_CHANCE * np.sqrt(2 * (2 * n + 5) / (9 * n * (n - 1)))))


def beyond(secular_part: Secular) -> bool:
    """Return whether a change is larger than noise in the window means explains."""
    return bool(secular_part.seen > NOISE * secular_part.scatter)


def _thresholds(part: Secular, windows: NDArray[np.int64], residual: Array) -> Array:
    """Return the number of standard deviations of the window means that a drift has to exceed."""
    walks = _wanders(part, windows)
    # Where there are most windows, their own correlations show a walk; else the samples have to.
    unclear = ~walks & (windows < MOST)
    walks[unclear] = rough(residual[unclear])
    choices = [walks, windows < WINDOWS, windows < ENOUGH, part.neighbours > RED]
    return np.select(choices, [WALK, NO_WINDOWS, FEW_WINDOWS, SLOW], NOISE)


def _wanders(part: Secular, windows: Any) -> NDArray[np.bool_]:
    """Return whether window means wander: neighbours are alike, as of a slow oscillation, but their differences are not."""
    alike = np.where((windows >= MOST) | (windows < WINDOWS), RED, RED / 5)
    return np.asarray((part.neighbours > alike) & (part.increments < part.neighbours - 0.1))


def _spreads(residual: Array, noise: Array) -> NDArray[np.bool_]:
    quarters = [np.std(quarter, axis=1) for quarter in np.array_split(residual, 4, axis=1)]
    # From quarter to quarter, so that a single burst is no growth.
    grows = (quarters[3] > noise) & (quarters[3] > SPREADING * quarters[0])
    return np.asarray(np.logical_and.reduce([grows, *(a < b for a, b in pairwise(quarters))]))


def _doubts(
    error: Array,
    residuals: _Residuals,
    part: Secular,
    bound: Array,
    noise: Array,
    means: _Means,
    members: NDArray[np.int64],
) -> Any:
    """Return the reasons for which errors without a drift are not known to be bounded; "" if they are."""
    extent, bound, swings = np.ptp(error[members], axis=1), bound[members], residuals.swings[members]
    moves = means.one_way[members] & (means.range[members] >= SMALL_ONE_WAY * extent)
    unbound = moves | (bound >= extent) | (means.range[members] >= SMALL * extent)
    walks = unbound & (swings >= OSCILLATIONS) & _wanders(part, MOST)[members]
    unclear = unbound & ~walks
    walks[unclear] = rough(residuals.rows[members[unclear]])
    alias = unbound & ~walks & (swings >= OSCILLATIONS)
    alias[alias] = aliased(residuals.rows[members[alias]])
    choices = [extent <= noise[members], walks, swings < OSCILLATIONS, ~unbound, alias, moves]
    reasons = np.array(["", WALKS, FEW, "", ALIASED, ONE_WAY, SHORT], dtype=object)
    return np.asarray(reasons[np.select(choices, range(6), 6)])
