"""Energy drift: the secular part of the error of a conserved quantity, under an oscillation that may be far larger."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from daebench.diagnostics.drift import BOUNDED, DRIFTS, FAILED, KEPT, UNDETERMINED, Drift
from daebench.diagnostics.growth import Law
from daebench.diagnostics.growth import law as law_in
from daebench.diagnostics.trend import RED, Trend, trends
from daebench.errors import BadInput
from daebench.runs.trajectory import Array

SHORTEST = 32
"""Smallest number of samples for a drift."""

LINEAR_BAND = 0.25
"""Growth is linear if the whole interval of its exponent is this near to one."""

MISFIT = 0.05
"""A change has no law if the window means deviate from the shape by more than this part of it, with equal signs of neighbours."""

ROUNDED = 10.0
"""An error within this number of roundings, times the square root of the number of steps, counts as kept."""

SAMPLES_AT_ONCE, FEWEST_AT_ONCE = 2**17, 64
"""Errors are judged in batches of about this many samples, which stay in the processor's cache, and of at least this many errors."""


def energy_drift(
    t: ArrayLike, error: ArrayLike, *, resolution: float = 0.0, scale: float = 0.0, steps: int = 0, eps: float = 2.0**-52, failure: str = ""
) -> Drift:
    """Return the drift of an error e(t), of the energy or any other conserved quantity, and the verdict on it.

    The mean of the error is taken over windows that hold two or more of its oscillations each, with a taper that lets through three
    parts in a hundred of the oscillation at most (:mod:`daebench.diagnostics.window_means`). Of the monotone shapes t^a, exp(k t),
    1 - exp(-k t) and steps the one that fits the means best is taken for the secular part
    (:mod:`daebench.diagnostics.secular`). The verdict is decided by this rule, in this order:

    - "failed": there is a ``failure``, or a value is not finite.
    - "kept": no error is larger than 10 eps sqrt(N) S with N steps and the scale S, or than ``resolution``.
    - "undetermined": fewer than 32 samples.
    - "drifts": the secular part changes from the first window to the last by more than 4.5 standard deviations of the means about it,
      8 of fewer than 15 windows, 7 where the deviations are a slow oscillation, 20 where they are a random walk, and 15 where there
      are too few oscillations for windows; or the first value is far outside of the range of all that are later than an eighth of the
      time, or the last one likewise; or the oscillation grows fourfold, law "growing scatter". A change that may be the alias of an
      oscillation is "undetermined". A change that rounding explains, as it would an error that is "kept", is no drift.
    - "bounded": there are at least five oscillations, the window means are within half of the range of the error, or within a tenth of
      it where they go one way by Kendall's correlation with time, and the bound on the change of the mean is less than that range. The
      bound is the range of the window means, carried on to both ends of the time, and a quarter more: it does not rest on the absence of
      a significant drift.
    - "undetermined": anything else, with the reason: too short, fewer than five oscillations, aliased output, or a single random walk,
      which takes an ensemble, see :func:`daebench.diagnostics.random_walk.random_walk`.

    Parameters
    ----------
    t : array_like, shape(n,)
        Times, increasing and about equally spaced.
    error : array_like, shape(n,)
        Error from the start, H(x(t)) - H(x0).
    resolution : float
        Round-off of one value of the error, such as eps |H|, where it is known.
    scale : float
        Size of the numbers whose rounding makes the error, max(|T|, |U|) of the energy.
    steps : int
        Number N of steps.
    eps : float
        Machine epsilon of the number type of the run.
    failure : str
        Why the run stopped, if it did.

    Returns
    -------
    Drift

    Raises
    ------
    BadInput
        If t and error differ in shape or t does not increase.

    Examples
    --------
    >>> import numpy as np
    >>> t = np.linspace(0, 100, 2001)
    >>> energy_drift(t, 1e-3 * np.sin(7 * t)).verdict
    'bounded'
    >>> energy_drift(t, 1e-3 * np.sin(7 * t) + 1e-4 * t).verdict
    'drifts'
    """
    t, error = np.asarray(t, dtype=float), np.asarray(error, dtype=float)
    if t.ndim != 1 or t.shape != error.shape:
        raise BadInput(f"a drift needs one error for each time; the shapes are {error.shape} and {t.shape}.", "drift-shapes-differ")
    if failure:
        return Drift(FAILED, failure)
    judged = _Judged.of(t, error[None], np.array([resolution]), np.array([scale]), steps, eps)
    verdict = str(judged.verdicts[0])
    if verdict == FAILED:
        return Drift(FAILED, "a value is not finite")
    if judged.trends is None:
        reason = f"too short: {len(t)} samples, and a drift is read from {SHORTEST}"
        return Drift(KEPT, change_bound=2 * float(judged.largest[0])) if verdict == KEPT else Drift(UNDETERMINED, reason)
    return _drift(t, error, verdict, judged.trends.one(0), float(judged.sizes[0]), resolution)


