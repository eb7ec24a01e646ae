"""One step by itself, and what belongs to a state, for code that has a loop of its own."""

from typing import Any

from daebench.schemes.kernels.language import INF, G, H_p, after_step, g, mass, state_norm
from daebench.schemes.kernels.loop import advance
from daebench.schemes.kernels.manifold import project
from daebench.schemes.kernels.newton import NOT_FINITE, OK
from daebench.schemes.kernels.spaces import Data, Multiplier, Number, Report, State, Vector


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


def projected(p: Vector, q: Vector) -> tuple[Vector, Vector, Report]:
    """Return momenta and positions on the manifold near these, and a report."""
    return project(p, q)
