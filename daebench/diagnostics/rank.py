"""Where the rank of G is lost along a motion, and whether a mass, or too large a step, makes it seem so."""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.diagnostics.metric import least_displacement
from daebench.diagnostics.unit_rows import beyond_comparison, rank_of
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.members import Members
from daebench.systems.lazily import scipy

WITHIN = 3
"""Number of steps after the start in which a loss of rank is predicted before there are steps to extrapolate from."""

AFTER_FAILURE = 5
"""Number of steps in which it is predicted after a step that failed."""

SUSPECT = 1e-6
"""Measured root below which constraints are compared with each other; for dependent ones it is at most about 1e-8."""

BELIEVED = 1 / 3
"""Largest measured root at a predicted zero, relative to the present one, with which the prediction is believed."""

PIECES, FINER = 32, 16
"""Number of pieces of the path that is searched for a loss of rank, and of the two pieces around the smallest singular value."""

SUNK = 0.5
"""Singular value of G, relative to its largest along the path, below which the path is examined more closely."""

GONE = 1e-3
"""Relative value below which, after a closer look, it is zero."""

CLOSE = 1e-10
"""Distance from the manifold, relative to a piece of the path, that counts as zero."""

SWEEPS = 12
"""Largest number of iterations that bring a point of the path onto the manifold."""

LIGHT = 1e-2
"""Part of the largest mass below which a mass is light."""

HEAVIER = "use a smaller h, which resolves the light mass, or leave that mass out; --on-singular continue ignores this"
"""Advice if a run stops because a mass is too light for the step."""

TOO_LARGE = "the step is too large: G keeps its rank, but turns so far within a step that its equations become singular"
"""Reason for singular equations of a step if G keeps its rank."""

SMALLER = "use a smaller h"
"""Advice in that case."""

GO_ON = "to go on, add --on-singular continue (on_singular), which says which branch the motion takes"
"""Advice if a run stops because G loses rank."""


def upcoming_loss(ivp: ConstrainedIvp, p: Array, q: Array, h: float, within: int) -> float | None:
    """Return the time until G loses rank, by one state and its velocity, if it is within this number of steps of size h; else None.

    The roots of what ``independence`` in ``daebench/schemes/kernels/rank.py`` measures at q, q - h v and q - 2 h v are extrapolated, and
    the predicted zero is believed if the measured root there is at most a third of that at q.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem with its numbers.
    p, q : ndarray, shape(d,)
        The state.
    h : float
        Step size, s.
    within : int
        Number of steps.

    Returns
    -------
    float or None
        Time from this state to the loss, s.
    """
    if beyond_comparison(ivp):
        return None
    v = ivp.value("H_p", p, q)
    t = float(_zero_ahead(lambda t: np.sqrt(np.abs(ivp.value("independence", p, q + t * v))), h, within))
    return None if math.isnan(t) else t


