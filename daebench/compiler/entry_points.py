"""Entry points of modules of dual numbers, and of modules of lanes: Python has no such numbers.

The functions are put into generated modules unchanged. The names that they call are those of the module. Values and derivatives of dual
numbers are passed separately.

Runs in lanes are stored in the columns of arrays, and are processed block by block. Functions of lanes have these arguments in common, for
N runs, padded to whole blocks:

- ``x``, or ``forms`` of state, conserved quantities, maxima and pivots: nested tuples of numbers, of which only the form is used;
- ``h``, ``weights``, ``par``: step size, weights of a composition, and parameters with run-time data; an integer in them denotes a row
    of ``rows``, any other entry is a value;
- ``numbers``, shape(., N): a row for each number of the state, then the conserved quantities, the maxima, the pivots, residual and pivot
    of a report and the memory, each from its row in ``places`` on;
- ``counts``, shape(., N): status, steps done, substeps tried in the last step, and work;
- ``begin``, ``end``: columns of the first run and after the last one, multiples of LANES.
"""

from typing import Any

import numpy

from daebench.compiler.trace.dual import lifted, rescaled, square, tangents, values
from daebench.compiler.trace.lanes import absent, anyof, columns, length_of, mixed, put_all, spoiled, take_all
from daebench.schemes.kernels.language import initialise, output, plus_work
from daebench.schemes.kernels.loop import first, integrate

REMEMBERS: bool = False
"""Whether the scheme has a memory that lasts from step to step: said by the generated module."""


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


LANES: int = 8
"""Number of runs in a block."""

STATUS = 0
DONE = 1
TRIED = 2
WORK = 3
"""Rows of ``counts``; the last is the first of the rows for work."""

CONSERVED = 0
MAXIMA = 1
PIVOTS = 2
RESIDUAL = 3
MEMORY = 4
"""Entries of ``places``."""


def memory_form(x: Any, h: Any, par: Any) -> Any:
    """Return a value of the form of the memory of the scheme."""
    return absent(initialise, (x, h, par))[0] if REMEMBERS else ()


def first_lanes(x: Any, h: Any, par: Any, numbers: Any, rows: Any, counts: Any, places: Any, begin: int, end: int) -> Any:
    """Write the conserved quantities into ``numbers``."""
    for b in range(begin, end, LANES):
        live = take_all(0, counts, STATUS, b, LANES) == 0
        state, number = take_all(x, numbers, 0, b, LANES), mixed(par, rows, b, LANES)
        put_all(numbers, places[CONSERVED], b, live, first(state, number))  # type: ignore[call-arg]


def initialise_lanes(x: Any, h: Any, par: Any, numbers: Any, rows: Any, counts: Any, places: Any, begin: int, end: int) -> Any:
    """Write the memory of a scheme, and the reports of its initialisation, into ``numbers`` and ``counts``; return the length of a memory.

    Nothing is written if ``numbers`` has too few rows for it.
    """
    length = 0
    for b in range(begin, end, LANES):
        live = take_all(0, counts, STATUS, b, LANES) == 0
        state, size, number = take_all(x, numbers, 0, b, LANES), mixed(h, rows, b, LANES), mixed(par, rows, b, LANES)
        memory, report = initialise(state, size, number)  # type: ignore[call-arg]
        length = length_of(memory)
        if places[MEMORY] + length > len(numbers):
            return length
        put_all(numbers, places[MEMORY], b, live, memory)
        put_all(numbers, places[RESIDUAL], b, live, report[1:3])
        put_all(counts, WORK, b, live, report[3])
        put_all(counts, STATUS, b, live, report[0])
    return length


def integrate_lanes(
    forms: Any,
    h: Any,
    weights: Any,
    steps: int,
    left: int,
    every: int,
    par: Any,
    numbers: Any,
    rows: Any,
    counts: Any,
    states: Any,
    places: Any,
    begin: int,
    end: int,
) -> None:
    """Take this many steps of each active run from the values in ``numbers``, and write the results there."""
    for b in range(begin, end, LANES):
        live = take_all(0, counts, STATUS, b, LANES) == 0
        if anyof(live):
            number, size = mixed(par, rows, b, LANES), mixed(h, rows, b, LANES)
            state = spoiled(live, take_all(forms[0], numbers, 0, b, LANES))
            result = integrate(  # type: ignore[call-arg]
                state,
                take_all(memory_form(state, size, number), numbers, places[MEMORY], b, LANES),
                take_all(forms[1], numbers, places[CONSERVED], b, LANES),
                take_all(forms[2], numbers, places[MAXIMA], b, LANES),
                take_all(forms[3], numbers, places[PIVOTS], b, LANES),
                size,
                mixed(weights, rows, b, LANES),
                steps,
                left,
                every,
                columns(states, b, LANES),
                columns(states, b, LANES),
                number,
            )
            put_all(numbers, 0, b, live, result[0])
            put_all(numbers, places[MEMORY], b, live, result[1])
            put_all(numbers, places[MAXIMA], b, live, result[2])
            put_all(numbers, places[PIVOTS], b, live, result[3])
            put_all(numbers, places[RESIDUAL], b, live, result[9][1:3])
            before = take_all((0, 0, 0, result[7]), counts, STATUS, b, LANES)
            put_all(counts, STATUS, b, live, (result[9][0], before[DONE] + result[4], result[8], plus_work(before[WORK], result[7])))
