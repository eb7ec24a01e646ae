"""The energy error of an ensemble: whether it is bounded, a random walk, or drifts."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from daebench.diagnostics.drift import NAN
from daebench.diagnostics.energy import SHORTEST, energy_drift, law_of, read_law
from daebench.diagnostics.ensemble_trend import ensemble_trend
from daebench.diagnostics.growth import Law
from daebench.diagnostics.spread import Spread, spread_exponent
from daebench.diagnostics.trend import Trend
from daebench.errors import BadInput
from daebench.runs.trajectory import Array

MEMBERS = 16
"""Smallest number of members with which a random walk can be identified."""

OCTAVES = 8
"""Number of last octaves of the time over which the spread is followed, if errors are given only at equally spaced times."""

WINDOW_OCTAVES = 14
"""The same if means over windows are given, which go back further: 4.2 decades."""

CONFIDENCE = 2.0
"""Half width of the interval of an exponent in standard errors: 95 % of a normal distribution; 94 of 100 intervals contained it."""

ROUNDED = 8 * float(np.finfo(float).eps)
"""Part of the largest error below which an error counts as zero."""

AT_ROUNDING = 4.0
"""Roundings of a state within which a spread is round-off if its growth cannot be determined; the same for an error."""

WALK = (0.25, 0.75)
"""Limits of the exponent of a random walk: halfway to those of a bounded error, 0, and of a linear drift, 1."""


@dataclass(frozen=True)
class Walk:
    """How the error of an ensemble grows.

    Parameters
    ----------
    verdict : str
        "kept", "bounded", "drifts", "random walk" or "undetermined".
    members : int
        Number of members.
    reason : str
        Why it is undetermined; else "".
    law : str
        Of what drifts: that of the mean, see :class:`daebench.diagnostics.drift.Drift`, or "apart" where every member drifts its own
        way; else "".
    change, change_bound : float
        Change of the mean over the time by the shape that fits best, and the upper bound on its modulus.
    level : float
        Mean at the end; for law "saturated" the limit.
    level_low, level_high : float
        Ends of the limit's interval of 95 %; NaN for other laws.
    slope, slope_error : float
        Mean over the members of their least-squares slopes, in the error's unit per unit of time, and its standard error.
    exponent, exponent_error : float
        Exponent alpha of the members' spread ~ t^alpha, and its standard error; NaN where there is no spread.
    decades : float
        Decades of time over which the exponent is read.
    spreads : bool
        Whether members spread beyond the resolution.
    """

    verdict: str
    members: int
    reason: str = ""
    law: str = ""
    change: float = NAN
    change_bound: float = NAN
    level: float = NAN
    level_low: float = NAN
    level_high: float = NAN
    slope: float = NAN
    slope_error: float = NAN
    exponent: float = NAN
    exponent_error: float = NAN
    decades: float = NAN
    spreads: bool = False

    @property
    def exponent_low(self) -> float:
        """Lower end of the exponent's interval of 95 %."""
        return self.exponent - CONFIDENCE * self.exponent_error

    @property
    def exponent_high(self) -> float:
        """Upper end of it."""
        return self.exponent + CONFIDENCE * self.exponent_error

    @property
    def brief(self) -> str:
        """The law of a drift, otherwise the verdict."""
        return self.law or self.verdict


