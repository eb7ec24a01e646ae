"""The multipliers that a code's steps imply: whether its step is RATTLE's but for how exactly they are solved for."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from daebench.runs.ivp import Array
from daebench.studies.diagnose.agreement import CONFIRMED
from daebench.studies.diagnose.battery import STATES, Battery, Map, Point, attempted
from daebench.studies.diagnose.exactness import ROUNDINGS, Exactness, exactness
from daebench.studies.diagnose.faulty_steps import ended_after
from daebench.studies.diagnose.kicks import tangent
from daebench.studies.diagnose.mechanics import Mechanics

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

    fault: str
    """"velocity_not_projected", "one_sweep", "loose_tolerance", "loose_tolerance, one_sweep" where it may be either, "" where no fault
    shows.
    """
    about: str
    """What was measured."""
    exact: bool
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
        return Inexact("", met.words, exact=True)
    position, velocity, projection = _distances(battery)
    where = f"positions are off the manifold by {position:.1e} of their size, momenta off its tangent space by {velocity:.1e}"
    if projection <= 10 * battery.rounding(CONFIRMED) < velocity:
        return Inexact("velocity_not_projected", f"{where}, and none of p1 is taken along G(q1)", exact=False)
    if met.g_roundings <= ROUNDINGS or position <= battery.rounding(MET):
        return _hardly(met, velocity <= STOPPED * projection)
    if _ends_by_tolerance(battery, step):
        return Inexact("loose_tolerance", f"{where}; how many sweeps are made depends on how far off they are", exact=False)
    if not (sweeps := _sweeps(battery)):
        return Inexact("loose_tolerance, one_sweep", where, exact=False)
    how, counts = sweeps
    least = 0 if battery.single else 1  # in float32 a small step may need none
    fault = "one_sweep" if max(counts) == 1 and min(counts) >= least else "loose_tolerance"
    count = str(counts[0]) if len(set(counts)) == 1 else f"{min(counts)} to {max(counts)}"
    return Inexact(fault, f"{where}; the steps are those of {count} sweep{'' if count == '1' else 's'}, {how}", exact=False)


def _hardly(met: Exactness, stopped: bool) -> Inexact | None:
    """Return the finding on positions that nearly meet their constraint, of which too few iterations show no more than a residual."""
    if not stopped:
        return None
    if met.follows:
        return Inexact("loose_tolerance", f"{met.words}; it changes smoothly with h, so that the code's iteration ends there", exact=False)
    return Inexact("", f"{met.words}; it does not change smoothly with h, as roundings do not", exact=False)


def has_form(battery: Battery) -> bool:
    """Return whether steps are RATTLE's but for the values of the multipliers."""
    mechanics, bound = battery.mechanics, 10 * battery.rounding(CONFIRMED) * float(battery.scales[0])
    for point in battery.points:
        p1, q1 = point.after
        _, impulse = implied(mechanics, point)
        off = max(beside(mechanics.gradient(point.q), impulse), beside(mechanics.gradient(q1), p1 - kicked(mechanics, point)))
        if not off <= bound:
            return False
    return True


def kicked(mechanics: Mechanics, point: Point) -> Array:
    """Return the momentum after the second kick that the drift implies."""
    half, _ = implied(mechanics, point)
    return half - point.h / 2 * mechanics.slope(half, point.after[1])


def _distances(battery: Battery) -> tuple[float, float, float]:
    """Return how far steps end from the manifold and from its tangent space, and how much they take along G(q1)^T; all relative."""
    mechanics, (size_p, size_q) = battery.mechanics, (float(scale) for scale in battery.scales)
    position = velocity = projection = 0.0
    for point in battery.points:
        p1, q1 = point.after
        before = kicked(mechanics, point)
        position = max(position, mechanics.distance(q1) / size_q)
        velocity = max(velocity, _largest(p1 - tangent(mechanics, before, q1)) / size_p)
        projection = max(projection, _largest(p1 - before) / size_p)
    return position, velocity, projection


def implied(mechanics: Mechanics, point: Point) -> tuple[Array, Array]:
    """Return the momentum between the kicks that the drift implies, and the impulse h/2 G^T lam that it lacks."""
    q1 = point.after[1]
    W = (mechanics.inverse_mass(point.q) + mechanics.inverse_mass(q1)) / 2
    half = np.asarray(np.linalg.solve(W, (q1 - point.q) / point.h), dtype=float)
    return half, point.p - point.h / 2 * mechanics.slope(half, point.q) - half


def beside(G: Array, vector: Array) -> float:
    """Return the part of a vector that is not along the rows of G."""
    return _largest(vector - G.T @ np.linalg.lstsq(G.T, vector, rcond=None)[0])


def _largest(vector: Array) -> float:
    largest = float(np.max(np.abs(vector)))
    return largest if np.isfinite(largest) else np.inf


def _sweeps(battery: Battery) -> tuple[str, list[int]] | None:
    """Return the iteration, and the numbers of its sweeps in each step, with which all positions are reached."""
    families = [ended_after(count) for count in range(SWEEPS + 1)]
    for how in families[0]:
        counts = []
        for point in battery.points:
            reached = (k for k, family in enumerate(families) if _reached(battery, point, _map(battery, family[how])))
            counts.append(next(reached, -1))
            if counts[-1] < 0:
                break
        else:
            return how, counts
    return None


def _map(battery: Battery, variant: Callable[..., tuple[Array, Array]]) -> Map:
    return lambda p, q, h: variant(battery.mechanics, p, q, h)


def _reached(battery: Battery, point: Point, step: Map) -> bool:
    return _largest(attempted(step, point)[1] - point.after[1]) <= 10 * battery.rounding(CONFIRMED) * float(battery.scales[1])


def _ends_by_tolerance(battery: Battery, step: Map) -> bool:
    """Return whether the distance to the manifold is a sawtooth of the step size: it falls where one more sweep is made."""
    mechanics, size = battery.mechanics, float(battery.scales[1])
    for point in sorted(battery.points, key=lambda point: -point.h)[:STATES]:
        after = [attempted(step, Point(part * point.h, point.p, point.q, point.after))[1] for part in PARTS]
        off = np.array([max(mechanics.distance(q) / size, ROUNDINGS * battery.eps) for q in after])
        if np.any((off[:-3] < off[1:-2]) & (FALLS * off[2:-1] < off[1:-2]) & (off[2:-1] < off[3:])):
            return True
    return False
