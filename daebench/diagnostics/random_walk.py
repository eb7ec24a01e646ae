"""The energy error of an ensemble: whether it is bounded, a random walk, or drifts."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from daebench.diagnostics.energy import SHORTEST, SIGNIFICANT, energy_drift
from daebench.errors import BadInput

Array = NDArray[np.float64]

MEMBERS = 16
"""Fewest members from which a random walk is told."""

OCTAVES = 8
"""The spread is followed over the last so many octaves of the time."""

WINDOWS = 6
"""Fewest windows from which an exponent is read."""

CONFIDENCE = 2.0
"""An exponent is known to within so many of its standard errors: 94 in 100 intervals hold it."""

LINEAR_BAND = 0.25
"""A drift is linear where the slopes of its halves differ by at most this part of its slope."""

WALK = (0.25, 0.75)
"""Exponents of a random walk are between these: halfway to those of what is bounded, 0, and of what is linear, 1."""


@dataclass(frozen=True)
class Walk:
    """How the error of an ensemble grows.

    Parameters
    ----------
    slope, slope_error : float
        Mean over the members of their least-squares slopes, in the error's unit per unit of time, and its standard error.
    exponent, exponent_error : float
        Exponent alpha of the members' spread ~ t^alpha, and its standard error; NaN where there is no spread.
    kind : str
        "bounded", "random walk", "linear", "growing" or "undetermined".
    members : int
        Number of members.
    why : str
        What the kind was told by: "slope", "scatter" or "spread", as the rule of :func:`random_walk` names them; "" if by nothing.
    spreads : bool
        Whether members spread beyond the resolution.
    """

    slope: float
    slope_error: float
    exponent: float
    exponent_error: float
    kind: str
    members: int
    why: str = ""
    spreads: bool = False


def random_walk(t: ArrayLike, error: ArrayLike, *, resolution: float = 0.0) -> Walk:
    """Return how the errors e_i(t) of the members i of an ensemble grow, of the energy or any other conserved quantity.

    Truncation is common to members that follow the same motion; what rounding does is their own. Unbiased rounding makes each error a
    random walk, with standard deviation ~ t^(1/2); biased rounding, as of an iteration that ends at a tolerance, makes it grow
    linearly, HLW VIII.5. So two things are looked at:

    - the mean over members of their slopes b_i, by least squares, with the standard error std(b_i) / sqrt(N) of independent members,
      but not less than the error that the oscillation of the mean leaves, see :func:`daebench.diagnostics.energy.energy_drift`;
    - the spread, the standard deviation s_w over members of their means over windows w of half an octave. The exponent alpha of
      s ~ t^alpha is the least-squares slope of log s_w against log t_w over the last eight octaves. Windows of one member are not
      independent, members are: the standard error is the jackknife's, leaving out one member at a time, but not less than that of the
      straight line, for where members hardly differ it is the same motion that makes the windows of all of them scatter.

    The kind is decided by this rule, in this order:

    - "undetermined", all numbers NaN: fewer than 64 times, or an error that is not finite.
    - slope: "linear" or "growing" where the mean slope is beyond 4 of its standard errors; linear where the mean slopes of the two halves
      of the time differ by at most a quarter of it, or by at most 4 standard errors of their difference.
    - scatter: "growing" where the mean over members is, by :func:`daebench.diagnostics.energy.energy_drift`, and its scatter about its
      line in the last quarter of the time is beyond 4 of the standard errors that independent members give it: an oscillation that all
      of them have and that swells.
    - spread:

      - "bounded": there is no spread beyond the resolution, or alpha + 2 standard errors is at most 1/4.
      - "undetermined", alpha NaN: there is a spread in the last fewer than six windows only.
      - "random walk": alpha with 2 standard errors on both sides is between 1/4 and 3/4.
      - "growing": alpha - 2 standard errors is at least 3/4: every member drifts its own way.
      - "undetermined": anything else.

    Of 2000 synthetic walks of 16 members none is called bounded or growing, one or two linear, and 4 % are undetermined.

    Parameters
    ----------
    t : array_like, shape(n,)
        Times, increasing and equally spaced.
    error : array_like, shape(N, n)
        Error of each member from its start, best as means over the time around t.
    resolution : float
        Round-off of one value of the error, such as eps |H|, where it is known, or what starts that differ make of truncation where that
        is more; a spread below it counts as none.

    Raises
    ------
    BadInput
        If there are fewer than 16 members, shapes do not fit, or two members are the same run: their errors are equal, and not all
        of them are zero or within the resolution.
    """
    t, error = np.asarray(t, dtype=float), np.asarray(error, dtype=float)
    if error.ndim != 2 or t.shape != error.shape[1:]:
        raise BadInput(f"an ensemble needs one error for each member and time; the shapes are {error.shape} and {t.shape}.")
    members = len(error)
    if members < MEMBERS:
        raise BadInput(f"a random walk is told from {MEMBERS} members or more, not from {members}.")
    nan = float("nan")
    if len(t) < 2 * SHORTEST or not np.all(np.isfinite(error)):
        return Walk(nan, nan, nan, nan, "undetermined", members)
    _require_distinct(error, resolution)
    size = float(np.max(np.abs(error))) or 1.0
    error, resolution = error / size, resolution / size
    slope, slope_error = _mean_and_error(_slopes(t, error), _noise(t, error, resolution))
    exponent, exponent_error, spreads = _exponent(t, error, resolution)
    if abs(slope) > SIGNIFICANT * slope_error:
        kind, why = _drifting(t, error, slope, resolution), "slope"
    elif _swells(t, error, resolution):
        kind, why = "growing", "scatter"
    else:
        kind, why = _spreading(exponent, exponent_error) if spreads else "bounded", "spread"
    return Walk(size * slope, size * slope_error, exponent, exponent_error, kind, members, why, spreads)


def _require_distinct(error: Array, resolution: float) -> None:
    """Refuse members that are one run several times; where there is no error at all, distinct runs have the same."""
    same = len(error) - len(np.unique(error, axis=0))
    if same and np.max(np.abs(error)) > resolution:
        raise BadInput(f"{same} of {len(error)} members have the errors of another one to the last bit; give runs that differ.")


def _swells(t: Array, error: Array, resolution: float) -> bool:
    """Return whether the members' mean grows without a slope, by more than independent errors of the members make of it."""
    mean = np.mean(error, axis=0)
    if energy_drift(t, mean, resolution=resolution).kind != "growing":
        return False
    last = slice(-(len(t) // 4), None)
    residual = mean - np.polyval(np.polyfit(t - np.mean(t), mean, 1), t - np.mean(t))
    scatter = float(np.mean(residual[last] ** 2))
    return scatter > SIGNIFICANT**2 * float(np.mean(np.var(error[:, last], axis=0, ddof=1))) / len(error)


def _slopes(t: Array, error: Array) -> Array:
    """Return the least-squares slope of each member, shape(N,)."""
    s = t - np.mean(t)
    return np.asarray(error @ s / float(s @ s))


def _noise(t: Array, error: Array, resolution: float) -> float:
    """Return the error of the slope of the members' mean that its own oscillation and round-off leave."""
    of_mean = energy_drift(t, np.mean(error, axis=0), resolution=resolution)
    least = max(resolution, 8 * float(np.finfo(float).eps)) / (SIGNIFICANT * float(t[-1] - t[0]))
    return max(of_mean.slope_error, least)


def _mean_and_error(values: Array, noise: float) -> tuple[float, float]:
    """Return the mean over members and its standard error, at least ``noise``."""
    return float(np.mean(values)), max(float(np.std(values, ddof=1)) / np.sqrt(len(values)), noise)


def _drifting(t: Array, error: Array, slope: float, resolution: float) -> str:
    """Return whether the mean slopes of the two halves of the time are the same."""
    halves = slice(len(t) // 2), slice(len(t) // 2, None)
    first, second = (_slopes(t[half], error[:, half]) for half in halves)
    noise = sum(_noise(t[half], error[:, half], resolution) for half in halves)
    apart, apart_error = _mean_and_error(second - first, noise)
    return "linear" if abs(apart) <= max(LINEAR_BAND * abs(slope), SIGNIFICANT * apart_error) else "growing"


def _spreading(exponent: float, exponent_error: float) -> str:
    """Return what the exponent of a spread says; NaN stands for one that is not known."""
    low, high = exponent - CONFIDENCE * exponent_error, exponent + CONFIDENCE * exponent_error
    if high <= WALK[0]:
        return "bounded"
    if WALK[0] < low and high < WALK[1]:
        return "random walk"
    return "growing" if low >= WALK[1] else "undetermined"


def _exponent(t: Array, error: Array, resolution: float) -> tuple[float, float, bool]:
    """Return the exponent of the spread and its jackknife error, NaN where too few windows have a spread, and whether any has."""
    centres, means = _means(t, error)
    seen = np.std(means, axis=1, ddof=1) > max(resolution, 8 * float(np.finfo(float).eps))
    first = int(np.argmax(seen))
    if not seen.any() or len(centres) - first < WINDOWS:
        return float("nan"), float("nan"), bool(seen.any())
    x, values = np.log(centres[first:]), means[first:]
    N = values.shape[1]
    left = np.array([_log_slope(x, np.delete(values, i, axis=1))[0] for i in range(N)])
    jackknife = float(np.sqrt((N - 1) / N * np.sum((left - np.mean(left)) ** 2)))
    exponent, of_line = _log_slope(x, values)
    return exponent, max(jackknife, of_line), True


def _means(t: Array, error: Array) -> tuple[Array, Array]:
    """Return centres of the windows, and the members' means over them, shape(windows, N)."""
    edges = np.searchsorted(t, t[-1] * 2.0 ** (np.arange(-2 * OCTAVES, 1) / 2))
    edges[-1] = len(t)
    windows = [slice(a, b) for a, b in pairwise(edges) if b > a]
    return np.array([np.mean(t[each]) for each in windows]), np.array([np.mean(error[:, each], axis=1) for each in windows])


def _log_slope(x: Array, values: Array) -> tuple[float, float]:
    """Return the least-squares slope of the logarithm of the standard deviation over members, and the standard error of the line."""
    y = np.log(np.std(values, axis=1, ddof=1) + np.finfo(float).tiny)
    s = x - np.mean(x)
    slope = float(s @ y / (s @ s))
    residual = y - np.mean(y) - slope * s
    return slope, float(np.sqrt(residual @ residual / (len(x) - 2) / (s @ s)))