def random_walk(
    t: ArrayLike, error: ArrayLike, *, resolution: float = 0.0, rounding: float = 0.0, windows: tuple[ArrayLike, ArrayLike] | None = None
) -> Walk:
    """Return the growth of the errors e_i(t) of the members i of an ensemble, of the energy or any other conserved quantity.

    Truncation is common to members that follow the same motion; round-off differs between members. Unbiased rounding makes each error a
    random walk, with standard deviation ~ t^(1/2); biased rounding, as of an iteration that ends at a tolerance, makes it grow
    linearly, HLW VIII.5. Two quantities are therefore examined:

    - the mean over members, by the rule of :func:`daebench.diagnostics.energy.energy_drift`. Its change is a drift where the changes of the
      members, fitted with the same shape, have a mean beyond 4.5 of its standard errors; the scatter of its window means has to be beaten
      besides, unless independent members explain it;
    - the spread, the standard deviation s_w over members of their means over windows w of half an octave, or over those given. The
      exponent alpha of s ~ t^alpha is fitted over the last eight octaves, of windows that are given over the last fourteen, with a
      jackknife's standard error, see :func:`daebench.diagnostics.spread.spread_exponent`.

    The verdict is decided by this rule, in this order:

    - "undetermined", all numbers NaN: fewer than 64 times, or an error that is not finite.
    - "kept": no error is beyond the resolution.
    - "drifts": the mean drifts, or its oscillation grows fourfold by more than independent members explain.
    - "undetermined": the spread follows no single power of t over the last eight octaves.
    - "random walk": alpha with 2 standard errors on both sides is between 1/4 and 3/4.
    - "drifts", law "apart": alpha - 2 standard errors is at least 3/4.
    - "bounded": members do not spread beyond the resolution, or alpha + 2 standard errors is at most 1/4, or alpha says neither this nor
      any of the above of a spread that is within four roundings of a state at all times; and the bound on the change of the mean is
      less than the range of the mean, or than that of the members about it.
    - "kept": none of these is decided, and no error is beyond four roundings of a state.
    - "undetermined": anything else, with the reason.

    A drift of each member's own, of normal distribution, beside a random walk passes as one while it is small. Where it adds a third to
    the spread at the end of 2^16 steps, 100, 97 and 38 of 100 synthetic ensembles of 64, 256 and 1024 members came out as random walks,
    nine in ten with alpha from 0.50 to 0.55, 0.51 to 0.55 and 0.52 to 0.54, and the others as undetermined. Where it doubles the spread
    these were 88, 7 and 0.

    Parameters
    ----------
    t : array_like, shape(n,)
        Times, increasing and equally spaced.
    error : array_like, shape(N, n)
        Error of each member from its start, best as means over the time around t.
    resolution : float
        Round-off of one value of the error, such as eps |H|, where it is known, or what starts that differ make of truncation where that
        is more; a spread below it counts as none.
    rounding : float
        Change of the quantity by the rounding of a state, if it is known, see :func:`daebench.diagnostics.integrals.energy_rounding`.
    windows : (array_like, array_like), shape(w,) and shape(N, w), optional
        Centres of windows that are equally long in log t, and the mean of each member over each: the spread is followed over these.

    Raises
    ------
    BadInput
        If there are fewer than 16 members, shapes do not fit, or two members are the same run: their errors are equal, and not all
        of them are zero or within the resolution.
    """
    t, error = np.asarray(t, dtype=float), np.asarray(error, dtype=float)
    if error.ndim != 2 or t.shape != error.shape[1:]:
        raise BadInput(
            f"an ensemble needs one error for each member and time; the shapes are {error.shape} and {t.shape}.", "ensemble-shapes-differ"
        )
    members = len(error)
    if members < MEMBERS:
        raise BadInput(f"a random walk can be identified from {MEMBERS} members or more, not from {members}.", "too-few-walks")
    if len(t) < 2 * SHORTEST or not np.all(np.isfinite(error)):
        return Walk("undetermined", members, f"too short: {len(t)} samples" if len(t) < 2 * SHORTEST else "an error is not finite")
    _require_distinct(error, resolution)
    size = float(np.max(np.abs(error))) or 1.0
    spread_windows = _means(t, error) if windows is None else _given(windows)
    octaves = OCTAVES if windows is None else WINDOW_OCTAVES
    # All sizes are relative to the largest error, so that no square underflows.
    spread = spread_exponent(spread_windows[0], spread_windows[1] / size, max(resolution / size, ROUNDED), octaves)
    # Few roundings take values on a coarse grid: their spread has no exponent that could be read.
    if _undecided(spread) and np.max(np.std(spread_windows[1], axis=1, ddof=1)) <= AT_ROUNDING * rounding:
        spread = Spread(seen=False)
    walk = _judged(t, error / size, max(resolution / size, ROUNDED), spread)
    if walk.verdict == "undetermined" and size <= AT_ROUNDING * rounding:
        walk = replace(walk, verdict="kept", reason="")
    scaled = ("change", "change_bound", "level", "level_low", "level_high", "slope", "slope_error")
    return replace(walk, **{name: size * getattr(walk, name) for name in scaled})


