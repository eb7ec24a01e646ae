"""Steps with each of the faults of the dictionary."""

import itertools
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any

import numpy as np

from daebench.runs.ivp import Array
from daebench.studies.diagnose.kick_drift_kick import (
    ANEW,
    EUCLIDEAN,
    MATRICES,
    RATTLE,
    KickDriftKick,
    Momenta,
    along_drifted_gradient,
    along_first_gradient,
    along_gradient_between,
    as_it_is,
    changed,
    one_body,
    scaled,
    swept,
    tangent,
    unconstrained,
    without_mass,
)
from daebench.studies.diagnose.mechanics import Mechanics, State, drift
from daebench.studies.diagnose.reduced import INTEGRATORS, LEAVING, SYMPLECTIC, Integrator, nearest

Step = Callable[[Mechanics, Array, Array, float], State]
"""Maps p0, q0 and h to p1 and q1."""

Point = tuple[float, ...]
"""A vector that steps with the same beginning are looked up by."""

Variants = dict[str, Step]
"""Steps with one fault, by what distinguishes them."""


def velocity_for_momentum(mechanics: Mechanics, p: Array, q: Array, h: float, *, given: bool, returned: bool) -> State:
    """Return RATTLE's step with p taken for a velocity where it is given, and a velocity in its place where it is returned."""
    p1, q1 = RATTLE(mechanics, mechanics.mass(q) @ p if given else p, q, h)
    return (mechanics.velocity(p1, q1) if returned else p1), q1


def central_difference(mechanics: Mechanics, p: Array, q: Array, h: float) -> State:
    """Return SHAKE's momentum M (q2 - q0) / 2h and q1."""
    p1, q1 = KickDriftKick(momenta=as_it_is)(mechanics, p, q, h)
    _, q2 = RATTLE(mechanics, p1, q1, h)
    return mechanics.mass(q1) @ (q2 - q) / (2 * h), q1


def difference(mechanics: Mechanics, p: Array, q: Array, h: float) -> State:
    """Return the momentum M (q1 - q0) / h and q1."""
    _, q1 = RATTLE(mechanics, p, q, h)
    return mechanics.mass(q1) @ (q1 - q) / h, q1


def steps_apart(mechanics: Mechanics, p: Array, q: Array, h: float, *, of_p: int, of_q: int) -> State:
    """Return the momentum after some steps of RATTLE, and the position after others."""
    states = [(p, q)]
    for _ in range(max(of_p, of_q)):
        states.append(RATTLE(mechanics, *states[-1], h))
    return states[of_p][0], states[of_q][1]


def damped(mechanics: Mechanics, p: Array, q: Array, h: float, *, before: float = 1.0, after: float = 1.0) -> State:
    """Return a step of RATTLE whose momentum is multiplied by a factor before it or after it."""
    p1, q1 = RATTLE(mechanics, before * p, q, h)
    return after * p1, q1


def pulling_only(mechanics: Mechanics, p: Array, q: Array, h: float) -> State:
    """Return a step of RATTLE with each constraint left out whose multiplier is negative."""
    kicked = p - h / 2 * mechanics.slope(p, q)
    away = mechanics.inverse_mass(q) @ mechanics.gradient(q).T
    lam = np.linalg.lstsq(away, drift(mechanics, kicked, q, h) - along_first_gradient(mechanics, kicked, q, h)[0], rcond=None)[0]
    return RATTLE(replace(mechanics, rows=np.flatnonzero(lam > 0)), p, q, h)


def position_based(mechanics: Mechanics, p: Array, q: Array, h: float, *, before: float, after: float, gradient: str, mass: bool) -> State:
    """Return a step of position-based dynamics: positions drift, are put back on the manifold, and give the momentum M (q1 - q0) / h.

    Parts of the kick come before the drift and after it.
    """
    q1 = nearest(mechanics, drift(mechanics, p - before * h * mechanics.slope(p, q), q, h), gradient=gradient, mass=mass)
    p1 = mechanics.mass(q1) @ (q1 - q) / h
    return (p1 - after * h * mechanics.slope(p1, q1) if after else p1), q1


KICKED = {"before the drift": (1.0, 0.0), "by half before the drift": (0.5, 0.0), "at the end": (0.0, 1.0)}
"""When position-based dynamics kicks: the parts of the kick before the drift and after it."""

EQUATIONS = {"index-reduced equations": True, "equations without multipliers": False}
"""What is integrated before a projection."""

