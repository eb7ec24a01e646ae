"""Steps with each of the faults of the dictionary."""

import itertools
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any

import numpy as np

from daebench.runs.ivp import Array
from daebench.studies.diagnose import kicks
from daebench.studies.diagnose.kicks import RATTLE, KickDriftKick
from daebench.studies.diagnose.mechanics import Mechanics, State, drift
from daebench.studies.diagnose.positions import (
    ANEW,
    MATRICES,
    acting_on_one,
    along_drifted_gradient,
    along_first_gradient,
    along_gradient_between,
    along_last_gradient,
    fewer_met,
    scaled,
    swept,
    timed,
    unconstrained,
    without_mass,
)
from daebench.studies.diagnose.reduced import INTEGRATORS, LEAVING, SYMPLECTIC, Integrator, nearest

Step = Callable[[Mechanics, Array, Array, float], State]
"""Maps p0, q0 and h to p1 and q1."""

P_FOR_V = "positions drift with p in place of M^-1 p"
"""A step that shows two faults, and is told as either."""

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
    p1, q1 = KickDriftKick(momenta=kicks.as_it_is)(mechanics, p, q, h)
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


def longer(mechanics: Mechanics, p: Array, q: Array, h: float, *, times: float) -> State:
    """Return a step of RATTLE of another size."""
    return RATTLE(mechanics, p, q, times * h)


def with_other(mechanics: Mechanics, p: Array, q: Array, h: float, *, step: Step = RATTLE, **changes: Any) -> State:
    """Return a step of a problem with another force, fewer constraints, or another value of them, see :class:`Mechanics`."""
    return step(replace(mechanics, **changes), p, q, h)


def without_last_force(mechanics: Mechanics, p: Array, q: Array, h: float) -> State:
    """Return a step of RATTLE under the force without its last component."""
    return with_other(mechanics, p, q, h, force=np.append(np.ones(len(q) - 1), 0.0))


def damped(mechanics: Mechanics, p: Array, q: Array, h: float, *, factor: float, before: bool) -> State:
    """Return a step of RATTLE whose momentum is multiplied by a factor before it or after it."""
    p1, q1 = RATTLE(mechanics, factor * p if before else p, q, h)
    return (p1 if before else factor * p1), q1


def of_one_size(mechanics: Mechanics, p: Array, q: Array, h: float, *, size: float) -> State:
    """Return a step of RATTLE of one size, whatever h is."""
    return RATTLE(mechanics, p, q, size)


def pulling_only(mechanics: Mechanics, p: Array, q: Array, h: float) -> State:
    """Return a step of RATTLE with each constraint left out whose multiplier is negative."""
    half, _ = along_first_gradient(mechanics, p - h / 2 * mechanics.slope(p, q), q, h)
    G = mechanics.gradient(q)
    free = drift(mechanics, p - h / 2 * mechanics.slope(p, q), q, h)
    lam = np.linalg.lstsq(mechanics.inverse_mass(q) @ G.T, free - half, rcond=None)[0]
    taut = [k for k, value in enumerate(lam) if value > 0]
    return RATTLE(replace(mechanics, rows=np.array(taut, dtype=int)), p, q, h)


def position_based(mechanics: Mechanics, p: Array, q: Array, h: float, *, kick: str, gradient: str, mass: bool) -> State:
    """Return a step of position-based dynamics: positions drift, are put back on the manifold, and give the momentum M (q1 - q0) / h."""
    kicked = p - {"before": h, "half": h / 2, "after": 0.0}[kick] * mechanics.slope(p, q)
    q1 = nearest(mechanics, drift(mechanics, kicked, q, h), gradient=gradient, mass=mass)
    p1 = mechanics.mass(q1) @ (q1 - q) / h
    return (p1 - h * mechanics.slope(p1, q1) if kick == "after" else p1), q1


def _position_based() -> Iterator[tuple[str, Step]]:
    for (when, kick), (where, gradient), (metric, mass) in itertools.product(KICKED.items(), WHERE.items(), METRICS.items()):
        label = f"kicked {when}, positions put back {metric} along the gradients {where}"
        yield label, partial(position_based, kick=kick, gradient=gradient, mass=mass)


