"""Energy drift: the secular part of the error of a conserved quantity, seen under an oscillation that may be far larger."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from daebench.diagnostics.growth import growth_exponent
from daebench.errors import BadInput

Array = NDArray[np.float64]

SHORTEST = 32
"""Fewest samples from which a drift is read."""

SIGNIFICANT = 4.0
"""A slope beyond so many of its standard errors is a drift."""

LINEAR_BAND = 0.25
"""Growth is linear where the exponent is known and equal to one within this."""

SPREADING = 4.0
"""An error spreads where its scatter grows by this factor from the first quarter of the run to the last."""


@dataclass(frozen=True)
class Drift:
    """The secular part of an error.

    Parameters
    ----------
    slope, slope_error : float
        Least-squares slope over the whole run, in the error's unit per unit of time, and its standard error.
    growth, growth_error : float
        Exponent alpha of the secular part ~ t^alpha and its standard error; NaN where there is no secular part.
    kind : str
        "bounded", "linear", "growing" or "undetermined".
    """

    slope: float
    slope_error: float
    growth: float
    growth_error: float
    kind: str


def energy_drift(t: ArrayLike, error: ArrayLike, *, resolution: float = 0.0) -> Drift:
    """Return the drift of an error e(t), of the energy or any other conserved quantity.

    The slope is that of the least-squares line over all samples. Its standard error does not take the residuals r for
    independent, for they oscillate: it is read off their running sum, which stays small for an oscillation and wanders for noise::

        R_j = r_1 + ... + r_j        slope_error = std(R) (t_n - t_1) / sum (t_j - mean t)^2

    For white noise that is the textbook's value up to a tenth; for an oscillation of amplitude A and frequency w over a time T
    it is 8.5 A / (w T^2), which the slope of a pure oscillation does not exceed by more than half: no choice of blocks that could
    resonate. The growth exponent is :func:`daebench.diagnostics.growth.growth_exponent`.

    The kind is decided by this rule, in this order:

    - "undetermined", all numbers NaN: fewer than 32 samples, or one that is not finite. A failed run is a row, not an exception.
    - "bounded": the slope is within 4 standard errors, or the drift over the run is within ``resolution`` or within 8 units of
      round-off of the largest error; and the scatter about the line does not grow fourfold from the first quarter of the run
      to the last. There is then no secular part, so growth is NaN.
    - "linear": growth is within 0.25 of 1, and its standard error is at most 0.25.
    - "growing": anything else. Growth is NaN if no power law between t^0.1 and t^6 fits, or if only the scatter grows.

    One run cannot tell a random walk: a walk appears as "bounded" (two in three), "growing" or even "linear", with the exponent of
    its own path; that takes an ensemble. Give at least several periods of the motion, for which the caller answers.

    Parameters
    ----------
    t : array_like, shape(n,)
        Times, increasing and about equally spaced.
    error : array_like, shape(n,)
        Error from the start, H(x(t)) - H(x0).
    resolution : float
        Round-off of one value of the error, such as eps |H|, where it is known.

    Returns
    -------
    Drift

    Raises
    ------
    BadInput
        If t and error differ in shape or t does not increase.
    """
    t, error = np.asarray(t, dtype=float), np.asarray(error, dtype=float)
    if t.ndim != 1 or t.shape != error.shape:
        raise BadInput(f"a drift needs one error for each time; the shapes are {error.shape} and {t.shape}.")
    if len(t) < SHORTEST or not np.all(np.isfinite(t)) or not np.all(np.isfinite(error)):
        nan = float("nan")
        return Drift(nan, nan, nan, nan, "undetermined")
    if np.any(np.diff(t) <= 0):
        raise BadInput("a drift needs increasing times; these do not increase.")
    size = float(np.max(np.abs(error))) or 1.0  # so that no square overflows
    slope, slope_error, residual = _line(t, error / size)
    noise = max(resolution / size, 8 * float(np.finfo(float).eps) * float(np.max(np.abs(error / size))))
    if abs(slope) <= SIGNIFICANT * slope_error or abs(slope) * (t[-1] - t[0]) <= noise:
        kind = "growing" if _spreads(residual, noise) else "bounded"
        return Drift(size * slope, size * slope_error, float("nan"), float("nan"), kind)
    growth, growth_error = growth_exponent(t, error / size, resolution=resolution / size)
    linear = abs(growth - 1) <= LINEAR_BAND and growth_error <= LINEAR_BAND
    return Drift(size * slope, size * slope_error, growth, growth_error, "linear" if linear else "growing")


def _line(t: Array, error: Array) -> tuple[float, float, Array]:
    """Return the least-squares slope, its standard error from the residuals' running sum, and the residuals."""
    s = t - np.mean(t)
    squares = float(s @ s)
    slope = float(s @ (error - np.mean(error))) / squares
    residual = error - np.mean(error) - slope * s
    return slope, float(np.std(np.cumsum(residual))) * float(t[-1] - t[0]) / squares, residual


def _spreads(residual: Array, noise: float) -> bool:
    quarter = len(residual) // 4
    first, last = (float(np.sqrt(np.mean(part**2))) for part in (residual[:quarter], residual[-quarter:]))
    return last > noise and last > SPREADING * first
