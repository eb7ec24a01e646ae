"""The only loop over steps: it composes, stores, monitors and stops; a step is a pure map of states.

``one_step``, ``after_step``, ``output`` and ``state_norm`` are those of :mod:`daebench.schemes.kernels.constrained`, or of
:mod:`daebench.schemes.kernels.poisson`.
"""

from typing import Any

from daebench.schemes.kernels.language import (
    COMPOSED,
    INF,
    TANGENTS,
    after_step,
    conserved_quantities,
    defined,
    finite_tangents,
    monitored_errors,
    no_work,
    one_step,
    output,
    plus_work,
    state_norm,
    store,
    total,
    worst,
)
from daebench.schemes.kernels.newton import NOT_FINITE, OK, UNSETTLED
from daebench.schemes.kernels.rank import RANK_LOST, lost, measured, recalled
from daebench.schemes.kernels.spaces import Data, Number, Report, State

ERROR_NOT_FINITE = 4

if COMPOSED:

    def advance(x: State, memory: Any, h: Number, weights: Data) -> tuple[Any, Any, Any, Report, int, Number]:
        """Return the result of ``one_step`` for substeps of weights[0] h, weights[1] h, ..., the number tried, and the rank of G."""
        pivot, work = INF, no_work()
        for stage in range(len(weights)):
            x, memory, stage_lam, report = one_step(x, memory, weights[stage] * h)
            pivot, work = min(pivot, report[2]), plus_work(work, report[3])
            if report[0] != OK:
                return x, memory, stage_lam, (report[0], report[1], pivot, work), stage + 1, pivot
        return x, memory, stage_lam, (report[0], report[1], pivot, work), len(weights), measured(output(x), pivot)

else:

    def advance(x: State, memory: Any, h: Number, weights: Data) -> tuple[Any, Any, Any, Report, int, Number]:
        """Return the result of ``one_step``, the number 1 of substeps, and the rank of G."""
        x1, memory1, stage_lam, report = one_step(x, memory, h)
        return x1, memory1, stage_lam, report, 1, measured(output(x1), report[2])


def first(x: State) -> tuple[Number, ...]:
    """Return the conserved quantities that the run monitors, at the start."""
    return conserved_quantities(output(x))


def differentiable(x: State, report: Report) -> Report:
    """Return a report, whose status shows if the derivatives of the state after a step are not finite."""
    if report[0] == OK and not finite_tangents(state_norm(x)):
        return UNSETTLED, INF, report[2], report[3]
    return report


def integrate(
    x: State,
    memory: Any,
    conserved: tuple[Number, ...],
    maxima: tuple[Number, ...],
    pivots: Any,
    h: Number,
    weights: Data,
    steps: int,
    left: int,
    every: int,
    states: Any,
    stage_lams: Any,
) -> Any:
    """Take a number of steps of size h, and store a state after ``left`` steps and then after every ``every`` steps.

    Returns the last good state and memory, the maxima of the monitored quantities, the record of pivots, the steps done, the rows stored,
    the steps left until the next output, Newton's work, the substeps tried in the last step, and the last report. The number tried is
    negative if no substep failed but an operation after them. The loop stops with RANK_LOST after the step before the one in which G loses
    rank; called again, it continues.
    """
    row = 0
    work = no_work()
    report = (OK, 0 * h, INF, work)  # 0 as a number of the type of a run
    tried = 0
    for k in range(steps):
        x1, memory1, stage_lam, report, tried, rank = advance(x, memory, h, weights)
        stepped = report[0]
        x1, report = after_step(x1, report)
        work = plus_work(work, report[3])
        if report[0] == OK and not state_norm(x1) < INF:  # or NaN
            report = (NOT_FINITE, INF, report[2], report[3])
        if TANGENTS:
            report = differentiable(x1, report)
        y = output(x1)
        larger = worst(maxima, monitored_errors(y, conserved))
        # A state may be finite where H or an integral has no value, as beyond the domain of a logarithm.
        if report[0] == OK and not total(larger) + defined(y) < INF:
            report = (ERROR_NOT_FINITE, INF, report[2], report[3])
        if report[0] != OK:
            return x, memory, maxima, pivots, k, row, left, work, tried if stepped != OK else -tried, report
        # Not before all checks have passed: a run that fails ends with its last good state.
        x, memory, maxima = x1, memory1, larger
        before, pivots = pivots, recalled(pivots, report[2], rank)
        # Counted down across calls: a run is called in pieces, whose ends need not be those of the output interval.
        left -= 1
        if left == 0:
            store(states, stage_lams, row, y, stage_lam)
            row += 1
            left = every
        # After the state is stored: this step is good, and only the next one meets the loss of rank.
        if lost(before, pivots):
            return x, memory, maxima, pivots, k + 1, row, left, work, tried, (RANK_LOST, 0 * h, rank, report[3])
    return x, memory, maxima, pivots, steps, row, left, work, tried, (OK, 0 * h, INF, no_work())
