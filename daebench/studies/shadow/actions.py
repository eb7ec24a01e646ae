"""The action of a step, S with p1 dq1 - p0 dq0 = dS on tangents of the manifold, for the schemes of which it is known."""

from collections.abc import Callable

import numpy as np

from daebench.errors import BadInput
from daebench.runs.ivp import Array, ConstrainedIvp

Actions = Callable[[ConstrainedIvp, Array, Array, float], Array]
"""A function of problem, p, q, shape(n + 1, d), and h that returns the actions of the n steps."""


def verlet(ivp: ConstrainedIvp, p: Array, q: Array, h: float) -> Array:
    """Return S = P^T (q1 - q0) - h/2 (H(P, q0) + H(P, q1)) of RATTLE and SHAKE, HLW (1.26), with P = p_half.

    P solves q1 - q0 = h/2 (H_p(P, q0) + H_p(P, q1)). It is found from the positions, and differs from the scheme's by G^T mu at most,
    which dq does not see.
    """
    inverse = ivp.along("H_pp", p, q)
    P, dq = momenta(inverse[:-1] + inverse[1:], 2 * np.diff(q, axis=0) / h), np.diff(q, axis=0)
    return np.asarray(np.sum(P * dq, axis=1) - h / 2 * (ivp.along("H", P, q[:-1]) + ivp.along("H", P, q[1:])))


def euler(ivp: ConstrainedIvp, p: Array, q: Array, h: float) -> Array:
    """Return S = P^T (q1 - q0) - h H(P, q0) of symplectic Euler, HLW (1.19), with P = p1 before the projection (1.20)."""
    return _euler(ivp, p, q, h, q[:-1])


def euler_adjoint(ivp: ConstrainedIvp, p: Array, q: Array, h: float) -> Array:
    """Return S = P^T (q1 - q0) - h H(P, q1) of the adjoint of symplectic Euler."""
    return _euler(ivp, p, q, h, q[1:])


def _euler(ivp: ConstrainedIvp, p: Array, q: Array, h: float, at: Array) -> Array:
    dq = np.diff(q, axis=0)
    P = momenta(ivp.along("H_pp", p[1:], at), dq / h)
    return np.asarray(np.sum(P * dq, axis=1) - h * ivp.along("H", P, at))


def midpoint(ivp: ConstrainedIvp, p: Array, q: Array, h: float) -> Array:
    """Return S = P^T (q1 - q0) - h H(P, Q) of the midpoint rule, with the means P of momenta and Q of positions."""
    P, Q = (p[1:] + p[:-1]) / 2, (q[1:] + q[:-1]) / 2
    return np.asarray(np.sum(P * np.diff(q, axis=0), axis=1) - h * ivp.along("H", P, Q))


def momenta(inverse: Array, velocity: Array) -> Array:
    """Return the momenta of velocities, v = H_pp p; ``inverse`` has H_pp for each, shape(n, d, d)."""
    full = np.broadcast_to(inverse, (len(velocity), *inverse.shape[-2:]))
    return np.asarray(np.linalg.solve(full, velocity[..., None])[..., 0])


DERIVED: dict[str, Actions] = {"rattle": verlet, "shake": verlet, "symplectic_euler": euler, "symplectic_euler_adjoint": euler_adjoint}
"""Schemes whose shadow Hamiltonian can be computed from their orbits."""

COMPARED: dict[str, Actions] = {"se": euler, "seproj": euler, "midpoint": midpoint}
"""Schemes on the index-reduced equation (1.18): the action is that of the scheme on a Hamiltonian system, which (1.18) is not."""

REASONS = {
    "lobatto": "its action needs the stages of each step, which an orbit does not have",
    "gauss": "its action needs the stages of each step, which an orbit does not have",
    "strang": "its action needs the states between its flows, which an orbit does not have",
    "lie": "its action needs the states between its flows, which an orbit does not have",
}
"""Why there is no derivation, by the beginning of a name."""


def actions_of(method: str, *, compare: bool) -> Actions:
    """Return the function that gives a scheme's actions; refuse a scheme without one in a sentence that says why."""
    if method in DERIVED:
        return DERIVED[method]
    if method in COMPARED:
        if compare:
            return COMPARED[method]
        reason = "it is not symplectic on the constraint manifold; --compare computes the same quantity for comparison"
    elif "/" in method:
        reason = "a composition has states within its step that an orbit does not have"
    else:
        reason = next((words for start, words in REASONS.items() if method.startswith(start)), "no action of its step is known")
    raise BadInput(f"{method} has no shadow Hamiltonian here: {reason}. Those of {', '.join(DERIVED)} are known.")