def _judged(t: Array, error: Array, noise: float, spread: Spread) -> Walk:
    """Return the verdict on errors of modulus at most 1."""
    of_mean = ensemble_trend(t, error, noise)
    slopes = _slopes(t, error)
    # Members that follow the same motion have equal slopes; the oscillation that they share is then the error.
    slope_error = max(float(np.std(slopes, ddof=1)) / np.sqrt(len(slopes)), energy_drift(t, np.mean(error, axis=0)).slope_error)
    verdict, reason, law = _verdict(of_mean, error, spread, noise)
    last = float(np.mean(error[:, -(len(t) // 8) :]))
    walk = Walk(
        verdict,
        len(error),
        reason,
        law,
        change=of_mean.secular.change,
        change_bound=of_mean.bound,
        level=last,
        slope=float(np.mean(slopes)),
        slope_error=slope_error,
        exponent=spread.exponent,
        exponent_error=spread.exponent_error,
        decades=spread.decades,
        spreads=spread.seen,
    )
    return _with_limit(walk, t, np.mean(error, axis=0), of_mean, noise)


def _with_limit(walk: Walk, t: Array, mean: Array, of_mean: Trend, noise: float) -> Walk:
    """Return a verdict whose mean saturates with the limit in the place of the mean at the end; another law may fit as well."""
    shape = read_law(t, mean, of_mean, noise) if walk.law == "saturated" else ""
    if not isinstance(shape, Law):
        return walk
    if shape.name != "saturated":
        return replace(walk, law=shape.name)
    return replace(walk, level=shape.limit, level_low=shape.limit_low, level_high=shape.limit_high)


def _verdict(of_mean: Trend, error: Array, spread: Spread, noise: float) -> tuple[str, str, str]:
    """Return verdict, reason and law."""
    if np.max(np.abs(error)) <= noise:
        return "kept", "", ""
    if of_mean.drifts:
        return "drifts", "", law_of(of_mean)
    verdict = _spreading(spread)
    if _bent(spread):
        return "undetermined", "the spread follows no single power of t", ""
    if verdict == "growing":
        return "drifts", "", "apart"
    if verdict == "bounded" and of_mean.reason:
        return "undetermined", of_mean.reason, ""
    return verdict, "" if verdict != "undetermined" else "the exponent of the spread is not known well enough", ""


def _require_distinct(error: Array, resolution: float) -> None:
    """Refuse members that are one run several times; where there is no error at all, distinct runs have the same."""
    same = len(error) - len(np.unique(error, axis=0))
    if same and np.max(np.abs(error)) > resolution:
        raise BadInput(
            f"{same} of {len(error)} members have the errors of another one to the last bit; give runs that differ.",
            "members-with-equal-errors",
        )


def _slopes(t: Array, error: Array) -> Array:
    """Return the least-squares slope of each member, shape(N,)."""
    s = t - np.mean(t)
    return np.asarray(error @ s / float(s @ s))


def _undecided(spread: Spread) -> bool:
    """Return whether a spread says nothing of its growth."""
    return _bent(spread) or _spreading(spread) == "undetermined"


def _bent(spread: Spread) -> bool:
    return spread.bent and _spreading(spread) in ("growing", "random walk")


def _spreading(spread: Spread) -> str:
    """Return the verdict by the exponent of a spread; NaN is an unknown exponent."""
    low, high = (spread.exponent + side * CONFIDENCE * spread.exponent_error for side in (-1, 1))
    if not spread.seen or high <= WALK[0]:
        return "bounded"
    if WALK[0] < low and high < WALK[1]:
        return "random walk"
    return "growing" if low >= WALK[1] else "undetermined"


def _given(windows: tuple[ArrayLike, ArrayLike]) -> tuple[Array, Array]:
    """Return centres of windows that are given, and the members' means over them, shape(windows, N)."""
    return np.asarray(windows[0], dtype=float), np.asarray(windows[1], dtype=float).T


def _means(t: Array, error: Array) -> tuple[Array, Array]:
    """Return centres of the windows, and the members' means over them, shape(windows, N)."""
    edges = np.searchsorted(t, t[-1] * 2.0 ** (np.arange(-2 * OCTAVES, 1) / 2))
    # The end itself belongs to the last window.
    edges[-1] = len(t)
    windows = [slice(a, b) for a, b in pairwise(edges) if b > a]
    return np.array([np.mean(t[window]) for window in windows]), np.array([np.mean(error[:, window], axis=1) for window in windows])
