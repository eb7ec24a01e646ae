"""Integrators of equations without constraints: the index-reduced ones, (1.12) put into (1.8), or those without multipliers."""

from collections.abc import Callable
from functools import partial

import numpy as np

from daebench.runs.ivp import Array
from daebench.studies.diagnose.mechanics import ITERATIONS, SETTLED, Mechanics, State, drift, iterated, settled
from daebench.studies.diagnose.positions import MEETING

Slope = Callable[[Array, Array], Array]
"""Minus p', of p and q."""

Tableau = tuple[tuple[float, ...], tuple[float, ...]]
"""Factors and weights, see :data:`TABLEAUX`."""

Integrator = Callable[[Mechanics, Slope, Array, Array, float], State]
"""Maps p0, q0 and h to p1 and q1."""


def verlet(
    mechanics: Mechanics, slope: Slope, p0: Array, q0: Array, h: float, *, first: str = "explicit", second: str = "explicit"
) -> State:
    """Kick, drift, kick; each kick computed with the momentum before it, or with that after it where it is "implicit"."""
    explicit = p0 - h / 2 * slope(p0, q0)
    p = iterated(lambda p: p0 - h / 2 * slope(p, q0), explicit) if first == "implicit" else explicit
    q1 = drift(mechanics, p, q0, h)
    if second == "implicit":
        return iterated(lambda p1: p - h / 2 * slope(p1, q1), p), q1
    if second == "predicted":
        return p - h / 2 * slope(p0 - h * slope(p0, q0), q1), q1
    if second == "start":
        return p - h / 2 * slope(p0, q1), q1
    return p - h / 2 * slope(p, q1), q1


def position_verlet(mechanics: Mechanics, slope: Slope, p0: Array, q0: Array, h: float, *, kick: str = "explicit") -> State:
    """Drift, kick, drift; the kick with the momentum before it, the mean of both, or that after it."""
    q = q0 + h / 2 * mechanics.velocity(p0, q0)
    at = {"explicit": 0.0, "mean": 0.5, "implicit": 1.0}[kick]
    p1 = iterated(lambda p: p0 - h * slope((1 - at) * p0 + at * p, q), p0)
    return p1, q + h / 2 * mechanics.velocity(p1, q)


def symplectic_euler(mechanics: Mechanics, slope: Slope, p0: Array, q0: Array, h: float, *, order: str = "p, q") -> State:
    """Kick and drift, or drift and kick, the kick with the momentum before it, or that after it ("p1, q" and "q, p1")."""
    if order in ("p, q", "p1, q"):
        p1 = p0 - h * slope(p0, q0)
        if order == "p1, q":
            p1 = iterated(lambda p: p0 - h * slope(p, q0), p1)
        return p1, q0 + h * mechanics.velocity(p1, q0)
    q1 = q0 + h * mechanics.velocity(p0, q0)
    if order == "q, p1":
        return iterated(lambda p: p0 - h * slope(p, q1), p0), q1
    return p0 - h * slope(p0, q1), q1


def midpoint(mechanics: Mechanics, slope: Slope, p0: Array, q0: Array, h: float) -> State:
    """Return the step of the implicit midpoint rule."""
    d, y0 = len(p0), np.concatenate([p0, q0])

    def stage(y: Array) -> Array:
        p, q = (y0[:d] + y[:d]) / 2, (y0[d:] + y[d:]) / 2
        return y0 + h * np.concatenate([-slope(p, q), mechanics.velocity(p, q)])

    y = iterated(stage, y0)
    return y[:d], y[d:]


def runge_kutta(mechanics: Mechanics, slope: Slope, p0: Array, q0: Array, h: float, *, tableau: Tableau) -> State:
    """Return the step of an explicit Runge-Kutta method each of whose stages takes the one before it alone, HLW II.1.1."""
    d, y0 = len(p0), np.concatenate([p0, q0])
    nodes, weights = tableau
    y, increment = y0, np.zeros_like(y0)
    for node, weight in zip(nodes, weights, strict=True):
        k = np.concatenate([-slope(y[:d], y[d:]), mechanics.velocity(y[:d], y[d:])])
        y, increment = y0 + node * h * k, increment + weight * h * k
    return y0[:d] + increment[:d], y0[d:] + increment[d:]


