"""A run in complex numbers: its imaginary part carries a tangent vector along, to round-off, and every state can be kept."""

from typing import Any

import numpy as np

from daebench.methods.fixed_step.stepping import Linked
from daebench.runs.ivp import InitialValueProblem


def complex_run(linked: Linked, ivp: InitialValueProblem, x: Any, h: float, steps: int, every: int = 0) -> tuple[Any, Any, str | None]:
    """Return the last good state of a run, the states stored, and why it stopped early, or None."""
    kernel = linked.kernel
    rows = np.empty((steps // every if every else 0, ivp.size), dtype=complex)
    empty = np.empty((0, ivp.size), dtype=complex)
    with np.errstate(all="ignore"):
        memory, report = kernel.initialise(x, h, linked.par) if hasattr(kernel, "initialise") else ((), (0,))
        if report[0]:
            return x, rows[:0], linked.failure(ivp, h, 0, steps, 0, report)
        # ``every or -1``: counted down from -1, the number of steps until an output never reaches 0.
        result = kernel.integrate(x, memory, (), (), np.inf, h, linked.weights, steps, every or -1, every, rows, empty, linked.par)
    done, stored, report = result[4], result[5], result[-1]
    return result[0], rows[:stored], linked.failure(ivp, h, done, steps, result[-2], report) if report[0] else None
