"""A rank-loss event: which branch the motion takes where G loses rank."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from daebench.diagnostics.unit_rows import beyond_comparison
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.trajectory import Passage

SAME = 0.1
"""A velocity is called the same as another where it differs by less than this part of it, in the norm of kinetic energy."""

TELLING = 0.3
"""Largest relative difference of two extrapolations of a velocity with which its branch can be identified."""

MOST_STATES = 20
"""Steps after which a fixed-step run no longer waits for pivots to rise again."""

KEPT = 64
"""States after a place that are kept, about: a solver with error control may creep away from it in thousands of steps."""


@dataclass
class Crossing:
    """A place where G loses rank, while a run goes through it.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem.
    t : float
        When G loses rank, as extrapolated.
    t0, p0, q0, pivot0
        The last state before, with its time and the measured values.
    after : list of (float, ndarray, float)
        States that came after: time, s, velocity, shape(d,), and pivot.
    """

    ivp: ConstrainedIvp
    t: float
    t0: float
    p0: Array
    q0: Array
    pivot0: float
    after: list[tuple[float, Array, float]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.smallest = self.pivot0

    def add(self, t: float, p: Array, q: Array, pivot: float) -> None:
        """Take note of a state that came after; of many, every other one is dropped but for the last three.

        Parameters
        ----------
        t : float
            Time, s.
        p, q : ndarray, shape(d,)
            The state.
        pivot : float
            Smallest relative pivot there.
        """
        self.after.append((t, self._velocity(p, q), pivot))
        self.smallest = min(self.smallest, pivot)
        if len(self.after) > 2 * KEPT:
            # Every other state, so that what is kept stays spread over the whole time, whatever the number of steps.
            self.after = [*self.after[:-3:2], *self.after[-3:]]

    @property
    def over(self) -> bool:
        """Whether pivots have nearly risen to their former size over three states beyond the place."""
        if len(self.after) < 3 or self.after[-3][0] <= self.t:
            return False
        first, second, third = (pivot for _, _, pivot in self.after[-3:])
        return first < second < third and 4 * third >= self.pivot0

    @cached_property
    def passage(self) -> Passage:
        """Which branch the motion took: its velocity after, extrapolated back, against that before.

        Branches meet at a loss of rank of G, and each is smooth: if the motion stays on its branch, the parabola through three later
        velocities leads back to the velocity before. If it is far from the line through two of them, steps are too large for an answer.
        """
        velocities = self._spread() if self.over else ()
        if not velocities:
            return Passage(t=self.t, pivot=self.smallest, branch="unknown", turn=math.nan)
        v0 = self._velocity(self.p0, self.q0)
        # A mass matrix of thousands of bodies is not formed for an angle.
        M = None if beyond_comparison(self.ivp) else self.ivp.value("mass", self.p0, self.q0)[: len(v0), : len(v0)]
        back, rough = extrapolated(velocities, self.t0), extrapolated(velocities[1:], self.t0)
        clear = _norm(back - rough, M) <= TELLING * _norm(v0, M)
        return Passage(t=self.t, pivot=self.smallest, branch=_branch(v0, back, M) if clear else "unknown", turn=_turn(v0, back, M))

    def _velocity(self, p: Array, q: Array) -> Array:
        """Return the velocity without that of the time, which goes on at 1 on every branch."""
        return self.ivp.value("H_p", p, q)[: self.ivp.moving]

    def _spread(self) -> list[tuple[float, Array]]:
        """Return three states, as (t, v), that are spread over the time since G lost rank: the third is the last."""
        beyond = [(t, v) for t, v, _ in self.after if t > self.t]
        end = beyond[-1][0]
        # Spread over the time since the loss of rank: three states of one step would extrapolate their rounding.
        second = min(range(1, len(beyond) - 1), key=lambda k: abs(beyond[k][0] - self.t - (end - self.t) * 2 / 3))
        first = min(range(second), key=lambda k: abs(beyond[k][0] - self.t - (end - self.t) / 3))
        return [beyond[first], beyond[second], beyond[-1]]


def extrapolated(points: Sequence[tuple[float, Array]], t: float) -> Array:
    """Return the value at t of the polynomial through the points (t_i, v_i), by Lagrange's formula.

    Parameters
    ----------
    points : sequence of (float, ndarray)
        Times, all different, and values, all of one shape.
    t : float
        Where it is wanted.
    """
    total = np.zeros_like(points[0][1])
    for i, (at, value) in enumerate(points):
        total = total + math.prod((t - other) / (at - other) for k, (other, _) in enumerate(points) if k != i) * value
    return total


def _branch(v0: Array, v1: Array, M: Array | None) -> str:
    if _norm(v1 - v0, M) <= SAME * _norm(v0, M):
        return "through"
    return "reflected" if _norm(v1 + v0, M) <= SAME * _norm(v0, M) else "other branch"


def _turn(v0: Array, v1: Array, M: Array | None) -> float:
    size = _norm(v0, M) * _norm(v1, M)
    return math.degrees(math.acos(min(1.0, max(-1.0, _product(v0, v1, M) / size)))) if size > 0 else math.nan


def _norm(v: Array, M: Array | None) -> float:
    return math.sqrt(max(0.0, _product(v, v, M)))


def _product(v: Array, w: Array, M: Array | None) -> float:
    """Return v^T M w; of a problem too large for a full M, v^T w."""
    return float(v @ w if M is None else v @ M @ w)
