"""Where the rank of G is lost along a motion, and whether it is a mass that makes it seem so."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.diagnostics.freedom import beyond_comparison
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.members import Members

WITHIN = 3
"""Steps after the start in which a loss of rank is looked for before there are steps to extrapolate from."""

AFTER_FAILURE = 5
"""Steps in which it is looked for after a step that could not be done."""

SUSPECT = 1e-6
"""Root of what is measured below which constraints are compared; of dependent ones it is at most about 1e-8."""

BELIEVED = 1 / 3
"""Part of the present root of what is measured that it may be, at most, where a line says that it is zero."""

LIGHT = 1e-2
"""Part of the largest mass below which a mass is light."""

HEAVIER = "use a smaller h, which resolves the light mass, or leave that mass out; --on-singular continue ignores this"
"""Advice if a run stops because a mass is too light for the step."""

GO_ON = "to go on, add --on-singular continue (on_singular), which says which branch the motion takes"
"""Advice if a run stops because G loses rank."""


def upcoming_loss(ivp: ConstrainedIvp, p: Array, q: Array, h: float, within: int) -> float | None:
    """Return the time until G loses rank, by one state and its velocity, if it is within this number of steps of size h; else None.

    The roots of what ``independence`` in ``daebench/schemes/kernels/rank.py`` measures at q, q - h v and q - 2 h v are extrapolated, and
    what is found is believed where it is there at most a third of what it is at q.

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


def upcoming_losses(members: Members, p: Array, q: Array, within: int) -> Array:
    """Return the same time for each member of an ensemble, shape(n,), equal to the bit; NaN if there is none.

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
    """Return when a line through sigma(-h) and sigma(0) is zero, where sigma falls faster and faster and is small there; else NaN."""
    s = [sigma(k * h) for k in (-2, -1, 0)]
    with np.errstate(all="ignore"):
        falls = (s[0] > s[1]) & (s[1] > s[2]) & (s[2] <= within * (s[1] - s[2]))
        t = np.where(falls, h * s[2] / (s[1] - s[2]), np.nan)
    return np.where(sigma(t) <= BELIEVED * s[2], t, np.nan) if np.any(falls) else t


def may_lose_rank(members: Members) -> NDArray[np.bool_]:
    """Return at which members of an ensemble ``dependence`` may find something, or :func:`upcoming_loss` within :data:`WITHIN` steps.

    Nothing is missed; of others there are a few at most.

    Parameters
    ----------
    members : Members
        Members whose starts are looked at.

    Returns
    -------
    ndarray of bool, shape(n,)
    """
    if isinstance(members.ivp, ConstrainedIvp) and beyond_comparison(members.ivp):
        return np.zeros(len(members), dtype=bool)
    p, q = members.start
    with np.errstate(all="ignore"):
        one_step = np.reshape(members.h, (-1, 1)) * members.along("H_p", p, q)
        here, before = (np.sqrt(np.abs(members.along("independence", p, x))) for x in (q, q - one_step))
        suspect = ~(here > SUSPECT * np.maximum(before, 1.0))
    return np.asarray(suspect | ~np.isnan(upcoming_losses(members, p, q, WITHIN)))


def badly_scaled(ivp: ConstrainedIvp, p: Array, q: Array, t: float) -> str:
    """Return which coordinate is too light for the step where G keeps its rank in a time t, as part of a sentence; "" where G loses it.

    G M^-1 G^T is nearly singular where G is, and also where the masses are of very different size: rows of G that are independent are
    then nearly parallel in the metric M^-1. The smallest singular value of G itself, its rows in parts of their lengths at q, tells.

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
    masses = 1.0 / np.diag(ivp.value("H_pp", p, q))[: len(q) - ivp.facts.EXTENDED]  # the time has no mass
    light = int(np.argmin(masses))
    share = float(masses[light] / np.max(masses))
    if then <= BELIEVED * now or not 0 < share < LIGHT:
        return ""
    return f"G keeps its rank, but M is badly scaled: the mass of q{light + 1}, {masses[light]:.3g}, is {share:.1e} of the largest"


def zero_of(times: Sequence[float], pivots: Sequence[float]) -> float:
    """Return where the line through the roots of two measurements in a row reaches zero, which go like the square of an angle.

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