def loses_rank(ivp: ConstrainedIvp, p: Array, q: Array, before: float, after: float) -> bool:
    """Return whether G loses rank along the way of a state on the manifold, whatever the step that goes there.

    The way is that of a motion with the velocity of the state and without forces, taken in small pieces on g = 0. Along it the smallest
    singular value of G is followed, rows and columns in parts of their lengths at q, so that neither units nor masses matter. The rank is
    lost where it goes to zero as the pieces around its minimum are made smaller.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem with its numbers.
    p, q : ndarray, shape(d,)
        The state.
    before, after : float
        Times before and after the state that the way reaches, s.

    Returns
    -------
    bool
        True also if vectors are arrays, or if there are too many constraints for the examination.
    """
    if beyond_comparison(ivp):
        return True
    with np.errstate(all="ignore"):
        v, W = ivp.value("H_p", p, q), ivp.value("H_pp", p, q)
        sigma = _independence_of_rows(ivp, q)
        dt = (before + after) / PIECES
        back = [x for x, _ in zip(_way(ivp, W, q, -dt * v), range(math.ceil(before / dt)), strict=False)]
        ahead = [x for x, _ in zip(_way(ivp, W, q, dt * v), range(math.ceil(after / dt)), strict=False)]
        way = [*back[::-1], q, *ahead]
        values = np.array([sigma(x) for x in way])
        k = int(np.argmin(values))
        largest = float(np.max(values))
        # The minimum is at an end, or hardly below the rest: a closer look would only find the same value.
        if not 0 < k < len(way) - 1 or values[k] > SUNK * largest:
            return bool(values[k] <= GONE * largest)
        closer = _way(ivp, W, way[k - 1], (way[k] - way[k - 1]) / (FINER / 2))
        finer = [way[k - 1], *(x for x, _ in zip(closer, range(FINER + FINER // 2), strict=False))]
        return _least_between(sigma, finer) <= GONE * largest


def _independence_of_rows(ivp: ConstrainedIvp, q: Array) -> Callable[[Array], float]:
    """Return a function of positions: the smallest singular value of G that is not zero at q, its rows and columns scaled as there."""
    # Scaled once, at q: scaled anew everywhere, a row that goes to zero would be given length one and hide the loss.
    G = np.asarray(ivp.value("G", q), dtype=float)[:, : ivp.moving]
    rows = _lengths(G, 1)[:, None]
    columns = _lengths(G / rows, 0)
    rank = rank_of(G / rows / columns)

    def sigma(x: Array) -> float:
        scaled = np.asarray(ivp.value("G", x), dtype=float)[:, : len(columns)] / rows / columns
        return float(np.linalg.svd(scaled, compute_uv=False)[rank - 1]) if np.all(np.isfinite(scaled)) else math.inf

    return sigma


def _lengths(G: Array, axis: int) -> Array:
    """Return the lengths of rows or columns; 1 of those that are zero."""
    lengths = np.linalg.norm(G, axis=axis)
    return np.asarray(np.where(lengths > 0, lengths, 1.0))


def _way(ivp: ConstrainedIvp, W: Array, q: Array, dq: Array) -> Iterator[Array]:
    """Yield positions on g = 0 without end, each as far from the last as that is from the one before: motion without forces, by SHAKE."""
    while True:
        x = q + dq
        size = float(np.max(np.abs(dq)))
        for _ in range(SWEEPS):
            C, residual = np.asarray(ivp.value("G", x), dtype=float), np.asarray(ivp.value("g", x), dtype=float)
            step = least_displacement(C[None], W[None], -residual[None])[0]
            # A correction longer than the piece itself would leave the way; the point stays as it is.
            if not np.all(np.isfinite(step)) or float(np.max(np.abs(step))) > size:
                break
            x = x + step
            if float(np.max(np.abs(step))) <= CLOSE * size:
                break
        # The chord of the last piece is the next free flight, as in SHAKE: this keeps the direction of the motion.
        q, dq = x, x - q
        yield q


def _least_between(sigma: Callable[[Array], float], way: Sequence[Array]) -> float:
    """Return the least value of a function along a parabola through three points, in the middle that where it is least."""
    values = [sigma(x) for x in way]
    k = min(max(1, int(np.argmin(values))), len(way) - 2)
    a, b, c = way[k - 1 : k + 2]
    minimum = scipy.optimize.minimize_scalar(
        lambda u: sigma(b + u * ((c - a) + u * (a - 2 * b + c)) / 2), bounds=(-1.0, 1.0), method="bounded", options={"xatol": 1e-7}
    )
    return min(float(minimum.fun), *values)


def upcoming_losses(members: Members, p: Array, q: Array, within: int) -> Array:
    """Return the time of :func:`upcoming_loss` for each member of an ensemble, shape(n,), equal to the bit; NaN if there is none.

    Parameters
    ----------
    members : Members
        The members.
    p, q : ndarray, shape(n, d)
        A state of each.
    within : int
        Number of steps.
    """
    if beyond_comparison(members.ivp):  # type: ignore[arg-type]
        return np.full(len(members), np.nan)
    with np.errstate(all="ignore"):
        v, h = members.along("H_p", p, q), np.broadcast_to(members.h, len(members))
        return _zero_ahead(lambda t: np.sqrt(np.abs(members.along("independence", p, q + t[:, None] * v))), h, within)


def _zero_ahead(sigma: Callable[[Any], Any], h: Any, within: int) -> Array:
    """Return the zero of the line through sigma(-h) and sigma(0), if sigma falls over two steps and is small at it; else NaN."""
    s = [sigma(k * h) for k in (-2, -1, 0)]
    with np.errstate(all="ignore"):
        # Over both steps: one pair of values may fall by a single rough step.
        falls = (s[0] > s[1]) & (s[1] > s[2]) & (s[2] <= within * (s[1] - s[2]))
        t = np.where(falls, h * s[2] / (s[1] - s[2]), np.nan)
    # A line may predict a zero where there is none: the prediction is believed only if the quantity is small there.
    return np.where(sigma(t) <= BELIEVED * s[2], t, np.nan) if np.any(falls) else t


def may_lose_rank(members: Members) -> NDArray[np.bool_]:
    """Return at which members of an ensemble ``dependence`` may find something, or :func:`upcoming_loss` within :data:`WITHIN` steps.

    Nothing is missed; of others there are a few at most.

    Parameters
    ----------
    members : Members
        Members whose starts are examined.

    Returns
    -------
    ndarray of bool, shape(n,)
    """
    if members.ivp.on_manifold and beyond_comparison(members.ivp):
        return np.zeros(len(members), dtype=bool)
    p, q = members.start
    with np.errstate(all="ignore"):
        one_step = np.reshape(members.h, (-1, 1)) * members.along("H_p", p, q)
        here, before = (np.sqrt(np.abs(members.along("independence", p, x))) for x in (q, q - one_step))
        # "not >", so that NaN is a suspect.
        suspect = ~(here > SUSPECT * np.maximum(before, 1.0))
    return np.asarray(suspect | ~np.isnan(upcoming_losses(members, p, q, WITHIN)))


def badly_scaled(ivp: ConstrainedIvp, p: Array, q: Array, t: float) -> str:
    """Return which coordinate is too light for the step where G keeps its rank in a time t, as part of a sentence; "" where G loses it.

    G M^-1 G^T is nearly singular where G is, and also where the masses are of very different size: rows of G that are independent are
    then nearly parallel in the metric M^-1. The smallest singular value of G itself, its rows over their lengths at q, decides.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem with its numbers.
    p, q : ndarray, shape(d,)
        A state before.
    t : float
        Time from there to the place in question, s.
    """
    if beyond_comparison(ivp):
        return ""
    G, there = ivp.value("G", q), ivp.value("G", q + t * ivp.value("H_p", p, q))
    lengths = np.linalg.norm(G, axis=1)[:, None]
    if not (np.all(np.isfinite(there)) and np.all(lengths > 0)):
        return ""
    now, then = (float(np.linalg.svd(rows / lengths, compute_uv=False)[-1]) for rows in (G, there))
    # 1 / (M^-1)_ii is the mass that a force on q_i alone has to accelerate.
    masses = 1.0 / np.diag(ivp.value("H_pp", p, q))[: ivp.moving]  # the time has no mass
    light = int(np.argmin(masses))
    share = float(masses[light] / np.max(masses))
    if then <= BELIEVED * now or not 0 < share < LIGHT:
        return ""
    return f"G keeps its rank, but M is badly scaled: the mass of q{light + 1}, {masses[light]:.3g}, is {share:.1e} of the largest"


def zero_of(times: Sequence[float], pivots: Sequence[float]) -> float:
    """Return the zero of the line through the roots of two consecutive measurements, which go like the square of an angle.

    Parameters
    ----------
    times : sequence of float
        The two times, s.
    pivots : sequence of float
        Smallest relative pivot at each.

    Returns
    -------
    float
        Time of the zero, s; the second time where the roots do not fall.
    """
    (t1, t2), (s1, s2) = times, (math.sqrt(abs(pivot)) for pivot in pivots)
    return t2 + (t2 - t1) * s2 / (s1 - s2) if s1 > s2 else t2