KICKED = {"before the drift": "before", "by half before the drift": "half", "at the end": "after"}
"""When position-based dynamics kicks."""


def reduced(
    mechanics: Mechanics, p: Array, q: Array, h: float, *, integrator: Integrator, damping: float = 0.0, stiffness: float = 0.0
) -> State:
    """Return a step on the index-reduced equations, damped after Baumgarte or not."""
    return integrator(mechanics, partial(mechanics.reduced_slope, damping=damping, stiffness=stiffness), p, q, h)


def projected(
    mechanics: Mechanics,
    p: Array,
    q: Array,
    h: float,
    *,
    integrator: Integrator,
    constrained: bool,
    gradient: str,
    mass: bool,
    momenta: kicks.Momenta,
) -> State:
    """Return a step without constraints, or on the index-reduced equations, then projected."""
    p1, q1 = _before_projection(mechanics, integrator, constrained, tuple(p), tuple(q), h)
    q1 = _projected_position(mechanics, tuple(q1), gradient, mass)
    return momenta(mechanics, p1, q1), q1


@lru_cache(maxsize=256)
def _before_projection(mechanics: Mechanics, integrator: Integrator, constrained: bool, p: Point, q: Point, h: float) -> State:
    return integrator(mechanics, mechanics.reduced_slope if constrained else mechanics.slope, np.array(p), np.array(q), h)


@lru_cache(maxsize=2048)
def _projected_position(mechanics: Mechanics, q: Point, gradient: str, mass: bool) -> Array:
    return nearest(mechanics, np.array(q), gradient=gradient, mass=mass)


def _projected() -> Iterator[tuple[str, Step]]:
    """Yield steps that end with a projection; along G(q1) in the metric M without multipliers before it is another fault."""
    ways = itertools.product(LEAVING.items(), EQUATIONS.items(), WHERE.items(), METRICS.items(), MOMENTA.items())
    for (name, step), (equations, constrained), (where, gradient), (metric, mass), (how, momenta) in ways:
        if constrained or gradient != "end" or not mass or momenta is not kicks.tangent:
            label = f"{name} on the {equations}, projected {metric} along the gradients {where}{how}"
            yield label, partial(projected, integrator=step, constrained=constrained, gradient=gradient, mass=mass, momenta=momenta)


EQUATIONS = {"index-reduced equations": True, "equations without multipliers": False}
"""What is integrated before a projection."""

WHERE = {"of each sweep": "each", "at q1": "end", "before it": "given", "of each sweep, one after the other": "one by one"}
"""Where gradients of a projection are taken."""

METRICS = {"in the metric M": True, "orthogonally": False}
"""In which metric positions are projected."""

MOMENTA: dict[str, kicks.Momenta] = {"": kicks.tangent, ", momenta orthogonally": kicks.euclidean, ", positions alone": kicks.as_it_is}
"""How momenta are projected."""


def _unprojected(mechanics: Mechanics, p: Array, q: Array, h: float, *, integrator: Integrator, constrained: bool) -> State:
    return _before_projection(mechanics, integrator, constrained, tuple(p), tuple(q), h)


UNPROJECTED: list[tuple[str, Step, kicks.Momenta]] = [
    (f"{name} on the {equations}{how}", partial(_unprojected, integrator=step, constrained=constrained), momenta)
    for (name, step), (equations, constrained), (how, momenta) in itertools.product(LEAVING.items(), EQUATIONS.items(), MOMENTA.items())
    if momenta is not kicks.as_it_is
]
"""Steps before they are projected, and how momenta are."""


def _on_reduced(integrators: Mapping[str, Integrator], damping: float = 0.0, stiffness: float = 0.0) -> Variants:
    return {name: partial(reduced, integrator=step, damping=damping, stiffness=stiffness) for name, step in integrators.items()}


def _factor(*, position: float = 1.0, momentum: float = 1.0) -> Step:
    return KickDriftKick(positions=partial(scaled, position=position, momentum=momentum))