def taylor(mechanics: Mechanics, slope: Slope, p0: Array, q0: Array, h: float) -> State:
    """Return p and q with the force at the start of the step, q to second order."""
    force = slope(p0, q0)
    return p0 - h * force, drift(mechanics, p0 - h / 2 * force, q0, h)


SYMPLECTIC: dict[str, Integrator] = {
    "Störmer-Verlet": verlet,
    "Störmer-Verlet, second kick implicit": partial(verlet, second="implicit"),
    "Störmer-Verlet, first kick implicit": partial(verlet, first="implicit"),
    "Störmer-Verlet, both kicks implicit": partial(verlet, first="implicit", second="implicit"),
    "velocity Verlet": partial(verlet, second="predicted"),
    "Störmer-Verlet, both kicks with the first momentum": partial(verlet, second="start"),
    "position Verlet": position_verlet,
    "position Verlet, kick with the mean momentum": partial(position_verlet, kick="mean"),
    "position Verlet, kick implicit": partial(position_verlet, kick="implicit"),
    "the implicit midpoint rule": midpoint,
    "symplectic Euler, explicit": symplectic_euler,
    "the adjoint of symplectic Euler, explicit": partial(symplectic_euler, order="q, p0"),
    "the adjoint of symplectic Euler": partial(symplectic_euler, order="q, p1"),
}
"""Integrators that are symplectic for H = T(p) + U(q), or for any H, and their explicit look-alikes. Symplectic Euler as HLW (1.18)
is a scheme of daebench, ``se``."""

TABLEAUX: dict[str, Tableau] = {
    "explicit Euler": ((0.0,), (1.0,)),
    "Heun's method": ((1.0, 0.0), (1 / 2, 1 / 2)),
    "the explicit midpoint rule": ((1 / 2, 0.0), (0.0, 1.0)),
    "the classical Runge-Kutta method": ((1 / 2, 1 / 2, 1.0, 0.0), (1 / 6, 1 / 3, 1 / 3, 1 / 6)),
}
"""Explicit Runge-Kutta methods: the factor of each stage in the argument of the next, and the weights."""

INTEGRATORS: dict[str, Integrator] = {
    **SYMPLECTIC,
    "symplectic Euler": partial(symplectic_euler, order="p1, q"),
    "a Taylor step": taylor,
    **{name: partial(runge_kutta, tableau=tableau) for name, tableau in TABLEAUX.items()},
}
"""All of them."""

LEAVING = {name: step for name, step in INTEGRATORS.items() if "first kick implicit" not in name and "both kicks implicit" not in name}
"""Those that leave the manifold. With lam such that the velocity after the first kick meets g'' = 0, q1 is on a manifold of quadratic
constraints: on such Störmer-Verlet with an implicit first kick is RATTLE."""


def nearest(mechanics: Mechanics, q: Array, *, gradient: str, mass: bool) -> Array:
    """Return a point of the manifold near q."""
    W = mechanics.inverse_mass(q) if mass else np.eye(len(q))
    if gradient == "each":
        return iterated(lambda x: x + _displacement(mechanics, x, mechanics.gradient(x), W), q)

    if gradient == "one by one":
        return iterated(partial(_one_by_one, mechanics, W), q)

    def along(G: Array) -> Array:
        x, previous = q, np.inf
        nu = np.zeros(len(G))
        for _ in range(ITERATIONS):
            nu = nu + np.linalg.solve(mechanics.gradient(x) @ W @ G.T, mechanics.constraint(x))
            new = q - W @ G.T @ nu
            change = float(np.max(np.abs(new - x)))
            x = new
            if not np.isfinite(change) or settled(change, previous, x):
                break
            previous = change
        return x

    given = along(mechanics.gradient(q))
    return given if gradient == "given" else iterated(lambda x: along(mechanics.gradient(x)), given)


def _one_by_one(mechanics: Mechanics, W: Array, x: Array) -> Array:
    for k in range(mechanics.ivp.m):
        along = W @ mechanics.gradient(x)[k]
        for _ in range(MEETING):
            if abs(g := mechanics.constraint(x)[k]) <= SETTLED * np.max(np.abs(x)):
                break
            x = x - along * g / (mechanics.gradient(x)[k] @ along)
    return x


def _displacement(mechanics: Mechanics, x: Array, G: Array, W: Array) -> Array:
    return np.asarray(-W @ G.T @ np.linalg.solve(G @ W @ G.T, mechanics.constraint(x)))
