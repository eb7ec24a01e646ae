"""One step by itself, and what belongs to a state, for code that has a loop of its own."""

from typing import Any

from daebench.schemes.kernels.constrain import project_momentum
from daebench.schemes.kernels.language import INF, ON_VELOCITIES, G, H_p, H_pp, after_step, g, mass, norm, solve, state_norm, zero
from daebench.schemes.kernels.loop import advance
from daebench.schemes.kernels.manifold import project
from daebench.schemes.kernels.newton import NOT_FINITE, OK, both, newton
from daebench.schemes.kernels.spaces import LENGTH, Data, Matrix, Multiplier, Number, Report, State, Update, Vector


def alone(x: State, memory: Any, h: Number, weights: Data) -> Any:
    """Return the next state and memory, the stage multipliers and a report; after a failure the last good state and memory."""
    x1, memory1, stage_lam, report, _, _ = advance(x, memory, h, weights)
    x1, report = after_step(x1, report)
    if report[0] == OK and not state_norm(x1) < INF:
        report = (NOT_FINITE, INF, report[2], report[3])
    # As in the loop: code that steps by itself must not go on from a state that failed.
    if report[0] != OK:
        return x, memory, stage_lam, report
    return x1, memory1, stage_lam, report


def residuals(p: Vector, q: Vector) -> tuple[Multiplier, Multiplier]:
    """Return g and G H_p."""
    return g(q), G(q) @ H_p(p, q)


def momenta(v: Vector, q: Vector) -> Vector:
    """Return the momenta of velocities."""
    return mass(0 * v, q) @ v


if ON_VELOCITIES:

    def projected(p: Vector, q: Vector) -> tuple[Vector, Vector, Report]:
        """Return momenta and positions on the manifold near these, and a report."""
        return project(p, q)

else:

    def update_nearest(x: tuple[Vector, Multiplier], data: tuple[Vector, Matrix]) -> Update:
        """One update of the increment dq = -M^-1 G(q0 + dq)^T nu that leads to the nearest position."""
        (dq, _), (q0, W) = x, data
        q = q0 + dq
        G1, value = G(q), g(q)
        V = G1 @ W.T
        nu, pivot = solve(G1 @ V.T, value - G1 @ dq)
        new = -1.0 * (V.T @ nu)
        return (new, nu), norm(new - dq), max(LENGTH, norm(q)), norm(value), pivot

    def projected(p: Vector, q: Vector) -> tuple[Vector, Vector, Report]:
        """Return the nearest positions with g = 0 in the metric M(q), the nearest momenta there with G H_p = 0, and a report.

        One after the other: a joint distance would depend on a unit of time, and far velocities would move positions.
        """
        (dq, _), moved = newton(update_nearest, (0 * q, zero(q)), (q, H_pp(p, q)))
        p1, _, settled = project_momentum(p, q + dq)
        return p1, q + dq, both(moved, settled)
