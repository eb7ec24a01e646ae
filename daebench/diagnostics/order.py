"""The order of a method, fitted to the asymptotic part of a series of errors and to nothing else."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from daebench.errors import BadInput
from daebench.runs.trajectory import Array

BAND = 0.2
"""A local slope belongs to the asymptotic part if it is within this of the median of those at smaller h, and of the first."""

FEW_BAND = 0.1
"""Two local slopes, of three points, must agree within this to be an asymptotic part by themselves."""

FALLING = 0.5
"""An error falls where its local slope is at least this."""

SCATTER = 100.0
"""Errors on a round-off plateau are within this factor of the least one at smaller h."""

SLACK = 0.15
"""An order is met by a slope that falls short of it by at most so much and two standard errors."""

PLATEAU = 10.0
"""Errors up to this factor above a plateau are contaminated by it."""


@dataclass(frozen=True)
class OrderFit:
    """An observed order, and the classification of each point.

    Parameters
    ----------
    slope, slope_error : float
        Slope of log error against log h and its standard error; NaN if there are fewer than three points.
    used : tuple of bool
        For each point in the order given, whether it was used.
    reasons : tuple of str
        Why it was not: "failed", "round-off", "pre-asymptotic" or "too few"; empty if it was.
    note : str
        Why there is no slope, as a sentence; empty if there is one.
    """

    slope: float
    slope_error: float
    used: tuple[bool, ...]
    reasons: tuple[str, ...]
    note: str = ""


def fit_order(h: ArrayLike, error: ArrayLike, *, floor: float = 0.0) -> OrderFit:
    """Return the least-squares slope of log error against log h over the asymptotic part.

    Points are dropped by this rule, in this order:

    - "failed": the error is not finite.
    - "round-off": the error is at most ``floor``, or zero. Further, where the error stops falling towards smaller h (local
      slope below 0.5, or below half of the coarser one) and never falls by a factor 100 any more, a plateau begins, and everything up
      to 10 times its largest error is contaminated and goes; unless the points at the fine end agree on a slope over more than a
      factor 10 in the error.
    - "pre-asymptotic": from the two finest points left, coarser ones are added while each local slope is at least 0.5, within
      0.2 of the median of those before it, and within 0.2 of the first, for the slopes of a transition between two regimes creep;
      the first that is not ends the asymptotic part, whatever comes after.
    - "too few": what is left when that makes fewer than three points, or three whose two slopes differ by more than 0.1.

    The run begins at the *fine* end and is never restarted higher up, because a clean slope at large h may be of another regime:
    constrained symplectic Euler, of order 1, looks like order 2 down to h ~ 1/320 on the spherical pendulum. Three points of a
    plateau agree by chance now and then (one series in fifty): a ``floor`` prevents that.

    Parameters
    ----------
    h : array_like, shape(n,)
        Step sizes, positive and different, in any order.
    error : array_like, shape(n,)
        Norms of errors; not finite where a run failed.
    floor : float
        Error that cannot be trusted, such as the reference's own bound.

    Returns
    -------
    OrderFit

    Raises
    ------
    BadInput
        If the shapes differ, or a step size is not positive or appears twice.

    Examples
    --------
    >>> fit = fit_order([0.1, 0.05, 0.025, 0.0125], [4.1e-3, 1.01e-3, 2.51e-4, 6.26e-5])
    >>> round(fit.slope, 1)
    2.0
    """
    h, error = np.asarray(h, dtype=float), np.asarray(error, dtype=float)
    if h.ndim != 1 or h.shape != error.shape:
        raise BadInput(f"an order needs one error for each step size; the shapes are {error.shape} and {h.shape}.", "order-shapes-differ")
    if not np.all(np.isfinite(h) & (h > 0)) or len(np.unique(h)) < len(h):
        raise BadInput("an order needs step sizes that are positive and all different.", "order-step-sizes-repeated")
    reasons = np.full(len(h), "", dtype="<U14")
    reasons[~np.isfinite(error)] = "failed"
    reasons[np.isfinite(error) & (error <= max(floor, 0.0))] = "round-off"
    left = _finest_first(h, reasons)
    reasons[left[error[left] <= _plateau(h[left], error[left])]] = "round-off"
    left = _finest_first(h, reasons)
    length = _asymptotic(_slopes(h[left], error[left]))
    reasons[left[length:]] = "pre-asymptotic"
    if length < 3:
        reasons[left[:length]] = "too few"
        return _result(float("nan"), float("nan"), reasons, _why(reasons))
    return _result(*straight_line(np.log(h[left[:length]]), np.log(error[left[:length]])), reasons, "")


def _result(slope: float, slope_error: float, reasons: NDArray[np.str_], note: str) -> OrderFit:
    return OrderFit(slope, slope_error, tuple(bool(reason == "") for reason in reasons), tuple(map(str, reasons)), note)


def _why(reasons: NDArray[np.str_]) -> str:
    counts = ", ".join(f"{int(np.sum(reasons == reason))} {reason}" for reason in ("failed", "round-off", "pre-asymptotic"))
    return f"fewer than three of {len(reasons)} points are in the asymptotic part ({counts}); give more step sizes, or smaller ones."


def _finest_first(h: Array, reasons: NDArray[np.str_]) -> NDArray[np.intp]:
    order = np.argsort(h)
    return np.asarray(order[reasons[order] == ""], dtype=np.intp)


def _slopes(h: Array, error: Array) -> Array:
    return np.diff(np.log(error)) / np.diff(np.log(h))


def _plateau(h: Array, error: Array) -> float:
    """Return the error up to which points are contaminated by a plateau at the fine end; 0 if there is none."""
    slopes = _slopes(h, error)
    length = _asymptotic(slopes)
    # Points of a plateau rarely agree on a slope over a factor of ten: here the fine end still converges.
    if length >= 3 and error[length - 1] > PLATEAU * error[0]:
        return 0.0
    # An error also stops falling where its slope halves: a plateau is approached in a bend.
    coarser = np.append(slopes[1:], 0.0)[: len(slopes)]
    flat = np.flatnonzero((slopes < np.maximum(FALLING, coarser / 2)) & (error[1:] <= SCATTER * np.minimum.accumulate(error)[:-1]))
    return PLATEAU * float(np.max(error[: flat[-1] + 2])) if len(flat) else 0.0


def _asymptotic(slopes: Array) -> int:
    """Return the number of points, from the finest on, that agree on a slope."""
    k = 0
    # From the fine end, and without a second try: a clean slope at large h may be of another regime.
    while k < len(slopes) and slopes[k] >= FALLING and (k == 0 or _near(slopes[k], slopes[:k])):
        k += 1
    # Three points have one degree of freedom: their two slopes have to agree more closely.
    return 2 if k == 2 and abs(slopes[1] - slopes[0]) > FEW_BAND else k + 1


def _near(slope: float, finer: Array) -> bool:
    return bool(max(abs(slope - np.median(finer)), abs(slope - finer[0])) <= BAND)


def straight_line(x: Array, y: Array) -> tuple[float, float]:
    """Return the least-squares slope of y against x, shape(n,) each, and its standard error."""
    s = x - np.mean(x)
    slope = float(s @ y) / float(s @ s)
    residual = y - np.mean(y) - slope * s
    return slope, float(np.sqrt(residual @ residual / (len(x) - 2) / (s @ s)))
