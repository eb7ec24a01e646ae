"""Measurements of a code: order, defects, constraints and energy, and how exactly it meets the constraints in its own precision."""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from daebench.diagnostics.derivative import DerivativeWarning
from daebench.diagnostics.energy_verdict import energy_verdict
from daebench.errors import RunFailed
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.outside.method import OutsideMethod
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.request import Request
from daebench.studies.claims.measured_run import bench_of
from daebench.studies.diagnose.battery import EPS, Battery, Map, Point, attempted, map_of, uncompiled
from daebench.studies.diagnose.mechanics import Mechanics, largest

ROUNDINGS = 64.0
"""Roundings up to which a constraint is met: |g| <= 64 eps |G| |q|, and |G H_p| <= 64 eps |G| |v|; and those of a step in an error."""

GENTLER = 4.0
"""Part of the step at which faults show that order and defects are measured with."""

MONITORED = 200
"""Steps of the run along which constraints and energy are monitored."""

WATCHED = 4000
"""Steps of the run of which it is told whether the energy drifts."""

REFERENCE = "lobatto4"
"""Scheme of order 6 whose motion the order is measured against."""

SPAN = 8
"""Steps of the longest kind to the end of the motion that the order is read off: short, so that every slope is that of the order."""

REFINEMENTS = (2, 4, 8)
"""Parts of the step size that the order is read off."""

ROUND_OFF = "round-off"
"""In place of an order: errors are round-off at all step sizes."""

LESS = 0.1
"""By how much an order may be below that of the scheme in the same motion."""

COLUMNS = ("order", "symmetric", "symplectic", "g", "G H_p", "H", "energy")
"""What is measured."""


def measured(ivp: ConstrainedIvp, code: OutsideMethod, h: float, eps: float = EPS) -> dict[str, float | str]:
    """Return the measurements of a code on a problem."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DerivativeWarning)
        try:
            values: dict[str, float | str] = {"order": short_order(ivp, code, h, eps)}
            findings = bench_of(ivp, code, h, MONITORED).findings()
            values |= {name: x.measured for x in findings if (name := x.property.removeprefix("keeps ")) in COLUMNS}
            run = code.solve(ivp, Request(value=h, steps=WATCHED, every=2)).complete()
        except RunFailed as error:
            return {"failure": str(error)}
        return values | {"energy": energy_verdict(ivp, run).verdict}


def short_order(ivp: ConstrainedIvp, code: OutsideMethod | FixedStep, h: float, eps: float = EPS) -> float | str:
    """Return the slope of the error over h at the end of a short motion, of q and p the smaller; or that errors are round-off.

    A slope is that of errors at two or more step sizes that are above the rounding of the code: others say nothing of an order.
    """
    start = ivp.p0, ivp.q0
    finest = SPAN * max(REFINEMENTS)
    fine = map_of(uncompiled(FixedStep(REFERENCE)), ivp, finest)(*start, SPAN * h / finest)
    ends = [map_of(code, ivp, SPAN * part)(*start, h / part) for part in REFINEMENTS]
    slopes = []
    for k in (0, 1):
        errors = np.array([float(np.linalg.norm(end[k] - fine[k])) for end in ends])
        seen = errors > ROUNDINGS * finest * eps * max(float(np.linalg.norm(x)) for x in (start[k], fine[k]))
        if np.count_nonzero(seen) > 1:
            slopes.append(float(-np.polyfit(np.log(REFINEMENTS)[seen], np.log(errors[seen]), 1)[0]))
    return min(slopes, default=ROUND_OFF)


def contradiction(ivp: ConstrainedIvp, values: Mapping[str, float | str], meant: FixedStep, h: float, rounding: float) -> str:
    """Return how measurements of a code contradict that it is a scheme, "" where they do not: the scheme's own are no better."""
    scheme = uncompiled(meant)
    order, claimed = values.get("order"), short_order(ivp, scheme, h)
    if isinstance(order, float) and not (isinstance(claimed, float) and order > claimed - LESS):
        other = f"{claimed:.3g}" if isinstance(claimed, float) else claimed
        return f"against it speaks that its order is {order:.3g} in a short motion, and that of {meant.name} {other}"
    if "failure" in values:
        run = scheme.solve(ivp, Request(value=h, steps=WATCHED, every=0))
        return "" if run.failure else f"against it speaks that it stops where {meant.name} does not"
    return ""


# ---- constraints

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
    sizes = _sizes(battery.mechanics, battery.points)
    rows = [_residuals(battery.mechanics, point, sizes) for point in battery.points]
    most = [largest(*(row[k] for row in rows)) for k in (0, 1)]
    relative = [largest(*(row[k] / (battery.eps * row[k + 2]) for row in rows)) for k in (0, 1)]
    follows = any(
        _smooth(battery, step, point, sizes, k)
        for k in (0, 1)
        for point, row in zip(battery.points, rows, strict=True)
        if relative[k] > ROUNDINGS and largest(row[k] / row[k + 2]) >= relative[k] * battery.eps / 2
    )
    return Exactness(most[0], most[1], relative[0], relative[1], follows)


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
    h = point.h * (1 + NUDGE * (battery.eps / EPS) ** 0.25)
    ends = (point, replace(point, after=attempted(step, point.p, point.q, h)))
    one, two = (_residuals(battery.mechanics, end, sizes)[k] for end in ends)
    return largest(two - one) <= SMOOTH * largest(one)
