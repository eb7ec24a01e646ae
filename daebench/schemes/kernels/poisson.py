"""Functions of the loop for states y of a Poisson system: one step, its end, and its output."""

from typing import Any

from daebench.schemes.kernels.language import LOCAL, norm
from daebench.schemes.kernels.newton import OK
from daebench.schemes.kernels.poisson_language import BOUNDED, chart, inside, step
from daebench.schemes.kernels.spaces import Number, Report, Vector

State = Vector

OUTSIDE = 6


def one_step(x: Vector, memory: Any, h: Number) -> Any:
    """Return the next state, no memory, no stage multipliers, and a report."""
    y1, report = step(x, h)
    return y1, memory, (), report


if BOUNDED:

    def after_step(x: Vector, report: Report) -> Any:
        """Return the state, and the report, whose status shows whether it is still in the domain."""
        if report[0] == OK and not inside(output(x)):
            return x, (OUTSIDE, report[1], report[2], report[3])
        return x, report

else:

    def after_step(x: Vector, report: Report) -> Any:
        """Return the state and the report unchanged."""
        return x, report


if LOCAL:

    def output(x: Vector) -> Any:
        """Return the state in the system's own coordinates."""
        return chart(x)

else:

    def output(x: Vector) -> Any:
        """Return the state, in which the scheme computes."""
        return x


def state_norm(x: Vector) -> Number:
    """Return the sum of moduli of a state; unlike the largest modulus it cannot hide a NaN."""
    return norm(x)
