"""Whether a code meets the constraints to round-off in its own precision, and whether what is left follows its own stop."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from daebench.runs.ivp import Array
from daebench.studies.diagnose.battery import Battery, Map, Point, attempted
from daebench.studies.diagnose.mechanics import Mechanics, State

ROUNDINGS = 64.0
"""Roundings up to which a constraint is met: |g| <= 64 eps |G| |q|, and |G H_p| <= 64 eps |G| |v|."""

NUDGE = 1e-6
"""Relative change of the step size under which a residual that follows an iteration hardly changes, and one of roundings does."""

SMOOTH = 0.1
"""Largest relative change of a residual that follows an iteration."""


@dataclass(frozen=True)
class Exactness:
    """Residuals of the constraints after single steps."""

    g: float
    Gv: float
    """The largest |g| and |G H_p|, in their units."""
    g_roundings: float
    Gv_roundings: float
    """The largest, in units of eps |G| |q| and eps |G| |v|, of the same row each."""
    follows: bool
    """Whether residuals above :data:`ROUNDINGS` change smoothly with the step size: an iteration is ended there."""

    @property
    def exact(self) -> bool:
        """Whether both constraints are met to round-off."""
        return self.g_roundings <= ROUNDINGS and self.Gv_roundings <= ROUNDINGS

    @property
    def words(self) -> str:
        """The measurement, as the end of a sentence."""
        return (
            f"after a step |g| is up to {self.g:.1e}, which is {self.g_roundings:.2g} roundings of |G| |q|, and |G H_p| up to "
            f"{self.Gv:.1e}, {self.Gv_roundings:.2g} of |G| |v|; up to {ROUNDINGS:g} are rounding"
        )


def exactness(battery: Battery, step: Map) -> Exactness:
    """Return how exactly a code meets the constraints after its single steps."""
    mechanics = battery.mechanics
    sizes = _sizes(mechanics, battery.points)
    rows = [_residuals(mechanics, point, sizes) for point in battery.points]
    largest = [max(float(np.max(np.abs(row[k]))) for row in rows) for k in (0, 1)]
    relative = [max(float(np.max(np.abs(row[k]) / (battery.eps * row[k + 2]))) for row in rows) for k in (0, 1)]
    follows = any(
        _smooth(battery, step, point, sizes, k)
        for k in (0, 1)
        for point, row in zip(battery.points, rows, strict=True)
        if relative[k] > ROUNDINGS and np.max(np.abs(row[k]) / row[k + 2]) >= relative[k] * battery.eps / 2
    )
    return Exactness(largest[0], largest[1], relative[0], relative[1], follows)


def _sizes(mechanics: Mechanics, points: Sequence[Point]) -> tuple[float, float]:
    """Return the largest |q| and |v| after the steps."""
    ends = [point.after for point in points]
    length = max(float(np.linalg.norm(q)) for _, q in ends)
    return length, max(float(np.linalg.norm(mechanics.velocity(p, q))) for p, q in ends)


def _residuals(mechanics: Mechanics, point: Point, sizes: tuple[float, float]) -> tuple[Array, Array, Array, Array]:
    """Return g and G H_p after a step, and |G| |q| and |G| |v| of each row."""
    (p1, q1), tiny = point.after, np.finfo(float).tiny
    G = mechanics.gradient(q1)
    size = np.linalg.norm(G, axis=1)
    return mechanics.constraint(q1), G @ mechanics.velocity(p1, q1), size * sizes[0] + tiny, size * sizes[1] + tiny


def _smooth(battery: Battery, step: Map, point: Point, sizes: tuple[float, float], k: int) -> bool:
    """Return whether a residual is nearly the same after a step of nearly the same size."""
    h = point.h * (1 + NUDGE * (battery.eps / np.finfo(float).eps) ** 0.25)
    other: State = attempted(step, replace(point, h=h))
    one, two = (_residuals(battery.mechanics, replace(point, after=after), sizes)[k] for after in (point.after, other))
    return bool(np.max(np.abs(two - one)) <= SMOOTH * np.max(np.abs(one)))
