"""Integrators of equations without constraints: the index-reduced ones, (1.12) put into (1.8), or those without multipliers."""

from collections.abc import Callable
from functools import partial

import numpy as np

from daebench.runs.ivp import Array
from daebench.studies.diagnose.kick_drift_kick import MEETING
from daebench.studies.diagnose.mechanics import SETTLED, Mechanics, State, drift, iterated, largest

Slope = Callable[[Array, Array], Array]
"""Minus p', of p and q."""

Integrator = Callable[[Mechanics, Slope, Array, Array, float], State]
"""Maps p0, q0 and h to p1 and q1."""


def kicked(slope: Slope, p0: Array, q: Array, h: float, at: float = 0.0) -> Array:
    """Return the momentum after a kick whose force is that of p0 (0), p1 (1), or between them."""
    explicit = p0 - h * slope(p0, q)
    return iterated(lambda p1: p0 - h * slope((1 - at) * p0 + at * p1, q), explicit) if at else explicit


def verlet(mechanics: Mechanics, slope: Slope, p0: Array, q0: Array, h: float, *, first: float = 0.0, second: float = 0.0) -> State:
    """Kick, drift, kick; for each kick, see :func:`kicked`."""
    p = kicked(slope, p0, q0, h / 2, first)
    q1 = drift(mechanics, p, q0, h)
    return kicked(slope, p, q1, h / 2, second), q1


def velocity_verlet(mechanics: Mechanics, slope: Slope, p0: Array, q0: Array, h: float, *, predicted: bool = True) -> State:
    """Kick, drift, kick; the second kick is computed with a momentum that is predicted from p0, or with p0."""
    p = kicked(slope, p0, q0, h / 2)
    q1 = drift(mechanics, p, q0, h)
    return p - h / 2 * slope(kicked(slope, p0, q0, h) if predicted else p0, q1), q1


def position_verlet(mechanics: Mechanics, slope: Slope, p0: Array, q0: Array, h: float, *, at: float = 0.0) -> State:
    """Drift, kick, drift; for the kick, see :func:`kicked`."""
    q = q0 + h / 2 * mechanics.velocity(p0, q0)
    p1 = kicked(slope, p0, q, h, at)
    return p1, q + h / 2 * mechanics.velocity(p1, q)


def symplectic_euler(mechanics: Mechanics, slope: Slope, p0: Array, q0: Array, h: float, *, at: float = 0.0) -> State:
    """Kick and drift; for the kick, see :func:`kicked`."""
    p1 = kicked(slope, p0, q0, h, at)
    return p1, q0 + h * mechanics.velocity(p1, q0)


def adjoint_euler(mechanics: Mechanics, slope: Slope, p0: Array, q0: Array, h: float, *, at: float = 0.0) -> State:
    """Drift and kick; for the kick, see :func:`kicked`."""
    q1 = q0 + h * mechanics.velocity(p0, q0)
    return kicked(slope, p0, q1, h, at), q1


def _field(mechanics: Mechanics, slope: Slope, y: Array) -> Array:
    """Return p' and q' of y = (p, q)."""
    p, q = np.split(y, 2)
    return np.concatenate([-slope(p, q), mechanics.velocity(p, q)])


def midpoint(mechanics: Mechanics, slope: Slope, p0: Array, q0: Array, h: float) -> State:
    """Return the step of the implicit midpoint rule."""
    y0 = np.concatenate([p0, q0])
    p1, q1 = np.split(iterated(lambda y: y0 + h * _field(mechanics, slope, (y0 + y) / 2), y0), 2)
    return p1, q1


def runge_kutta(
    mechanics: Mechanics, slope: Slope, p0: Array, q0: Array, h: float, *, nodes: tuple[float, ...], weights: tuple[float, ...]
) -> State:
    """Return the step of an explicit Runge-Kutta method each of whose stages takes the one before it alone, HLW II.1.1.

    ``nodes`` are the factors of each stage in the argument of the next.
    """
    y = y0 = np.concatenate([p0, q0])
    increment = np.zeros_like(y0)
    for node, weight in zip(nodes, weights, strict=True):
        k = _field(mechanics, slope, y)
        y, increment = y0 + node * h * k, increment + weight * h * k
    p1, q1 = np.split(y0 + increment, 2)
    return p1, q1