def ended_after(sweeps: int) -> Variants:
    """Return steps whose iteration for the positions is ended after some sweeps."""
    return {how: KickDriftKick(positions=partial(swept, matrix=matrix, sweeps=sweeps)) for how, matrix in MATRICES.items()}


def _twice(factor: float) -> Step:
    """Return a step whose multipliers of momenta are all multiplied by a factor."""
    return KickDriftKick(positions=partial(scaled, momentum=factor), momenta=partial(kicks.tangent, factor=factor))


def _projection(factor: float) -> Step:
    return KickDriftKick(momenta=partial(kicks.tangent, factor=factor))


FAULTY_STEPS: dict[str, Variants] = {
    "reference_gradient_at_q1": {
        "positions and momenta along G(q1)": KickDriftKick(positions=along_last_gradient),
        "positions along G(q1), momenta along G(q0)": KickDriftKick(positions=partial(along_last_gradient, impulse_at_start=True)),
    },
    "reference_gradient_each_sweep": {how: KickDriftKick(positions=positions) for how, positions in ANEW.items()},
    "momentum_not_corrected": {
        "momenta projected at the end": _factor(momentum=0.0),
        "momenta not projected either": KickDriftKick(positions=partial(scaled, momentum=0.0), momenta=kicks.as_it_is),
    },
    "velocity_not_projected": {
        "p1 after the second kick": KickDriftKick(momenta=kicks.as_it_is),
        "the impulse of the positions taken once more, along G(q1)": KickDriftKick(momenta=kicks.as_it_is, impulse_at_end=1.0),
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
        f"{how}, until |g| is below 1e-4": KickDriftKick(positions=partial(swept, matrix=matrix, tolerance=1e-4))
        for how, matrix in MATRICES.items()
    },
    "mass_missing_in_position": {
        "momenta along G(q0)^T lam": KickDriftKick(positions=without_mass),
        "momenta by M times the displacement": KickDriftKick(positions=partial(without_mass, consistent=True)),
        P_FOR_V: KickDriftKick(positions=partial(without_mass, drifting=False)),
    },
    "mass_missing_in_velocity": {
        "G p1 = 0": KickDriftKick(momenta=kicks.euclidean),
        "in the matrix G G^T": KickDriftKick(momenta=kicks.wrong_matrix),
        "in the right-hand side G p": KickDriftKick(momenta=kicks.wrong_side),
        "velocities projected orthogonally": KickDriftKick(momenta=kicks.orthogonal_velocity),
        "in the correction of the velocity": KickDriftKick(momenta=kicks.weighted_velocity),
    },
    "velocity_for_momentum": {
        "p given and returned": partial(velocity_for_momentum, given=True, returned=True),
        "p given": partial(velocity_for_momentum, given=True, returned=False),
        "p returned": partial(velocity_for_momentum, given=False, returned=True),
        "positions drift with p": KickDriftKick(positions=partial(without_mass, drifting=False, displacing=True)),
        P_FOR_V: KickDriftKick(positions=partial(without_mass, drifting=False)),
    },
    "multiplier_sign": {
        "lam in the momentum": _factor(momentum=-1.0),
        "mu at the end": _projection(-1.0),
        "lam in the momentum, and mu": _twice(-1.0),
        "lam in the position": _factor(position=-1.0),
        "lam in position and momentum": _factor(position=-1.0, momentum=-1.0),
    },
    "multiplier_half": {
        "half of lam in the momentum": _factor(momentum=0.5),
        "twice lam in the momentum": _factor(momentum=2.0),
        "half of mu at the end": _projection(0.5),
        "twice mu at the end": _projection(2.0),
        "half of lam and of mu in the momentum": _twice(0.5),
        "half of lam in the position": _factor(position=0.5),
        "half of lam in position and momentum": _factor(position=0.5, momentum=0.5),
        "twice lam in the position": _factor(position=2.0),
    },
    "index_reduced": _on_reduced(SYMPLECTIC),
    "projected_after": dict(_projected()),
    "baumgarte": _on_reduced(SYMPLECTIC, damping=10.0, stiffness=25.0),
    "reference_gradient_after_drift": {
        f"{where}{how}": KickDriftKick(positions=partial(along_drifted_gradient, kick=kick, part=part, impulse_at_start=at_start))
        for where, kick, part in (
            ("at q0 + h v after the first kick", 0.0, 1.0),
            ("at q0 + h v before the first kick", 0.5, 1.0),
            ("at q0 + h/2 v after the first kick", 0.0, 0.5),
            ("at q0 + h/2 v before the first kick", 0.5, 0.5),
        )
        for how, at_start in (("", False), (", impulse along G(q0)", True))
    },
    "reference_gradient_at_midpoint": {
        f"at (q0 + q1) / 2{how}": KickDriftKick(positions=partial(along_gradient_between, part=0.5, impulse_at_start=at_start))
        for how, at_start in (("", False), (", impulse along G(q0)", True))
    },
    "position_based": dict(_position_based()),
    "momentum_at_half_step": {
        "momenta p1/2, positions q1": KickDriftKick(first=1.0, second=0.0, momenta=kicks.as_it_is),
        "momenta p1/2 after half a kick": KickDriftKick(second=0.0, momenta=kicks.as_it_is),
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
        "h times lam in the momentum": KickDriftKick(positions=partial(timed, power=1)),
        "h^2 times lam in the momentum": KickDriftKick(positions=partial(timed, power=2)),
        "lam / h in the momentum": KickDriftKick(positions=partial(timed, power=-1)),
    },
    "multiplier_clamped": {"negative multipliers left out": pulling_only},
    "constraint_missing": {
        "the last one": partial(with_other, rows=slice(None, -1)),
        "the first one": partial(with_other, rows=slice(1, None)),
        "all of them": KickDriftKick(positions=unconstrained, momenta=kicks.as_it_is),
        "all of them for the positions": KickDriftKick(positions=unconstrained),
        "the last one for the positions": KickDriftKick(positions=partial(fewer_met, rows=slice(None, -1))),
        "the first one for the positions": KickDriftKick(positions=partial(fewer_met, rows=slice(1, None))),
        "the last one for the velocities": KickDriftKick(momenta=partial(kicks.fewer_tangent, rows=slice(None, -1))),
        "the first one for the velocities": KickDriftKick(momenta=partial(kicks.fewer_tangent, rows=slice(1, None))),
    },
    "constraint_shifted": {"g = 0.01": partial(with_other, target=0.01)},
    "reaction_missing": {
        f"impulses act on the {'last' if last else 'first'} of bodies of {size} positions{where}": KickDriftKick(
            positions=partial(acting_on_one, size=size, last=last), momenta=momenta
        )
        for size, last in itertools.product((2, 3), (True, False))
        for where, momenta in (("", partial(kicks.on_one, size=size, last=last)), (", for the positions", kicks.tangent))
    },
    "force_scaled": {"twice the force": partial(with_other, force=2.0)},
    "other_equations": {"no force on the last position": without_last_force},
    "momentum_damped": {
        "after the step": partial(damped, factor=0.99, before=False),
        "before the step": partial(damped, factor=0.99, before=True),
    },
    "step_size_ignored": {"h = 0.01": partial(of_one_size, size=0.01)},
    "step_off_by_one": {
        "two steps in place of one": partial(steps_apart, of_p=2, of_q=2),
        "no step in place of one": partial(steps_apart, of_p=0, of_q=0),
        "a step of 2 h": partial(longer, times=2.0),
        "a step of h / 2": partial(longer, times=0.5),
        "momenta a step behind": partial(steps_apart, of_p=0, of_q=1),
        "positions a step behind": partial(steps_apart, of_p=1, of_q=0),
        "momenta a step ahead": partial(steps_apart, of_p=2, of_q=1),
        "positions a step ahead": partial(steps_apart, of_p=1, of_q=2),
    },
}
"""Steps with each of the faults of :data:`daebench.studies.diagnose.dictionary.FAULTS`, by what distinguishes them; the first is the
common one."""


def baumgarte_variants(damping: float, stiffness: float) -> Variants:
    """Return steps on the equations damped with 2 alpha and beta^2."""
    return _on_reduced(INTEGRATORS, damping, stiffness)
