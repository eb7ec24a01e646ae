"""Laws that the steps of a code obey, whatever its numbers are: faults that no list of steps can have, as they depend on a number."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.runs.ivp import Array
from daebench.studies.diagnose.agreement import CONFIRMED, TIMES
from daebench.studies.diagnose.battery import FAILED, Battery, Map, Point, attempted
from daebench.studies.diagnose.equations import rates
from daebench.studies.diagnose.faulty_steps import MOMENTA, UNPROJECTED, Step
from daebench.studies.diagnose.kick_drift_kick import RATTLE, Momenta, as_it_is
from daebench.studies.diagnose.mechanics import Mechanics, State, beside, drift, largest, multiples
from daebench.studies.diagnose.multipliers import has_form, implied, kicked

CONSTANT = 1e-9
"""Largest change of g, relative to the size of G and q, where it is held at a value other than zero."""

NO_PULL, NO_PULL_SINGLE = 1e-9, 1e-3
"""A multiplier is zero where it is so small, relative to the largest; in float32, whose roundings of q1 - q0 are divided by h."""

BACK = 0.5
"""Part of the distance to the manifold that positions have at most kept where they are put back on it."""

SLOWEST = 0.3
"""Least factor by which momenta are still damped."""

SMALL = 1e-3
"""The step in units of the battery's with which a force is measured."""

FITS = 1e-4
"""Largest residual of a force that is measured, relative to the largest."""


@dataclass(frozen=True)
class Law:
    """A fault, and the law that shows it."""

    fault: str
    """Name in :data:`daebench.studies.diagnose.dictionary.FAULTS`."""
    about: str
    """What was measured."""


def law(battery: Battery, step: Map) -> Law | None:
    """Return the first law that all steps of a code obey, None where they obey none of them."""
    return _of_one_size(battery, step) or next(filter(None, (shown(battery) for shown in LAWS)), None)


def _of_one_size(battery: Battery, step: Map) -> Law | None:
    tolerance = battery.rounding(CONFIRMED)
    for point in battery.points:
        other = attempted(step, point.p, point.q, point.h / 2)
        if not battery.distance(other, point.after) <= tolerance:
            return None
    return Law("step_size_ignored", "steps of h and of h/2 lead to the same states")


def _held_elsewhere(battery: Battery) -> Law | None:
    """Return whether g has one value after all steps, which is not zero."""
    mechanics, ends = battery.mechanics, [point.after[1] for point in battery.points]
    values = np.array([mechanics.constraint(q) for q in ends])
    spread = battery.rounding(CONSTANT) * largest(*map(mechanics.gradient, ends)) * battery.scales[1]
    if np.max(np.ptp(values, axis=0)) > spread or largest(values) < 100 * spread:
        return None
    there = ", ".join(f"{value:.6g}" for value in np.mean(values, axis=0))
    return Law("constraint_shifted", f"after every step g is {there}: the code has other lengths than the problem")


def _left_out(battery: Battery) -> Law | None:
    """Return whether multipliers are zero where RATTLE's are not: always, or where they had another sign."""
    if not has_form(battery):
        return None
    residuals: Any = (("positions", *_of_positions(battery)), ("velocities", *_of_velocities(battery)))
    for what, pulls, free, left in residuals:
        small = np.abs(pulls) <= (NO_PULL_SINGLE if battery.single else NO_PULL) * largest(pulls)
        zero = small & (np.abs(left) > battery.rounding(NO_PULL) * largest(free))
        for k in range(zero.shape[1]):
            if zero[:, k].all() and not zero.all():
                return Law("constraint_missing", f"constraint {k + 1} has no multiplier for the {what} in any step")
        if zero.any() and not zero.all() and _one_sided(pulls, small) and _no_stop(zero, small, free, left):
            return Law("multiplier_clamped", f"multipliers for the {what} have one sign in all steps, and are zero in the others")
    return None


def _one_sided(pulls: Array, small: NDArray[np.bool_]) -> bool:
    """Return whether all multipliers that are not small have one sign in each column."""
    signs = np.where(small, 0.0, np.sign(pulls))
    return all(len(set(column) - {0.0}) <= 1 for column in signs.T)


def _no_stop(zero: NDArray[np.bool_], small: NDArray[np.bool_], free: Array, left: Array) -> bool:
    """Return whether residuals that are left without a multiplier are larger than some that are not: no tolerance ends there."""
    return bool(largest(left[zero]) > np.min(np.max(np.abs(free[~small.all(axis=1)]), axis=1)))