def taylor(mechanics: Mechanics, slope: Slope, p0: Array, q0: Array, h: float) -> State:
    """Return p and q with the force at the start of the step, q to second order."""
    return kicked(slope, p0, q0, h), drift(mechanics, kicked(slope, p0, q0, h / 2), q0, h)


SYMPLECTIC: dict[str, Integrator] = {
    "Störmer-Verlet": verlet,
    "Störmer-Verlet, second kick implicit": partial(verlet, second=1.0),
    "Störmer-Verlet, first kick implicit": partial(verlet, first=1.0),
    "Störmer-Verlet, both kicks implicit": partial(verlet, first=1.0, second=1.0),
    "velocity Verlet": velocity_verlet,
    "Störmer-Verlet, both kicks with the first momentum": partial(velocity_verlet, predicted=False),
    "position Verlet": position_verlet,
    "position Verlet, kick with the mean momentum": partial(position_verlet, at=0.5),
    "position Verlet, kick implicit": partial(position_verlet, at=1.0),
    "the implicit midpoint rule": midpoint,
    "symplectic Euler, explicit": symplectic_euler,
    "the adjoint of symplectic Euler, explicit": adjoint_euler,
    "the adjoint of symplectic Euler": partial(adjoint_euler, at=1.0),
}
"""Integrators that are symplectic for H = T(p) + U(q), or for any H, and their explicit look-alikes. Symplectic Euler as HLW (1.18)
is a scheme of daebench, ``se``."""

INTEGRATORS: dict[str, Integrator] = {
    **SYMPLECTIC,
    "symplectic Euler": partial(symplectic_euler, at=1.0),
    "a Taylor step": taylor,
    "explicit Euler": partial(runge_kutta, nodes=(0.0,), weights=(1.0,)),
    "Heun's method": partial(runge_kutta, nodes=(1.0, 0.0), weights=(1 / 2, 1 / 2)),
    "the explicit midpoint rule": partial(runge_kutta, nodes=(1 / 2, 0.0), weights=(0.0, 1.0)),
    "the classical Runge-Kutta method": partial(runge_kutta, nodes=(1 / 2, 1 / 2, 1.0, 0.0), weights=(1 / 6, 1 / 3, 1 / 3, 1 / 6)),
}
"""All of them."""

LEAVING = {name: step for name, step in INTEGRATORS.items() if "first kick implicit" not in name and "both kicks implicit" not in name}
"""Those that leave the manifold. With lam such that the velocity after the first kick meets g'' = 0, q1 is on a manifold of quadratic
constraints: on such Störmer-Verlet with an implicit first kick is RATTLE."""


def nearest(mechanics: Mechanics, q: Array, *, gradient: str, mass: bool) -> Array:
    """Return a point of the manifold near q, along gradients at q ("given"), at the point ("end"), or of each sweep."""
    W = mechanics.inverse_mass(q) if mass else np.eye(len(q))

    def moved(x: Array, G: Array) -> Array:
        return np.asarray(np.linalg.solve(mechanics.gradient(x) @ W @ G.T, mechanics.constraint(x)), dtype=float)

    if gradient == "each":
        return iterated(lambda x: x - W @ mechanics.gradient(x).T @ moved(x, mechanics.gradient(x)), q)
    if gradient == "one by one":
        return iterated(partial(_one_by_one, mechanics, W), q)

    def along(G: Array) -> Array:
        nu = np.zeros(len(G))

        def sweep(x: Array) -> Array:
            nonlocal nu
            nu = nu + moved(x, G)
            return q - W @ G.T @ nu

        return iterated(sweep, q)

    given = along(mechanics.gradient(q))
    return given if gradient == "given" else iterated(lambda x: along(mechanics.gradient(x)), given)


def _one_by_one(mechanics: Mechanics, W: Array, x: Array) -> Array:
    for k in range(mechanics.ivp.m):
        along = W @ mechanics.gradient(x)[k]
        for _ in range(MEETING):
            if abs(g := mechanics.constraint(x)[k]) <= SETTLED * largest(x):
                break
            x = x - along * g / (mechanics.gradient(x)[k] @ along)
    return x
