"""Whether the mean of an error changes, told from its window means, their scatter and the number of oscillations seen."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daebench.diagnostics.oscillations import aliased, oscillations, rough
from daebench.diagnostics.secular import Secular, secular
from daebench.diagnostics.window_means import MOST, leakage, smooth, window_count, window_means

Array = NDArray[np.float64]

OSCILLATIONS = 5
"""Fewest oscillations from which an error is called bounded."""

PERIODIC = 20
"""Fewer oscillations than this are compared one by one at the ends, where windows of several hide a fast change."""

WINDOWS = 9
"""Fewest windows whose scatter is known well enough to hold a drift against it."""

NOISE, FEW_WINDOWS, SLOW, WALK, NO_WINDOWS = 4.5, 8.0, 7.0, 20.0, 15.0
"""A drift is beyond so many standard deviations of the window means: of noise; of noise in fewer than 15 windows; of what is an
oscillation with a period near the whole time; of a random walk; and where windows hold no whole oscillations."""

LEFT = 2.5
"""A drift is beyond so many times the part of the oscillation that the windows leave; the range of that part is twice as much."""

RED = 0.25
"""Correlation of neighbouring window means from which on they are no noise; a fifth of it where windows are few."""

EDGE = 1 / 8
"""Part of the time at either end in which a change is looked for that is too fast for windows."""

SPREADING = 4.0
"""The scatter of an error grows where it grows by this factor from the first quarter of the time to the last."""


@dataclass(frozen=True)
class Trend:
    """How the mean of an error changes over the time, in the error's unit.

    Parameters
    ----------
    secular : Secular
        The shape that fits best.
    drifts : bool
        Whether the change is beyond the scatter of window means.
    bound : float
        Upper bound on the modulus of the change.
    reason : str
        Why neither a drift nor boundedness is told; "" where one is.
    spreads : bool
        Whether the oscillation grows.
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
    found = secular(means) if windows >= WINDOWS else coarse
    left = leakage(2 * ripples / (len(means) + 1)) * float(np.ptp(ripple)) / 2 if windows >= WINDOWS else 0.0
    bound = _bound(u, error, means, swings) + 2 * left + (_unlike(error, swings) if 0 < swings < PERIODIC else 0.0)
    edge = _edge(u, error, noise)
    if edge:
        return Trend(edge, True, max(bound, abs(edge.change)))
    if found.seen > noise and found.seen > max(_threshold(found, windows, residual) * found.scatter, LEFT * left):
        if aliased(residual) and found.seen < np.ptp(residual):
            return Trend(found, False, bound, ALIASED)
        return Trend(found, True, max(bound, abs(found.change)))
    if swings >= OSCILLATIONS and _spreads(residual, noise):
        return Trend(found, True, bound, spreads=True)
    return Trend(found, False, bound, _doubt(error, found, bound, swings, noise, residual))


ALIASED = "aliased output: the oscillation has fewer than five outputs a period, so that a slow change may be its alias"
WALKS = "a single random walk, or what looks like one: an ensemble tells it"


def _threshold(found: Secular, windows: int, residual: Array) -> float:
    """Return how many standard deviations of the window means a drift has to be beyond."""
    if _wanders(found, windows) or (windows < MOST and rough(residual)):
        return WALK
    if windows < WINDOWS:
        return NO_WINDOWS
    if windows < 15:
        return FEW_WINDOWS
    return SLOW if found.neighbours > RED else NOISE


def beyond(found: Secular) -> bool:
    """Return whether a change is beyond what noise in the window means makes of none."""
    return found.seen > NOISE * found.scatter


def _wanders(found: Secular, windows: int) -> bool:
    """Return whether window means wander about the secular part: neighbours are alike, as of a slow oscillation, but their steps are not."""
    alike = RED if windows >= MOST or windows < WINDOWS else RED / 5
    return found.neighbours > alike and found.increments < found.neighbours - 0.1


def _bound(u: Array, error: Array, means: Array, swings: int) -> float:
    """Return a bound on the change of the mean: the range of window means, carried on to the ends of the time by their last differences."""
    ends = [means[0] - 2 * (means[1] - means[0]), means[-1] + 2 * (means[-1] - means[-2])]
    length = 2 / max(swings, 1)
    if length < 2 / (len(means) + 1):
        short = max(length, 16 / len(u))
        ends += [float(np.mean(error[u <= short])), float(np.mean(error[u >= 1 - short]))]
    return 1.25 * float(np.ptp(np.concatenate([means, ends])))


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


def _edge(u: Array, error: Array, noise: float) -> Secular | None:
    """Return the change of an error whose first, or last, value is far from all that are later, or earlier; None if they are not."""
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


def _spreads(residual: Array, noise: float) -> bool:
    quarters = [float(np.std(part)) for part in np.array_split(residual, 4)]
    return quarters[3] > noise and quarters[3] > SPREADING * quarters[0] and all(a < b for a, b in zip(quarters, quarters[1:], strict=False))


def _doubt(error: Array, found: Secular, bound: float, swings: int, noise: float, residual: Array) -> str:
    """Return why an error that does not drift is not known to be bounded either; "" if it is."""
    whole = float(np.ptp(error))
    if whole <= noise:
        return ""
    if bound >= whole and (_wanders(found, MOST) or rough(residual)):
        return WALKS
    if swings < OSCILLATIONS:
        return f"fewer than {OSCILLATIONS} oscillations"
    if bound < whole:
        return ""
    return ALIASED if aliased(residual) else "too short: window means scatter as much as the error"
