"""Whether the mean of an error changes, told from its window means, their scatter and the number of oscillations seen."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from daebench.diagnostics.ends import ENOUGH, change_bound, edge_change
from daebench.diagnostics.oscillations import aliased, oscillations, rough
from daebench.diagnostics.secular import Secular, secular
from daebench.diagnostics.window_means import MOST, leakage, smooth, window_count, window_means
from daebench.runs.trajectory import Array

OSCILLATIONS = 5
"""Fewest oscillations from which an error is called bounded."""

WINDOWS = 9
"""Fewest windows whose scatter is known well enough to hold a drift against it."""

NOISE, FEW_WINDOWS, SLOW, WALK, NO_WINDOWS = 4.5, 8.0, 7.0, 20.0, 15.0
"""A drift is beyond so many standard deviations of the window means: of noise; of noise in fewer than 15 windows; of what is an
oscillation with a period near the whole time; of a random walk; and where windows hold no whole oscillations."""

LEFT = 2.5
"""A drift is beyond so many times the part of the oscillation that the windows leave; the range of that part is twice as much."""

RED = 0.25
"""Correlation of neighbouring window means from which on they are no noise; a fifth of it where windows are few."""

SPREADING = 4.0
"""The scatter of an error grows where it grows by this factor from the first quarter of the time to the last."""


ALIASED = "aliased output: the oscillation has fewer than five outputs a period, so that a slow change may be its alias"
WALKS = "a single random walk, or what looks like one: an ensemble tells it"
FEW = f"fewer than {OSCILLATIONS} oscillations"
SHORT = "too short: window means scatter as much as the error"


@dataclass(frozen=True)
class Trend:
    """How the mean of an error changes over the time, in the error's unit.

    Parameters
    ----------
    secular : Secular
        The shape that fits best.
    drifts : bool
        Whether the mean changes by more than the scatter of window means, or the oscillation grows.
    bound : float
        Upper bound on the modulus of the change.
    reason : str
        Why neither a drift nor boundedness is told; "" where one is.
    spreads : bool
        Whether it is the oscillation that grows.
    """

    secular: Secular
    drifts: bool
    bound: float
    reason: str = ""
    spreads: bool = False


def trend(t: Array, error: Array, noise: float) -> Trend:
    """Return how the mean of an error changes.

    Parameters
    ----------
    t, error : ndarray, shape(n,)
        Times, increasing and about equally spaced, and errors of modulus at most about 1, finite; n is at least 32.
    noise : float
        Round-off of one value.
    """
    u = (t - t[0]) / (t[-1] - t[0])
    coarse = secular(window_means(u, error, MOST))
    residual = error - coarse.along(u)
    swings = oscillations(residual)
    ripple = residual - smooth(u, residual)
    ripples = oscillations(ripple)
    windows = window_count(ripples)
    means = window_means(u, error, windows if windows >= 4 else MOST)
    secular_part = secular(means) if windows >= WINDOWS else coarse
    left = leakage(2 * ripples / (len(means) + 1)) * float(np.ptp(ripple)) / 2 if windows >= WINDOWS else 0.0
    bound = change_bound(u, error, means, swings) + 2 * left
    edge = edge_change(u, error, noise)
    if edge:
        return Trend(edge, True, max(bound, abs(edge.change)))
    if secular_part.seen > max(noise, _threshold(secular_part, windows, residual) * secular_part.scatter, LEFT * left):
        if aliased(residual) and secular_part.seen < np.ptp(residual):
            return Trend(secular_part, False, bound, ALIASED)
        return Trend(secular_part, True, max(bound, abs(secular_part.change)))
    if swings >= OSCILLATIONS and _spreads(residual, noise):
        return Trend(secular_part, True, bound, spreads=True)
    return Trend(secular_part, False, bound, _doubt(error, residual, secular_part, bound, swings, noise))


def beyond(secular_part: Secular) -> bool:
    """Return whether a change is beyond what noise in the window means makes of none."""
    return secular_part.seen > NOISE * secular_part.scatter


def _threshold(secular_part: Secular, windows: int, residual: Array) -> float:
    """Return how many standard deviations of the window means a drift has to be beyond."""
    if _wanders(secular_part, windows) or (windows < MOST and rough(residual)):
        return WALK
    if windows < WINDOWS:
        return NO_WINDOWS
    if windows < ENOUGH:
        return FEW_WINDOWS
    return SLOW if secular_part.neighbours > RED else NOISE


def _wanders(secular_part: Secular, windows: int) -> bool:
    """Return whether window means wander: neighbours are alike, as of a slow oscillation, but their differences are not."""
    alike = RED if windows >= MOST or windows < WINDOWS else RED / 5
    return secular_part.neighbours > alike and secular_part.increments < secular_part.neighbours - 0.1


def _spreads(residual: Array, noise: float) -> bool:
    quarters = [float(np.std(part)) for part in np.array_split(residual, 4)]
    grows = quarters[3] > noise and quarters[3] > SPREADING * quarters[0]
    return grows and all(a < b for a, b in pairwise(quarters))


def _doubt(error: Array, residual: Array, secular_part: Secular, bound: float, swings: int, noise: float) -> str:
    """Return why an error that does not drift is not known to be bounded either; "" if it is."""
    whole = float(np.ptp(error))
    if whole <= noise:
        return ""
    if bound >= whole and (rough(residual) or (swings >= OSCILLATIONS and _wanders(secular_part, MOST))):
        return WALKS
    if swings < OSCILLATIONS:
        return FEW
    if bound < whole:
        return ""
    return ALIASED if aliased(residual) else SHORT