WHERE = {"of each sweep": "each", "at q1": "end", "before it": "given", "of each sweep, one after the other": "one by one"}
"""Where gradients of a projection are taken."""

METRICS = {"in the metric M": True, "orthogonally": False}
"""In which metric positions are projected."""

MOMENTA: dict[str, Momenta] = {"": tangent, ", momenta orthogonally": EUCLIDEAN, ", positions alone": as_it_is}
"""How momenta are projected."""


def reduced(
    mechanics: Mechanics, p: Array, q: Array, h: float, *, integrator: Integrator, damping: float = 0.0, stiffness: float = 0.0
) -> State:
    """Return a step on the index-reduced equations, damped after Baumgarte or not."""
    return integrator(mechanics, partial(mechanics.reduced_slope, damping=damping, stiffness=stiffness), p, q, h)


def projected(mechanics: Mechanics, p: Array, q: Array, h: float, *, before: Step, gradient: str, mass: bool, momenta: Momenta) -> State:
    """Return a step without constraints, or on the index-reduced equations, then projected."""
    p1, q1 = before(mechanics, p, q, h)
    q1 = _projected_position(mechanics, tuple(q1), gradient, mass)
    return momenta(mechanics, p1, q1), q1


def unprojected(mechanics: Mechanics, p: Array, q: Array, h: float, *, integrator: Integrator, constrained: bool) -> State:
    """Return a step before it is projected."""
    return _before_projection(mechanics, integrator, constrained, tuple(p), tuple(q), h)


@lru_cache(maxsize=256)
def _before_projection(mechanics: Mechanics, integrator: Integrator, constrained: bool, p: Point, q: Point, h: float) -> State:
    return integrator(mechanics, mechanics.reduced_slope if constrained else mechanics.slope, np.array(p), np.array(q), h)


@lru_cache(maxsize=2048)
def _projected_position(mechanics: Mechanics, q: Point, gradient: str, mass: bool) -> Array:
    return nearest(mechanics, np.array(q), gradient=gradient, mass=mass)


UNPROJECTED: list[tuple[str, Step, bool]] = [
    (f"{name} on the {equations}", partial(unprojected, integrator=step, constrained=constrained), constrained)
    for (name, step), (equations, constrained) in itertools.product(LEAVING.items(), EQUATIONS.items())
]
"""Steps before they are projected, and whether they are of the index-reduced equations."""

AFTERWARDS: Variants = {
    f"{name}, projected {metric} along the gradients {where}{how}": partial(
        projected, before=before, gradient=gradient, mass=mass, momenta=momenta
    )
    for (name, before, constrained), (where, gradient), (metric, mass), (how, momenta) in itertools.product(
        UNPROJECTED, WHERE.items(), METRICS.items(), MOMENTA.items()
    )
    if constrained or gradient != "end" or not mass or momenta is not tangent
}
"""Steps that end with a projection; along G(q1) in the metric M without multipliers before it is another fault."""

PUT_BACK: Variants = {
    f"kicked {when}, positions put back {metric} along the gradients {where}": partial(
        position_based, before=before, after=after, gradient=gradient, mass=mass
    )
    for (when, (before, after)), (where, gradient), (metric, mass) in itertools.product(KICKED.items(), WHERE.items(), METRICS.items())
}
"""Steps of position-based dynamics."""


def on_reduced(integrators: Mapping[str, Integrator], damping: float = 0.0, stiffness: float = 0.0) -> Variants:
    """Return steps on the index-reduced equations, damped with 2 alpha and beta^2."""
    return {name: partial(reduced, integrator=step, damping=damping, stiffness=stiffness) for name, step in integrators.items()}


def baumgarte_variants(damping: float, stiffness: float) -> Variants:
    """Return steps on the equations damped with 2 alpha and beta^2."""
    return on_reduced(INTEGRATORS, damping, stiffness)


def ended_after(sweeps: int) -> Variants:
    """Return steps whose iteration for the positions is ended after some sweeps."""
    return {how: _positions(swept, matrix=matrix, sweeps=sweeps) for how, matrix in MATRICES.items()}


def _positions(function: Callable[..., Any], **given: Any) -> Step:
    return KickDriftKick(positions=partial(function, **given))


def _factor(**factors: float) -> Step:
    return _positions(scaled, **factors)


def _momenta(**given: Any) -> Step:
    return KickDriftKick(momenta=partial(tangent, **given))


def _twice(factor: float) -> Step:
    """Return a step whose multipliers of momenta are all multiplied by a factor."""
    return KickDriftKick(positions=partial(scaled, momentum=factor), momenta=partial(tangent, factor=factor))


