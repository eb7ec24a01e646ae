"""The multipliers that a code's steps imply: whether its step is RATTLE's but for how exactly they are solved for."""

from dataclasses import dataclass
from itertools import takewhile

import numpy as np

from daebench.runs.ivp import Array
from daebench.studies.diagnose.agreement import CONFIRMED, step_of
from daebench.studies.diagnose.battery import STATES, Battery, Map, Point, attempted
from daebench.studies.diagnose.faulty_steps import ended_after
from daebench.studies.diagnose.kick_drift_kick import tangent
from daebench.studies.diagnose.measurements import ROUNDINGS, Exactness, exactness
from daebench.studies.diagnose.mechanics import Mechanics, beside, largest

MET = 1e-9
"""Largest distance to the manifold, relative to the largest position, at which sweeps that are made or not can no longer be counted."""

STOPPED = 0.5
"""Largest distance of momenta to the tangent space, relative to what is taken from them, of a projection that is ended early."""

SWEEPS = 12
"""Most sweeps that are tried."""

PARTS = tuple(1.15**-k for k in range(60, -1, -1))
"""Parts of the step size with which a step is taken, from small to large."""

FALLS = 1.2
"""A distance falls where it is so many times smaller with the next step size, having risen before, and rises after."""


@dataclass(frozen=True)
class Inexact:
    """How exactly a code whose step has the form of RATTLE's solves for its multipliers."""

    about: str
    """The measurement."""
    faults: tuple[str, ...] = ()
    """"velocity_not_projected", "one_sweep" or "loose_tolerance", both of these if it may be either, none if no fault shows."""
    exact: bool = False
    """Whether both constraints are met to round-off."""


def inexact(battery: Battery, step: Map) -> Inexact | None:
    """Return how exactly the multipliers are solved for, None where the step has not the form of RATTLE's.

    It has that form where the impulse that the positions imply is along G(q0)^T, and the rest of the step follows from it, but for a
    momentum along G(q1)^T.
    """
    if not has_form(battery):
        return None
    met = exactness(battery, step)
    if met.exact:
        return Inexact(met.words, exact=True)
    position, velocity, projection = _distances(battery)
    where = f"positions are off the manifold by {position:.1e} of their size, momenta off its tangent space by {velocity:.1e}"
    if projection <= 10 * battery.rounding(CONFIRMED) < velocity:
        return Inexact(f"{where}, and none of p1 is taken along G(q1)", ("velocity_not_projected",))
    if met.g_roundings <= ROUNDINGS or position <= battery.rounding(MET):
        return _hardly(met) if velocity <= STOPPED * projection else None
    if _ends_by_tolerance(battery, step):
        return Inexact(f"{where}; how many sweeps are made depends on how far off they are", ("loose_tolerance",))
    if not (sweeps := _sweeps(battery)):
        return Inexact(where, ("loose_tolerance", "one_sweep"))
    how, counts = sweeps
    least = 0 if battery.single else 1  # in float32 a small step may need none
    fault = "one_sweep" if max(counts) == 1 and min(counts) >= least else "loose_tolerance"
    count = str(counts[0]) if len(set(counts)) == 1 else f"{min(counts)} to {max(counts)}"
    return Inexact(f"{where}; the steps are those of {count} sweep{'' if count == '1' else 's'}, {how}", (fault,))


def _hardly(met: Exactness) -> Inexact:
    """Return the finding on positions that nearly meet their constraint, of which too few iterations show no more than a residual."""
    if met.follows:
        return Inexact(f"{met.words}; it changes smoothly with h, so that the code's iteration ends there", ("loose_tolerance",))
    return Inexact(f"{met.words}; it does not change smoothly with h, as roundings do not")


def has_form(battery: Battery) -> bool:
    """Return whether steps are RATTLE's but for the values of the multipliers."""
    mechanics, bound = battery.mechanics, 10 * battery.rounding(CONFIRMED) * battery.scales[0]
    for point in battery.points:
        p1, q1 = point.after
        _, impulse = implied(mechanics, point)
        off = largest(beside(mechanics.gradient(point.q), impulse), beside(mechanics.gradient(q1), p1 - kicked(mechanics, point)))
        if not off <= bound:
            return False
    return True


def kicked(mechanics: Mechanics, point: Point) -> Array:
    """Return the momentum after the second kick that the drift implies."""
    half, _ = implied(mechanics, point)
    return half - point.h / 2 * mechanics.slope(half, point.after[1])


def _distances(battery: Battery) -> tuple[float, float, float]:
    """Return how far steps end from the manifold and from its tangent space, and how much they take along G(q1)^T; all relative."""
    mechanics, (size_p, size_q) = battery.mechanics, battery.scales
    position = velocity = projection = 0.0
    for point in battery.points:
        p1, q1 = point.after
        before = kicked(mechanics, point)
        position = max(position, mechanics.distance(q1) / size_q)
        velocity = max(velocity, largest(p1 - tangent(mechanics, before, q1)) / size_p)
        projection = max(projection, largest(p1 - before) / size_p)
    return position, velocity, projection


def implied(mechanics: Mechanics, point: Point) -> tuple[Array, Array]:
    """Return the momentum between the kicks that the drift implies, and the impulse h/2 G^T lam that it lacks."""
    q1 = point.after[1]
    W = (mechanics.inverse_mass(point.q) + mechanics.inverse_mass(q1)) / 2
    half = np.asarray(np.linalg.solve(W, (q1 - point.q) / point.h), dtype=float)
    return half, point.p - point.h / 2 * mechanics.slope(half, point.q) - half


def _sweeps(battery: Battery) -> tuple[str, list[int]] | None:
    """Return the iteration, and the numbers of its sweeps in each step, with which all positions are reached."""
    families = [ended_after(count) for count in range(SWEEPS + 1)]
    for how in families[0]:
        steps = [step_of(battery, family[how]) for family in families]
        reached = (next((k for k, step in enumerate(steps) if _reached(battery, point, step)), None) for point in battery.points)
        counts = list(takewhile(lambda k: k is not None, reached))
        if len(counts) == len(battery.points):
            return how, [k for k in counts if k is not None]
    return None


def _reached(battery: Battery, point: Point, step: Map) -> bool:
    _, q1 = attempted(step, point.p, point.q, point.h)
    return largest(q1 - point.after[1]) <= 10 * battery.rounding(CONFIRMED) * battery.scales[1]


def _ends_by_tolerance(battery: Battery, step: Map) -> bool:
    """Return whether the distance to the manifold is a sawtooth of the step size: it falls where one more sweep is made."""
    mechanics, size = battery.mechanics, battery.scales[1]
    for point in sorted(battery.points, key=lambda point: -point.h)[:STATES]:
        after = [attempted(step, point.p, point.q, part * point.h)[1] for part in PARTS]
        off = np.array([max(mechanics.distance(q) / size, ROUNDINGS * battery.eps) for q in after])
        if np.any((off[:-3] < off[1:-2]) & (FALLS * off[2:-1] < off[1:-2]) & (off[2:-1] < off[3:])):
            return True
    return False