def energy_verdicts(t: Array, errors: Array, *, resolution: Array, scale: Array, steps: int, eps: float = 2.0**-52) -> NDArray[np.str_]:
    """Return the verdict on each of m errors at the same times, as :func:`energy_drift` gives it for one, shape(m,).

    Parameters
    ----------
    t : ndarray, shape(n,)
        Times, increasing and about equally spaced.
    errors : ndarray, shape(m, n)
        Errors from the start, one per row.
    resolution, scale : ndarray, shape(m,)
        Round-off of one value, and size of the numbers whose rounding makes the error.
    steps : int
        Number of steps.
    eps : float
        Machine epsilon of the number type of the runs.

    Returns
    -------
    ndarray of str, shape(m,)
        Words of :data:`daebench.diagnostics.drift.VERDICTS`.

    Raises
    ------
    BadInput
        If t does not increase.
    """
    at_once = max(FEWEST_AT_ONCE, SAMPLES_AT_ONCE // len(t))
    parts = [slice(k, k + at_once) for k in range(0, len(errors), at_once)]
    return np.concatenate([_Judged.of(t, errors[part], resolution[part], scale[part], steps, eps).verdicts for part in parts])


@dataclass(frozen=True)
class _Judged:
    """The verdicts on m errors and their data: each error is divided by its largest modulus, so that no square overflows."""

    verdicts: NDArray[np.str_]
    largest: Array
    trends: Trend | None

    @property
    def sizes(self) -> Array:
        return np.where(self.largest > 0, self.largest, 1.0)

    @classmethod
    def of(cls, t: Array, errors: Array, resolution: Array, scale: Array, steps: int, eps: float) -> Self:
        finite = np.asarray(np.isfinite(errors).all(axis=1) & np.all(np.isfinite(t)))
        if np.all(np.isfinite(t)) and np.any(np.diff(t) <= 0):
            raise BadInput("a drift needs increasing times; these do not increase.", "drift-times-not-increasing")
        # Zeros in place of errors that are not finite: their verdict is FAILED already, and the others are judged as if alone.
        errors = errors if finite.all() else np.where(finite[:, None], errors, 0.0)
        largest = np.max(np.abs(errors), axis=1, initial=0.0)
        rounding = np.maximum(resolution, ROUNDED * eps * steps**0.5 * scale)
        verdicts = np.select([~finite, largest <= rounding], [FAILED, KEPT], UNDETERMINED)
        if len(t) < SHORTEST or not finite.any():
            return cls(verdicts, largest, None)
        sizes = np.where(largest > 0, largest, 1.0)
        # Divided by its largest modulus, each error is of order one: squares neither overflow nor underflow.
        mean = trends(t, errors / sizes[:, None], np.maximum(rounding / sizes, 8 * float(np.finfo(float).eps)))
        decided = np.where(mean.drifts, DRIFTS, np.where(mean.reason == "", BOUNDED, UNDETERMINED))
        return cls(np.where(verdicts == UNDETERMINED, decided, verdicts), largest, mean)


def _drift(t: Array, error: Array, verdict: str, mean_trend: Trend, size: float, resolution: float) -> Drift:
    """Return the verdict on an error of the given size with its numbers."""
    error, resolution = error / size, resolution / size
    slope, slope_error = _line(t, error)
    drift = Drift(
        verdict,
        reason=mean_trend.reason if verdict == UNDETERMINED else "",
        change=size * mean_trend.secular.change,
        change_bound=size * mean_trend.bound,
        level=size * float(np.mean(error[-max(1, len(error) // 8) :])),
        slope=size * slope,
        slope_error=size * slope_error,
    )
    if verdict != DRIFTS:
        return drift
    shape = read_law(t, error, mean_trend, resolution)
    return _with_law(drift, shape, size) if isinstance(shape, Law) else replace(drift, law=shape)


def read_law(t: Array, error: Array, mean_trend: Trend, resolution: float) -> Law | str:
    """Return the law of a drift with its interval, or a word if the scatter grows or the drift is irregular."""
    word = law_of(mean_trend)
    if word in ("growing scatter", "irregular"):
        return word
    fast = mean_trend.fast and word == "saturated"
    # The fast change is in the range of the whole error and no part of the oscillation; the later half has the oscillation alone.
    leak = mean_trend.leak * (float(np.ptp(error[len(error) // 2 :]) / np.ptp(error)) if fast else 1.0)
    return law_in(t, error, windows=mean_trend.windows, leak=leak, resolution=resolution, fast=fast)


def _with_law(drift: Drift, shape: Law, size: float) -> Drift:
    """Return a drift with its law, and the interval of the law's number."""
    low, high = shape.exponent_low, shape.exponent_high
    linear = shape.name == "power" and low >= 1 - LINEAR_BAND and high <= 1 + LINEAR_BAND
    drift = replace(drift, law="linear" if linear else shape.name, exponent=shape.exponent, exponent_low=low, exponent_high=high)
    drift = replace(drift, exponent_error=(high - low) / 4)
    if shape.name != "saturated":
        return drift
    return replace(drift, level=size * shape.limit, level_low=size * shape.limit_low, level_high=size * shape.limit_high)


def law_of(mean_trend: Trend) -> str:
    """Return the law of a drift as a word, by the shape that fits best."""
    best = mean_trend.secular
    if mean_trend.spreads:
        return "growing scatter"
    if best.scatter > MISFIT * best.seen and best.neighbours > RED:
        return "irregular"
    return "linear" if best.law == "power" and abs(best.number - 1) <= LINEAR_BAND else str(best.law)


def _line(t: Array, error: Array) -> tuple[float, float]:
    """Return the least-squares slope and its standard error about a straight line, from the running sum of the residuals.

    ::

        R_j = r_1 + ... + r_j        slope_error = std(R) (t_n - t_1) / sum (t_j - mean t)^2

    For white noise that is the textbook's value up to a tenth; for an oscillation of amplitude A and frequency w over a time T it is
    8.5 A / (w T^2), which the slope of a pure oscillation does not exceed by more than half.
    """
    s = t - np.mean(t)
    squares = float(s @ s)
    slope = float(s @ (error - np.mean(error))) / squares
    residual = error - np.mean(error) - slope * s
    return slope, float(np.std(np.cumsum(residual))) * float(t[-1] - t[0]) / squares