def _of_positions(battery: Battery) -> Iterator[Array]:
    """Yield, one row a step, the multipliers for the positions, g without them, and g after the step."""
    mechanics, rows = battery.mechanics, []
    for point in battery.points:
        half, impulse = implied(mechanics, point)
        free = drift(mechanics, half + impulse, point.q, point.h)
        pulls = multiples(mechanics.gradient(point.q), impulse) / point.h
        rows.append((pulls, mechanics.constraint(free), mechanics.constraint(point.after[1])))
    return map(np.array, zip(*rows, strict=True))


def _of_velocities(battery: Battery) -> Iterator[Array]:
    """Yield, one row a step, the multipliers for the velocities, G v without them, and G v after the step."""
    mechanics, rows = battery.mechanics, []
    for point in battery.points:
        p1, q1 = point.after
        G, before = mechanics.gradient(q1), kicked(mechanics, point)
        rows.append((multiples(G, before - p1), G @ mechanics.velocity(before, q1), G @ mechanics.velocity(p1, q1)))
    return map(np.array, zip(*rows, strict=True))


def _damped(battery: Battery) -> Law | None:
    """Return whether momenta are multiplied by a factor after RATTLE's step, or before it."""
    mechanics, tolerance = battery.mechanics, battery.rounding(CONFIRMED)
    sizes = sorted({point.h for point in battery.points})
    for when, factor_of in (("after", _factor_after), ("before", _factor_before)):
        factors = {h: factor_of(mechanics, [point for point in battery.points if point.h == h]) for h in sizes}
        if all(battery.distance(_damped_step(mechanics, when, factors[x.h], x), x.after) <= tolerance for x in battery.points):
            numbers = ", ".join(f"{factor:.6g} at h = {h:g}" for h, factor in factors.items())
            return Law("momentum_damped", f"the steps are RATTLE's, with momenta multiplied by {numbers} {when} it")
    return None


def _damped_step(mechanics: Mechanics, when: str, factor: float, point: Point) -> State:
    """Return RATTLE's step with momenta multiplied by a factor before it or after it."""
    before, after = (factor, 1.0) if when == "before" else (1.0, factor)
    p1, q1 = attempted(lambda p, q, h: RATTLE(mechanics, before * p, q, h), point.p, point.q, point.h)
    return after * p1, q1


def _factor_after(mechanics: Mechanics, points: Sequence[Point]) -> float:
    right = np.concatenate([_damped_step(mechanics, "after", 1.0, point)[0] for point in points])
    return _factor(right, np.concatenate([point.after[0] for point in points]))


def _factor_before(mechanics: Mechanics, points: Sequence[Point]) -> float:
    given, used = [], []
    for point in points:
        (half, _), G = implied(mechanics, point), mechanics.gradient(point.q)
        given.append(beside(G, point.p))
        used.append(beside(G, half + point.h / 2 * mechanics.slope(half, point.q)))
    return _factor(np.concatenate(given), np.concatenate(used))


def _factor(one: Array, other: Array) -> float:
    """Return the factor of one vector that is nearest to another; one if there is none."""
    factor = float(one @ other / (one @ one)) if np.any(one) else 1.0
    return factor if np.isfinite(factor) else 1.0


def _position_based(battery: Battery) -> Law | None:
    """Return whether positions are put back on the manifold, not along G(q0), and the momentum is that of what they moved."""
    mechanics, tolerance = battery.mechanics, 10 * battery.rounding(CONFIRMED)
    moved = [mechanics.mass(x.after[1]) @ (x.after[1] - x.q) / x.h for x in battery.points]
    momenta = [x.after[0] for x in battery.points]
    factor = _factor(np.concatenate(moved), np.concatenate(momenta))
    rest = largest(factor * np.array(moved) - momenta) / battery.scales[0]
    if rest > tolerance or not SLOWEST < factor < 1 + tolerance or not _put_back(battery):
        return None
    force, rest = _force_beside(battery, moved, ends=False)
    if rest <= tolerance:
        where = f"the impulse is along G(q0), and the force {force:.6g} times the problem's"
        return Law("momentum_at_half_step", f"after every step p1 is M (q1 - q0) / h; {where}")
    damping = "" if factor > 1 - tolerance else f"{factor:.6g} times "
    force, rest = _force_beside(battery, moved, ends=True)
    scaled = f"; the force is {force:.6g} times the problem's" if rest <= tolerance and abs(force - 1) > tolerance else ""
    return Law("position_based", f"after every step p1 is {damping}M (q1 - q0) / h, and q1 is not reached along G(q0){scaled}")


