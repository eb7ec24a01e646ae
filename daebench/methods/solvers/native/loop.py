"""The loop over the steps of IDA or CVODE, as functions that are read as text and compiled once."""

import sys
import types
from typing import Any

from daebench.compiler.cache import generated, written
from daebench.compiler.callbacks import MODE, OUTPUT, STEP, ask, cvode_solve, ida_solve, interpolate, look
from daebench.compiler.syntax import constants, text_of

ONE_STEP = 2
"""The task of SUNDIALS that is one step."""

ENDED, SUSPICIOUS, OUTSIDE, BUDGET = 0, 1001, 1002, 1003
"""Why the loop comes back, besides flags of SUNDIALS, which are negative: the end, a step or an output to look at, steps enough."""

COLLAPSED = 2.5e-15
"""Part of t below which a step is looked at: somewhat more than :data:`daebench.methods.solvers.step_check.LEAST` spacings of t."""

STATE_AT, OUTPUT_AT, TIME_AT, USER_AT = range(3, 7)
"""Places of addresses, see :func:`advance`."""

STEPS, OUTPUTS, SINCE, KEPT, STRIDE, NOTED = range(6)
"""What is counted: steps, outputs, steps since the last output, states kept, steps from one of these to the next, and steps noted."""

ASKED, COUNTED, COLUMNS = 7, 4, 6
"""Of what is noted of a step: questions to the solver, whole numbers among the answers, and numbers before those of the unknowns."""


def advance(
    ida: bool,
    calls: Any,
    mem: Any,
    vectors: Any,
    y: Any,
    t: Any,
    times: Any,
    rows: Any,
    counts: Any,
    states: Any,
    user: Any,
    record: Any,
    budget: int,
) -> int:
    """Step to the last time, or until something is to be looked at, and fill rows at the times that are passed.

    Outputs within a step come before the look at its end, and the last of all after it, as they do with Python callbacks.

    Shapes: calls (7,); vectors (3,); y (3, n); t (4,); times (k,); rows (k, n); counts (6,); states (l, n).
    """
    for _ in range(budget):
        if t[0] >= times[-1]:
            return ENDED if put_out(calls, mem, vectors, y, len(times), times, rows, counts, user) else OUTSIDE
        flag = step(ida, calls, mem, vectors, y, t, times[-1])
        if flag < 0:
            return flag
        if record is not None:  # left out of what is compiled where it is None
            note(mem, y, t, record, counts)
        passed = passed_by(t[0], times, counts[OUTPUTS])
        if passed > counts[OUTPUTS] and not put_out(calls, mem, vectors, y, passed, times, rows, counts, user):
            return OUTSIDE
        if not usual(calls, y, t, counts, user):
            return SUSPICIOUS
        if counts[STEPS] % counts[STRIDE] == 0:
            keep(y, states, counts)
    return BUDGET


def passed_by(t: float, times: Any, outputs: int) -> int:
    """Return how many output times but the last have been reached at t, where so many had been before."""
    passed = outputs
    while passed < len(times) - 1 and times[passed] <= t:
        passed += 1
    return passed


def put_out(calls: Any, mem: Any, vectors: Any, y: Any, passed: int, times: Any, rows: Any, counts: Any, user: Any) -> bool:
    """Fill the rows at the output times that are passed, so many of all; return False where something is amiss with one."""
    while counts[OUTPUTS] < passed:
        k = counts[OUTPUTS]
        interpolate(calls[1], mem, times[k], 0, vectors[2])
        for i in range(y.shape[1]):
            rows[k, i] = y[1, i]
        user[MODE] = OUTPUT
        if look(calls[2], times[k], calls[OUTPUT_AT], calls[USER_AT]) != 0:
            return False
        counts[OUTPUTS], counts[SINCE] = k + 1, 0
    return True


def step(ida: bool, calls: Any, mem: Any, vectors: Any, y: Any, t: Any, end: float) -> int:
    """Take one step; return the flag of SUNDIALS."""
    for i in range(y.shape[1]):
        y[2, i] = y[0, i]
    t[1] = t[0]
    if ida:
        return int(ida_solve(calls[0], mem, end, calls[TIME_AT], vectors[0], vectors[1], ONE_STEP))
    return int(cvode_solve(calls[0], mem, end, vectors[0], calls[TIME_AT], ONE_STEP))


def usual(calls: Any, y: Any, t: Any, counts: Any, user: Any) -> bool:
    """Return whether nothing is amiss with a step, and count it then."""
    thousand = (counts[STEPS] + 1) % 1000 == 0
    counts[SINCE] += 1
    user[MODE] = STEP
    if t[0] - t[1] <= COLLAPSED * t[0] or (thousand and t[0] - t[2] < t[3]):
        return False
    if look(calls[2], t[0], calls[STATE_AT], calls[USER_AT]) != 0:
        return False
    counts[STEPS] += 1
    if thousand:
        t[2] = t[0]
    return True


def keep(y: Any, states: Any, counts: Any) -> None:
    """Keep a state; where there are too many, drop every other one."""
    for i in range(y.shape[1]):
        states[counts[KEPT], i] = y[0, i]
    counts[KEPT] += 1
    if counts[KEPT] == len(states):
        half = (len(states) + 1) // 2
        for k in range(half):
            for i in range(y.shape[1]):
                states[k, i] = states[2 * k, i]
        counts[KEPT], counts[STRIDE] = half, 2 * counts[STRIDE]


def note(mem: Any, y: Any, t: Any, record: Any, counts: Any) -> None:
    """Note the solver's numbers of the step that it has taken: t, h, order, counts, unknowns, weights, estimates."""
    asked, size, numbers, columns, table = record
    for k in range(ASKED):
        ask(asked[k], mem, asked[ASKED + k])
    row, n = counts[NOTED], y.shape[1]
    table[row, 0], table[row, 1] = t[0], size[0]
    for k in range(COUNTED):
        table[row, 2 + k] = numbers[k]
    for i in range(n):
        table[row, COLUMNS + i] = y[0, i]
        table[row, COLUMNS + n + i] = columns[0, i]
        table[row, COLUMNS + 2 * n + i] = columns[1, i]
    counts[NOTED] += 1


def look_again(call: Any, t: float, y: Any, user: Any, times: int) -> None:
    """Look at a step several times; unknowns and memory are given by their addresses."""
    for _ in range(times):
        look(call, t, y, user)


WRITTEN = (advance, passed_by, put_out, step, usual, keep, note, look_again)
"""The functions that are compiled."""


def compiled() -> types.ModuleType:
    """Return the module of ``advance`` and ``look_again``, compiled, and kept with other machine code."""

    def build() -> str:
        texts = [constants(sys.modules[__name__]), *map(text_of, WRITTEN)]
        return written("The loop over the steps of IDA or CVODE.", ("advance", "look_again"), texts)

    return generated("sundials_steps", "steps of IDA and CVODE", build)
