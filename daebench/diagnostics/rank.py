"""The rank of G: which constraints depend on others at the start, where it is lost along a motion, and which branch the motion took."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from daebench.scene import Scene
from daebench.trajectory import Passage

Array = NDArray[np.float64]

DEPENDENT = 1e-9
"""Sine of the angle between a row of G and the span of others, in the metric M^-1, below which it is taken for dependent."""

LARGEST = 200
"""Constraints up to which they are compared with each other: it takes m^2 d operations."""

NEARBY = 1e-3
"""Relative change of positions by which a redundant constraint is told from a singular configuration."""

SAME = 0.1
"""A velocity is called the same as another where it differs by less than this part of it, in the norm of kinetic energy."""

WITHIN = 3
"""Steps after the start in which a loss of rank is looked for before there are steps to extrapolate from."""

AFTER_FAILURE = 5
"""Steps in which it is looked for after a step that could not be done."""

GO_ON = "to go on, add --on-singular continue (on_singular), which says which branch the motion takes"
"""What to do where a run stops because G loses rank."""

REDUNDANT = (
    "remove redundant constraints or start where they are independent, or add --on-singular least-squares (on_singular), which leaves out "
    "what depends on others"
)
"""What to do where constraints are dependent at the start."""

TELLING = 0.3
"""Part of a velocity by which two ways to extrapolate it may differ for its branch to be told."""

MOST_STATES = 20
"""Steps after which a fixed-step run no longer waits for pivots to rise again."""


def independent_rows(scene: Scene, q: Array) -> tuple[list[int], dict[int, list[int]]]:
    """Return which rows of G are independent of those before them, and for each other one which of these it is a combination of.

    The rows are taken in the metric M^-1 and scaled to length one, so that neither masses nor units matter.
    """
    G, H_pp = scene.value("G", q), scene.value("H_pp", scene.p0, q)
    rows = np.array(G @ np.linalg.cholesky(H_pp), dtype=float)
    length = np.linalg.norm(rows, axis=1)
    rows /= np.where(length > 0, length, 1.0)[:, None]
    kept: list[int] = []
    others: dict[int, list[int]] = {}
    for k, row in enumerate(rows):
        shares = np.linalg.lstsq(rows[kept].T, row, rcond=None)[0] if kept else np.empty(0)
        if np.linalg.norm(row - shares @ rows[kept]) > DEPENDENT:
            kept.append(k)
        else:
            others[k] = [j for j, share in zip(kept, shares, strict=True) if abs(share) > DEPENDENT]
    return kept, others


def dependence(scene: Scene) -> str | None:
    """Return which constraints depend on others at the start, and whether only there, as the end of a sentence; None if none does.

    More than :data:`LARGEST` constraints are not compared; nor where a value is not finite, which is told of elsewhere.
    """
    if scene.arrays or scene.m > LARGEST:
        return None
    try:
        kept, others = independent_rows(scene, scene.q0)
        if not others:
            return None
        shaken = scene.q0 + NEARBY * max(1.0, float(np.max(np.abs(scene.q0)))) * np.cos(1.0 + np.arange(scene.d))
        everywhere = independent_rows(scene, shaken)[1].keys() >= others.keys()
    except np.linalg.LinAlgError:
        return None
    named = "; ".join(
        f"g{k + 1} is a combination of {' and '.join(f'g{j + 1}' for j in of)}" if of else f"the gradient of g{k + 1} is zero"
        for k, of in others.items()
    )
    where = "also nearby, so that the constraints are redundant" if everywhere else "there, though not nearby"
    return f"G has rank {len(kept)} of {scene.m}: {named}, {where}"


def upcoming_loss(scene: Scene, p: Array, q: Array, h: float, within: int) -> float | None:
    """Return in what time G loses rank, if it does so within so many steps of size h, as one state and its velocity tell; else None.

    The roots of what :func:`daebench.kernels.rank.independence` measures at q, q - h v and q - 2 h v are extrapolated, and what is
    found is believed where it is there at most a third of what it is at q.
    """
    if scene.arrays or scene.m > LARGEST:
        return None
    v = scene.value("H_p", p, q)

    def sigma(t: float) -> float:
        return math.sqrt(abs(float(scene.value("independence", p, q + t * v))))

    s = [sigma(k * h) for k in (-2, -1, 0)]
    if not s[0] > s[1] > s[2] or not s[2] <= within * (s[1] - s[2]):
        return None
    t = h * s[2] / (s[1] - s[2])
    return t if sigma(t) <= s[2] / 3 else None


@dataclass
class Crossing:
    """A place where G loses rank, while a run goes through it.

    Parameters
    ----------
    scene : Scene
        The problem.
    t : float
        When G loses rank, as extrapolated.
    t0, p0, q0, pivot0
        The last state before, its time, and what was measured there.
    """

    scene: Scene
    t: float
    t0: float
    p0: Array
    q0: Array
    pivot0: float
    after: list[tuple[float, Array, float]] = field(default_factory=list)

    def add(self, t: float, p: Array, q: Array, pivot: float) -> None:
        """Take note of a state that came after."""
        self.after.append((t, self.scene.value("H_p", p, q), pivot))

    @property
    def over(self) -> bool:
        """Whether pivots have risen again to what they were before, or nearly so, over three states beyond the place."""
        if len(self.after) < 3 or self.after[-3][0] <= self.t:
            return False
        first, second, third = (pivot for _, _, pivot in self.after[-3:])
        return first < second < third and 4 * third >= self.pivot0

    @cached_property
    def passage(self) -> Passage:
        """Which branch the motion took: its velocity after, extrapolated back, against that before.

        Branches meet in a place where G loses rank, and each is smooth: on the branch that the motion came on, the parabola through
        three velocities after leads back to that before. Where it is far from the line through two, steps are too large to tell.
        """
        pivot = min([self.pivot0, *(pivot for _, _, pivot in self.after)])
        told = self._spread() if self.over else ()
        if not told:
            return Passage(t=self.t, pivot=pivot, branch="unknown", turn=math.nan)
        v0 = self.scene.value("H_p", self.p0, self.q0)
        M = None if self.scene.arrays or self.scene.m > LARGEST else self.scene.value("mass", self.p0, self.q0)
        back, rough = extrapolated(told, self.t0), extrapolated(told[1:], self.t0)
        clear = _norm(back - rough, M) <= TELLING * _norm(v0, M)
        return Passage(t=self.t, pivot=pivot, branch=_branch(v0, back, M) if clear else "unknown", turn=_turn(v0, back, M))

    def _spread(self) -> list[tuple[float, Array]]:
        """Return three states, as (t, v), that are spread over the time since G lost rank: the third is the last."""
        beyond = [(t, v) for t, v, _ in self.after if t > self.t]
        end = beyond[-1][0]
        second = min(range(1, len(beyond) - 1), key=lambda k: abs(beyond[k][0] - self.t - (end - self.t) * 2 / 3))
        first = min(range(second), key=lambda k: abs(beyond[k][0] - self.t - (end - self.t) / 3))
        return [beyond[first], beyond[second], beyond[-1]]


def extrapolated(points: Sequence[tuple[float, Array]], t: float) -> Array:
    """Return the value at t of the polynomial through the points (t_i, v_i), by Lagrange's formula."""
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


def zero_of(times: Sequence[float], pivots: Sequence[float]) -> float:
    """Return where the line through the roots of two measurements in a row reaches zero, which go like the square of an angle."""
    (t1, t2), (s1, s2) = times, (math.sqrt(abs(pivot)) for pivot in pivots)
    return t2 + (t2 - t1) * s2 / (s1 - s2) if s1 > s2 else t2