def _projected_after(battery: Battery) -> Law | None:
    """Return whether the momentum is that of a step without constraints, projected at q1, and q1 is on the manifold."""
    if battery.off_manifold > battery.rounding(CONSTANT):
        return None
    tolerance = battery.rounding(CONFIRMED)
    for (label, before, _), (how, momenta) in product(UNPROJECTED, MOMENTA.items()):
        apart = _apart(battery, before, momenta, tolerance)
        # where a step hardly leaves the manifold, its momentum shows no projection
        if apart <= tolerance and _apart(battery, before, as_it_is) > TIMES * max(apart, battery.eps):
            return Law("projected_after", f"p1 is that of {label}{how}, projected at q1, which is reached in another way than along G(q0)")
    return None


def _apart(battery: Battery, before: Step, momenta: Momenta, enough: float = FAILED) -> float:
    """Return how far the momenta of a step that are projected at q1 are from the code's, see :meth:`Battery.deviation_of`."""
    steps = ((partial(_momentum_at, battery.mechanics, before, momenta, x), x) for x in battery.points)
    return battery.deviation_of((attempted(step, x.p, x.q, x.h) for step, x in steps), enough)


def _momentum_at(mechanics: Mechanics, before: Step, momenta: Momenta, point: Point, p: Array, q: Array, h: float) -> State:
    q1 = point.after[1]
    return momenta(mechanics, before(mechanics, p, q, h)[0], q1), q1


def _put_back(battery: Battery) -> bool:
    """Return whether positions are nearer to the manifold than they would be without constraints."""
    mechanics = battery.mechanics
    free = max(mechanics.distance(drift(mechanics, x.p, x.q, x.h)) for x in battery.points)
    return max(mechanics.distance(x.after[1]) for x in battery.points) <= BACK * free


def _force_beside(battery: Battery, moved: Sequence[Array], *, ends: bool) -> tuple[float, float]:
    """Return the factor of the force with which momenta change beside the gradients at q1, or q0, and what is left, relative."""
    mechanics, slopes, changes = battery.mechanics, [], []
    for point, momentum in zip(battery.points, moved, strict=True):
        G = mechanics.gradient(point.after[1] if ends else point.q)
        slopes.append(point.h * beside(G, mechanics.slope(point.p, point.q)))
        changes.append(beside(G, point.p - momentum))
    slope, change = np.concatenate(slopes), np.concatenate(changes)
    factor = _factor(slope, change) if np.any(slope) else 1.0
    return factor, largest(change - factor * slope) / battery.scales[0]


def force_factor(battery: Battery, step: Map) -> float | None:
    """Return how many times the problem's force a code has, None where it is the problem's, or no multiple of it.

    It shows as h goes to zero, and is then refined from the impulses of large steps.
    """
    if not battery.mechanics.separable:
        return None
    halves = [implied(battery.mechanics, point)[0] for point in battery.points]
    half, rest = _force_beside(battery, halves, ends=False)
    if battery.single:
        return 2 * half if rest <= battery.rounding(CONFIRMED) else None
    if (factor := _limit_of_force(battery, step)) is None:
        return None
    refined = min((half, 2 * half, float(f"{factor:.4g}")), key=lambda value: abs(value - factor))
    return refined if abs(refined - 1) > FITS else None


def _limit_of_force(battery: Battery, step: Map) -> float | None:
    """Return the factor of the force as h goes to zero, from states of the manifold; None where there is none."""
    mechanics, slopes, changes = battery.mechanics, [], []
    for point in battery.points:
        G = mechanics.gradient(point.q)
        limit = rates(step, point.p, point.q, SMALL * battery.h)
        if limit is not None and mechanics.distance(point.q) <= CONFIRMED * battery.scales[1]:
            slopes.append(beside(G, mechanics.slope(point.p, point.q)))
            changes.append(beside(G, -limit[0]))
    if not slopes or not np.any(slopes):
        return None
    slope, change = np.concatenate(slopes), np.concatenate(changes)
    factor = _factor(slope, change)
    return factor if largest(change - factor * slope) <= FITS * largest(slope, change) else None


LAWS: tuple[Callable[[Battery], Law | None], ...] = (_held_elsewhere, _left_out, _damped, _position_based, _projected_after)
"""Laws that show in the steps of a battery, in the order in which they are tried."""
