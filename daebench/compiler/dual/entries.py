"""What is called of a module of dual numbers: values and derivatives go in and out apart, for Python has no dual numbers.

The functions are put into generated modules as they stand here; what they call is what the module has under these names.
"""

from typing import Any

from daebench.compiler.dual.nested import lifted, tangents, values
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
    """Return what ``integrate`` returns, and the derivatives of the state, of the memory, and of the state as it is stored."""
    numbers = lifted(par, dpar)
    result = integrate(  # type: ignore[call-arg]
        lifted(x, dx), lifted(memory, dmemory), conserved, maxima, pivots, h, weights, steps, left, every, states, stage_lams, numbers
    )
    return values(result), (tangents(result[0]), tangents(result[1]), tangents(output(result[0], numbers)))  # type: ignore[call-arg]


def initialise_dual(x: Any, h: float, par: Any, dx: Any, dpar: Any) -> Any:
    """Return what ``initialise`` returns, and the derivatives of the memory."""
    memory, report = initialise(lifted(x, dx), h, lifted(par, dpar))  # type: ignore[call-arg]
    return values(memory), values(report), tangents(memory)