def _some(where: str, rows: slice) -> Variants:
    """Return steps that leave out constraints: for both, for the positions, and for the velocities."""
    return {
        where: partial(changed, RATTLE, rows=rows),
        f"{where} for the positions": KickDriftKick(positions=partial(changed, along_first_gradient, rows=rows)),
        f"{where} for the velocities": KickDriftKick(momenta=partial(changed, tangent, rows=rows)),
    }


def _reactions(size: int, *, last: bool) -> Variants:
    """Return steps whose impulses act on one body of each constraint."""
    body = partial(one_body, size=size, last=last)
    where = f"impulses act on the {'last' if last else 'first'} of bodies of {size} positions"
    positions = partial(along_first_gradient, body=body)
    return {
        where: KickDriftKick(positions=positions, momenta=partial(tangent, body=body)),
        f"{where}, for the positions": KickDriftKick(positions=positions),
    }


IMPULSES = (("", False), (", impulse along G(q0)", True))
"""Where an impulse is along other gradients than its positions are reached by."""

MASS_MISSING_IN_DRIFT = {"positions drift with p in place of M^-1 p": _positions(without_mass, drifting=False)}
"""A step that shows two faults, and is told as either."""

FAULTY_STEPS: dict[str, Variants] = {
    "reference_gradient_at_q1": {
        f"positions{how}": _positions(along_gradient_between, part=1.0, impulse_at_start=at_start)
        for how, at_start in ((" and momenta along G(q1)", False), (" along G(q1), momenta along G(q0)", True))
    },
    "reference_gradient_each_sweep": {how: KickDriftKick(positions=positions) for how, positions in ANEW.items()},
    "momentum_not_corrected": {
        "momenta projected at the end": _factor(momentum=0.0),
        "momenta not projected either": KickDriftKick(positions=partial(scaled, momentum=0.0), momenta=as_it_is),
    },
    "velocity_not_projected": {
        "p1 after the second kick": KickDriftKick(momenta=as_it_is),
        "the impulse of the positions taken once more, along G(q1)": KickDriftKick(momenta=as_it_is, impulse_at_end=1.0),
        "p1 = M (q1 - q0) / h": difference,
        "p1 = M (q2 - q0) / (2 h)": central_difference,
    },
    "full_kick": {
        "in the first kick": KickDriftKick(first=1.0),
        "in both kicks": KickDriftKick(first=1.0, second=1.0),
        "in the second kick": KickDriftKick(second=1.0),
    },
    "old_force": {"in the second kick": KickDriftKick(second_at="q0")},
    "one_sweep": ended_after(1),
    "loose_tolerance": {
        f"{how}, until |g| is below 1e-4": _positions(swept, matrix=matrix, tolerance=1e-4) for how, matrix in MATRICES.items()
    },
    "mass_missing_in_position": {
        "momenta along G(q0)^T lam": _positions(without_mass),
        "momenta by M times the displacement": _positions(without_mass, consistent=True),
        **MASS_MISSING_IN_DRIFT,
    },
    "mass_missing_in_velocity": {
        "G p1 = 0": KickDriftKick(momenta=EUCLIDEAN),
        "in the matrix G G^T": _momenta(matrix=False),
        "in the right-hand side G p": _momenta(side=False),
        "velocities projected orthogonally": _momenta(matrix=False, momentum=False),
        "in the correction of the velocity": _momenta(momentum=False),
    },
    "velocity_for_momentum": {
        "p given and returned": partial(velocity_for_momentum, given=True, returned=True),
        "p given": partial(velocity_for_momentum, given=True, returned=False),
        "p returned": partial(velocity_for_momentum, given=False, returned=True),
        "positions drift with p": _positions(without_mass, drifting=False, displacing=True),
        **MASS_MISSING_IN_DRIFT,
    },
    "multiplier_sign": {
        "lam in the momentum": _factor(momentum=-1.0),
        "mu at the end": _momenta(factor=-1.0),
        "lam in the momentum, and mu": _twice(-1.0),
        "lam in the position": _factor(position=-1.0),
        "lam in position and momentum": _factor(position=-1.0, momentum=-1.0),
    },
    "multiplier_half": {
        "half of lam in the momentum": _factor(momentum=0.5),
        "twice lam in the momentum": _factor(momentum=2.0),
        "half of mu at the end": _momenta(factor=0.5),
        "twice mu at the end": _momenta(factor=2.0),
        "half of lam and of mu in the momentum": _twice(0.5),
        "half of lam in the position": _factor(position=0.5),
        "half of lam in position and momentum": _factor(position=0.5, momentum=0.5),
        "twice lam in the position": _factor(position=2.0),
    },
    "index_reduced": on_reduced(SYMPLECTIC),
    "projected_after": AFTERWARDS,
    "baumgarte": on_reduced(SYMPLECTIC, damping=10.0, stiffness=25.0),
    "reference_gradient_after_drift": {
        f"at q0 + {h} v {when} the first kick{how}": _positions(along_drifted_gradient, kick=kick, part=part, impulse_at_start=at_start)
        for (h, part), (when, kick), (how, at_start) in itertools.product(
            (("h", 1.0), ("h/2", 0.5)), (("after", 0.0), ("before", 0.5)), IMPULSES
        )
    },
    "reference_gradient_at_midpoint": {
        f"at (q0 + q1) / 2{how}": _positions(along_gradient_between, part=0.5, impulse_at_start=at_start) for how, at_start in IMPULSES
    },
    "position_based": PUT_BACK,
    "momentum_at_half_step": {
        "momenta p1/2, positions q1": KickDriftKick(first=1.0, second=0.0, momenta=as_it_is),
        "momenta p1/2 after half a kick": KickDriftKick(second=0.0, momenta=as_it_is),
    },
    "velocity_projected_at_q0": {
        "along G(q0)": KickDriftKick(projected_at="q0"),
        "along the gradients before positions are corrected": KickDriftKick(projected_at="free"),
    },
    "velocity_projected_before_kick": {"before the second kick": KickDriftKick(projected_first=True)},
    "force_before_correction": {"in the second kick": KickDriftKick(second_at="free")},
    "kick_missing": {
        "no second kick": KickDriftKick(second=0.0),
        "no first kick": KickDriftKick(first=0.0),
        "no kick": KickDriftKick(first=0.0, second=0.0),
        "one kick of h, at q1": KickDriftKick(first=0.0, second=1.0),
    },
    "position_without_force": {"q drifts with p0": KickDriftKick(kicked_first=False)},
    "multiplier_times_h": {
        "h times lam in the momentum": _positions(scaled, power=1),
        "h^2 times lam in the momentum": _positions(scaled, power=2),
        "lam / h in the momentum": _positions(scaled, power=-1),
    },
    "multiplier_clamped": {"negative multipliers left out": pulling_only},
    "constraint_missing": {
        **_some("the last one", slice(None, -1)),
        **_some("the first one", slice(1, None)),
        "all of them": KickDriftKick(positions=unconstrained, momenta=as_it_is),
        "all of them for the positions": KickDriftKick(positions=unconstrained),
    },
    "constraint_shifted": {"g = 0.01": partial(changed, RATTLE, target=0.01)},
    "reaction_missing": {
        how: step for size, last in itertools.product((2, 3), (True, False)) for how, step in _reactions(size, last=last).items()
    },
    "force_scaled": {"twice the force": partial(changed, RATTLE, force=2.0)},
    "other_equations": {
        "no force on the last position": lambda mechanics, p, q, h: changed(
            RATTLE, mechanics, p, q, h, force=np.append(np.ones(len(q) - 1), 0.0)
        )
    },
    "momentum_damped": {"after the step": partial(damped, after=0.99), "before the step": partial(damped, before=0.99)},
    "step_size_ignored": {"h = 0.01": lambda mechanics, p, q, _: RATTLE(mechanics, p, q, 0.01)},
    "step_off_by_one": {
        "two steps in place of one": partial(steps_apart, of_p=2, of_q=2),
        "no step in place of one": partial(steps_apart, of_p=0, of_q=0),
        "a step of 2 h": lambda mechanics, p, q, h: RATTLE(mechanics, p, q, 2 * h),
        "a step of h / 2": lambda mechanics, p, q, h: RATTLE(mechanics, p, q, h / 2),
        "momenta a step behind": partial(steps_apart, of_p=0, of_q=1),
        "positions a step behind": partial(steps_apart, of_p=1, of_q=0),
        "momenta a step ahead": partial(steps_apart, of_p=2, of_q=1),
        "positions a step ahead": partial(steps_apart, of_p=1, of_q=2),
    },
}
"""Steps with each of the faults of :data:`daebench.studies.diagnose.dictionary.FAULTS`, by what distinguishes them; the first is the
common one."""
