"""Functions of the loop for states x = (p, q) of a constrained system: one step, its end, and its output.

``step``, ``increment`` and ``start`` are those of the scheme's file; a file that has only ``increment`` gets ``added`` as its step.
"""

from typing import Any

from daebench.schemes.kernels.language import COMPENSATED, INF, LOCAL, MULTISTEP, PROJECTED, chart, increment, no_work, norm, start, step
from daebench.schemes.kernels.manifold import project
from daebench.schemes.kernels.newton import OK, both
from daebench.schemes.kernels.spaces import Number, Report, Step, Vector
from daebench.schemes.kernels.summation import add

State = tuple[Vector, Vector]

if MULTISTEP:

    def one_step(x: State, memory: Any, h: Number) -> Any:
        """Return the next state, memory, the stage multipliers and a report."""
        p, q, memory1, stage_lam, report = step(x[0], x[1], memory, h)  # type: ignore[call-arg]
        return (p, q), memory1, stage_lam, report

    def initialise(x: State, h: Number) -> Any:
        """Return the memory that the first step needs, and a report."""
        return start(x[0], x[1], h)

elif COMPENSATED:

    def one_step(x: State, memory: Any, h: Number) -> Any:
        """Return the next state, the rounding errors of its sums, the stage multipliers and a report."""
        dp, dq, stage_lam, report = increment(x[0], x[1], h)
        p1, low_p = add(x[0], memory[0], dp)
        q1, low_q = add(x[1], memory[1], dq)
        return (p1, q1), (low_p, low_q), stage_lam, report

    def initialise(x: State, h: Number) -> Any:
        """Return the rounding errors so far, which are zero, and a report."""
        # Times h, so that these zeros have the number type of the sums that replace them.
        return (0 * h * x[0], 0 * h * x[1]), (OK, 0 * h, INF, no_work())

else:

    def one_step(x: State, memory: Any, h: Number) -> Any:
        """Return the next state, memory, the stage multipliers and a report."""
        p1, q1, stage_lam, report = step(x[0], x[1], h)
        return (p1, q1), memory, stage_lam, report


def added(p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1 = p0 + dp, q1 = q0 + dq, the stage multipliers and a report: the step of a scheme that returns increments."""
    dp, dq, stage_lam, report = increment(p0, q0, h)
    return p0 + dp, q0 + dq, stage_lam, report


if PROJECTED:

    def after_step(x: State, report: Report) -> Any:
        """Return the projection of a state onto the manifold, and the report of step and projection."""
        p1, q1, settled = project(x[0], x[1])
        return (p1, q1), both(report, settled)

else:

    def after_step(x: State, report: Report) -> Any:
        """Return the state and the report unchanged."""
        return x, report


if LOCAL:

    def output(x: State) -> Any:
        """Return the state (p, q) at the local coordinates of the scheme."""
        return chart(x[0], x[1])

else:

    def output(x: State) -> Any:
        """Return the state (p, q), in which the scheme computes."""
        return x


def state_norm(x: State) -> Number:
    """Return the sum of moduli of a state; unlike the largest modulus it cannot hide a NaN."""
    return norm(x[0]) + norm(x[1])
