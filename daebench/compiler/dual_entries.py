"""Entry points of a module of dual numbers. Values and derivatives are passed separately, because Python has no dual numbers.

The functions are put into generated modules unchanged. The names that they call are those of the module.
"""

from typing import Any

import numpy

from daebench.compiler.trace.dual import lifted, rescaled, square, tangents, values
from daebench.schemes.kernels.language import initialise, output
from daebench.schemes.kernels.loop import integrate


def integrate_dual(
    x: Any,
    memory: Any,
    conserved: Any,
    maxima: Any,
    pivots: Any,
    h: float,
    weights: Any,
    steps: int,
    left: int,
    every: int,
    states: Any,
    stage_lams: Any,
    par: Any,
    dx: Any,
    dmemory: Any,
    dpar: Any,
) -> Any:
    """Return the results of ``integrate``, and the derivatives of the state, of the memory, and of the stored form of the state."""
    numbers = lifted(par, dpar)
    result = integrate(  # type: ignore[call-arg]
        lifted(x, dx), lifted(memory, dmemory), conserved, maxima, pivots, h, weights, steps, left, every, states, stage_lams, numbers
    )
    return values(result), (tangents(result[0]), tangents(result[1]), tangents(output(result[0], numbers)))  # type: ignore[call-arg]


def initialise_dual(x: Any, h: float, par: Any, dx: Any, dpar: Any) -> Any:
    """Return the results of ``initialise``, and the derivatives of the memory."""
    memory, report = initialise(lifted(x, dx), h, lifted(par, dpar))  # type: ignore[call-arg]
    return values(memory), values(report), tangents(memory)


REMEMBERS: bool = False
"""Whether the scheme has a memory that lasts from step to step: said by the generated module."""


def first_memory(x: Any, h: Any, par: Any) -> Any:
    """Return the memory of the scheme before the first step, and the report on it."""
    memory, report = initialise(x, h, par) if REMEMBERS else ((), (0,))  # type: ignore[call-arg]
    return memory, report[0]


def integrate_tangent(
    x: Any, pivots: Any, h: float, weights: Any, every: int, par: Any, dx: Any, units: Any, states: Any, growth: Any
) -> Any:
    """Write the logarithmic growth of a tangent vector over each ``every`` steps into ``growth``; rescale the vector to length 1 each time.

    Returns the number of these intervals, the steps taken after them, the substeps tried in the last step, and status, residual and
    pivot of the last report. Lengths are measured with the entries of the vector multiplied by ``units``.
    """
    number = lifted(x, dx)
    memory, status = first_memory(number, h, par)
    if status != 0:
        return 0, 0, 0, status, 0.0, 0.0
    for k in range(len(growth)):
        result = integrate(number, memory, (), (), pivots, h, weights, every, -1, every, states, states[0], par)  # type: ignore[call-arg]
        number, memory, pivots, report = result[0], result[1], result[3], result[9]
        length = numpy.sqrt(square(output(number, par), units))  # type: ignore[call-arg]
        if report[0] != 0 or not 0.0 < length < numpy.inf:
            return k, result[4], result[8], report[0], values(report[1]), values(report[2])
        growth[k] = numpy.log(length)
        number, memory = rescaled(number, 1.0 / length), rescaled(memory, 1.0 / length)
    return len(growth), 0, 0, 0, 0.0, 0.0
