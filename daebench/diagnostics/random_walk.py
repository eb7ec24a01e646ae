"""The energy error of an ensemble: whether it is bounded, a random walk, or drifts."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from daebench.diagnostics.energy import LINEAR_BAND, SHORTEST, SIGNIFICANT, energy_drift
from daebench.diagnostics.growth import growth_exponent
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
    """

    slope: float
    slope_error: float
    exponent: float
    exponent_error: float
    kind: str
    members: int


def random_walk(t: ArrayLike, error: ArrayLike, *, resolution: float = 0.0) -> Walk:
    """Return how the errors e_i(t) of the members i of an ensemble grow, of the energy or any other conserved quantity.

    Truncation is common to members that follow the same motion; what rounding does is their own. Unbiased rounding makes each error a
    random walk, with standard deviation ~ t^(1/2); biased rounding, as of an iteration that ends at a tolerance, makes it grow
    linearly, HLW VIII.5. So two things are looked at:

    - the mean over members of their slopes b_i, by least squares, with the standard error std(b_i) / sqrt(N) of independent members,
      but not less than the error that the oscillation of the mean leaves, see :func:`daebench.diagnostics.energy.energy_drift`;
    - the spread, the standard deviation s_w over members of their means over windows w of half an octave. The exponent alpha of
      s ~ t^alpha is the least-squares slope of log s_w against log t_w over the last eight octaves. Windows of one member are not
      independent, members are: the standard error is the jackknife's, leaving out one member at a time.

    The kind is decided by this rule, in this order:

    - "undetermined", all numbers NaN: fewer than 32 times, or an error that is not finite.
    - "linear" or "growing": the mean slope is beyond 4 of its standard errors; linear where the mean grows with an exponent within
      0.25 of 1, or within 2 of its standard errors.
    - "bounded": there is no spread beyond the resolution, or alpha + 2 standard errors is at most 1/4.
    - "random walk": alpha with 2 standard errors on both sides is between 1/4 and 3/4.
    - "growing": alpha - 2 standard errors is at least 3/4: every member drifts its own way.
    - "undetermined": anything else.

    Of 2000 synthetic walks of 16 members none is called bounded, linear or growing, and 2 % are undetermined.

    Parameters
    ----------
    t : array_like, shape(n,)
        Times, increasing and equally spaced.
    error : array_like, shape(N, n)
        Error of each member from its start, best as means over the time around t.
    resolution : float
        Round-off of one value of the error, such as eps |H|, where it is known; a spread below it counts as none.

    Raises
    ------
    BadInput
        If there are fewer than 16 members, or shapes do not fit.
    """
    t, error = np.asarray(t, dtype=float), np.asarray(error, dtype=float)
    if error.ndim != 2 or t.shape != error.shape[1:]:
        raise BadInput(f"an ensemble needs one error for each member and time; the shapes are {error.shape} and {t.shape}.")
    members = len(error)
    if members < MEMBERS:
        raise BadInput(f"a random walk is told from {MEMBERS} members or more, not from {members}.")
    nan = float("nan")
    if len(t) < SHORTEST or not np.all(np.isfinite(error)):
        return Walk(nan, nan, nan, nan, "undetermined", members)
    size = float(np.max(np.abs(error))) or 1.0
    slope, slope_error = _slope(t, error / size, resolution / size)
    exponent, exponent_error = _exponent(t, error / size, resolution / size)
    if abs(slope) > SIGNIFICANT * slope_error:
        kind = _drifting(t, np.mean(error, axis=0) / size, resolution / size)
    else:
        kind = _spreading(exponent, exponent_error)
    return Walk(size * slope, size * slope_error, exponent, exponent_error, kind, members)


def _slope(t: Array, error: Array, resolution: float) -> tuple[float, float]:
    """Return the mean of the members' slopes and its standard error."""
    s = t - np.mean(t)
    slopes = error @ s / float(s @ s)
    of_mean = energy_drift(t, np.mean(error, axis=0), resolution=resolution)
    own = float(np.std(slopes, ddof=1)) / np.sqrt(len(slopes))
    noise = max(resolution, 8 * float(np.finfo(float).eps)) / float(t[-1] - t[0])
    return float(np.mean(slopes)), max(own, of_mean.slope_error, noise / SIGNIFICANT)


def _drifting(t: Array, mean: Array, resolution: float) -> str:
    growth, growth_error = growth_exponent(t, mean, resolution=resolution)
    return "linear" if abs(growth - 1) <= max(LINEAR_BAND, CONFIDENCE * growth_error) else "growing"


def _spreading(exponent: float, exponent_error: float) -> str:
    """Return what the exponent of the spread says; NaN stands for no spread."""
    low, high = exponent - CONFIDENCE * exponent_error, exponent + CONFIDENCE * exponent_error
    if np.isnan(exponent) or high <= WALK[0]:
        return "bounded"
    if WALK[0] < low and high < WALK[1]:
        return "random walk"
    return "growing" if low >= WALK[1] else "undetermined"


def _exponent(t: Array, error: Array, resolution: float) -> tuple[float, float]:
    """Return the exponent of the spread and its jackknife error; NaN where too few windows have a spread."""
    centres, means = _means(t, error)
    seen = np.std(means, axis=1, ddof=1) > max(resolution, 8 * float(np.finfo(float).eps))
    first = int(np.argmax(seen)) if seen.any() else len(seen)
    if len(centres) - first < WINDOWS:
        return float("nan"), float("nan")
    x, values = np.log(centres[first:]), means[first:]
    N = values.shape[1]
    left = np.array([_log_slope(x, np.delete(values, i, axis=1)) for i in range(N)])
    error_of = float(np.sqrt((N - 1) / N * np.sum((left - np.mean(left)) ** 2)))
    return _log_slope(x, values), error_of


def _means(t: Array, error: Array) -> tuple[Array, Array]:
    """Return centres of the windows, and the members' means over them, shape(windows, N)."""
    edges = np.searchsorted(t, t[-1] * 2.0 ** (np.arange(-2 * OCTAVES, 1) / 2))
    edges[-1] = len(t)
    windows = [slice(a, b) for a, b in pairwise(edges) if b > a]
    return np.array([np.mean(t[each]) for each in windows]), np.array([np.mean(error[:, each], axis=1) for each in windows])


def _log_slope(x: Array, values: Array) -> float:
    """Return the least-squares slope of the logarithm of the standard deviation over members."""
    y = np.log(np.std(values, axis=1, ddof=1) + np.finfo(float).tiny)
    s = x - np.mean(x)
    return float(s @ y / (s @ s))
