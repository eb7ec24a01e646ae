"""Steps with each of the faults of the dictionary."""

import itertools
from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache, partial

import numpy as np

from daebench.runs.ivp import Array
from daebench.studies.diagnose import kicks
from daebench.studies.diagnose.kicks import RATTLE, KickDriftKick
from daebench.studies.diagnose.mechanics import Mechanics, State
from daebench.studies.diagnose.positions import (
    ANEW,
    MATRICES,
    along_last_gradient,
    scaled,
    swept,
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
    "old_force": {"in the second kick": KickDriftKick(old_force=True)},
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
