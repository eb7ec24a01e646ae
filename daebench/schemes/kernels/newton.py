"""Newton's iteration, written once: until the increment of the state is at round-off."""

from collections.abc import Callable
from typing import Any, TypeVar

from daebench.schemes.kernels.language import (
    AGAIN,
    EPS,
    INF,
    ITERATIONS_ASKED,
    ONCE,
    ROUNDINGS,
    TANGENTS,
    at_rest,
    no_work,
    plus_work,
    tally,
    unsettled,
    with_tangents,
)
from daebench.schemes.kernels.spaces import Number, Report

X = TypeVar("X")
# Statuses are numbered over all files of kernels; ``methods/fixed_step/reasons.py`` has the sentence for each.
OK = 0
NOT_CONVERGED = 1
SINGULAR = 2
NOT_FINITE = 3
UNSETTLED = 8
# Newton with the full matrix takes a handful. The margin is for iterations that omit derivatives and converge linearly.
ITERATIONS = 100
ITERATIONS_TAKEN = 100.0  # the same as a number of the type of a run
STEADY = 50
LONGEST = 1000


def regular(residual: Number, pivot: Number, size: Number) -> bool:
    """Return whether the input of a linear solve was finite, the matrix regular, and the result finite."""
    # A relative pivot is the fraction that remains after cancellation: within a few roundings of zero, it consists of rounding.
    return bool(residual < INF and pivot > 4.0 * EPS and size < INF)


def judge(residual: Number, pivot: Number, size: Number) -> int:
    """Return the status of a linear solve."""
    if not regular(residual, pivot, size):
        # "not >" in place of "<=": a pivot that is NaN, as 0/0 makes it, is one of a singular matrix.
        return SINGULAR if residual < INF and not pivot > 4.0 * EPS else NOT_FINITE
    return OK


def ended(residual: Number, pivot: Number, size: Number, bound: Number) -> int:
    """Return the status of an iteration that has ended, with the bound on its last increment."""
    if regular(residual, pivot, size) and size > bound:
        return NOT_CONVERGED
    return judge(residual, pivot, size)


def newton(update: Callable[..., tuple[X, Number, Number, Number, Number]], x: X, data: Any) -> tuple[X, Report]:
    """Return the fixed point x of ``update``, and a report.

    ``update(x, data)`` returns the next iterate, the size of the increment of the state part, its scale, the residual at x, and the
    smallest relative pivot of the iteration matrix, and has no branches or loops. The iteration ends when::

        |dx| <= 4 eps scale      or      |dx| no longer shrinks and is within 1e4 eps scale,

    with scale = max(L, |q|), L being the length of the initial value problem, see ``daebench/runs/scales.py``: so that the digits do not
    depend on the units. Momenta are measured as velocities, so that light and heavy parts have the same weight: as h M^-1 dp if they follow
    from g = 0, which leaves them uncertain by eps |q| / h; against |M^-1 p| if they do not. A small residual never ends the iteration: that
    would leave a bias, and cause a linear drift of the energy. If the imaginary part is a derivative, the iteration continues for as many
    iterations again, so that the derivative is as converged as the value. A relative pivot at round-off, a value that is not finite, or 100
    iterations without convergence stop it with a corresponding status. One that has shrunk in each of the last 50 converges slowly, as an
    iteration may that omits derivatives: it goes on while it does, up to 1000. The report of an iteration without convergence has minus the
    number of iterations in the place of the pivot, which is then the least of all pivots.

    A study of this criterion may use another number of roundings than 4, or a fixed number of iterations; derivatives are then those of the
    computed iterates.
    """
    last = INF
    steady = 0
    taken = 0.0
    # Where a number of iterations is asked for, ``until`` is not 0, and the test of convergence below is never made.
    until = ITERATIONS_ASKED
    residual = INF
    pivot = INF
    for iteration in range(1, 2 * LONGEST + 1):
        x, size, scale, residual, pivot = update(x, data)
        # Counted apart from the loop, in the run's type: in lanes, runs end at different iterations, and each needs a number of its own.
        taken = taken - 1.0
        status = judge(residual, pivot, size)
        # Before the test of the size: the increment that a singular matrix gives may be small, and means nothing.
        if status != OK:
            return x, (status, residual, pivot, tally(update, iteration))
        if until == 0:
            bound = EPS * scale
            steady = steady + 1 if size < last else 0
            # Where the problem is badly conditioned, increments stop shrinking above 4 eps: they are the rounding of the update itself.
            # Far above that, an increment that grows is no convergence, so that the second bound is needed, too.
            if size <= ROUNDINGS * bound or (size >= last and size <= 10000.0 * bound):
                until = AGAIN * iteration
            elif iteration >= ITERATIONS and (steady < STEADY or iteration == LONGEST):
                return x, (NOT_CONVERGED, residual, taken, tally(update, iteration))
            last = size
        if iteration == until:
            if TANGENTS:  # known when the file is executed
                return differentiated(update, x, data, size, (OK, residual, pivot, tally(update, iteration)))
            return x, (OK, residual, pivot, tally(update, iteration))
    return x, (NOT_CONVERGED, residual, taken, tally(update, 2 * LONGEST))


if ONCE:

    def newton(update: Callable[..., tuple[X, Number, Number, Number, Number]], x: X, data: Any) -> tuple[X, Report]:
        """Return the result of the iteration above in its default form; all runs leave the loop at one place.

        EPS is a power of two: multiplied by it first, the numbers of roundings give the same bounds.
        """
        last = INF
        steady = 0
        taken = 0.0
        for iteration in range(1, LONGEST + 1):
            x, size, scale, residual, pivot = update(x, data)
            taken = taken - 1.0
            # Both criteria as one bound: what differs between lanes is then a number, and not a branch.
            bound = (10000.0 * EPS if size >= last else ROUNDINGS * EPS) * scale
            steady = steady + 1 if size < last else 0
            if not regular(residual, pivot, size) or size <= bound or (iteration >= ITERATIONS and steady < STEADY):
                return x, (ended(residual, pivot, size, bound), residual, taken if size > bound else pivot, tally(update, iteration))
            last = size
        return x, (NOT_CONVERGED, residual, taken, tally(update, LONGEST))


def newton_of_one(update: Callable[..., tuple[X, Number, Number, Number, Number]], x: X, data: Any) -> tuple[X, Report]:
    """Return the result of the iteration for several runs with one unknown, if |dx| is a multiple of it.

    residual / pivot is finite only if the residual is finite and the pivot is not zero: a test of |dx| is enough.
    """
    last = INF
    for iteration in range(1, ITERATIONS + 1):
        x, size, scale, residual, pivot = update(x, data)
        # "not <" in place of ">=": NaN ends the iteration here, and ``judge`` names it.
        if not size < INF or size <= (10000.0 * EPS if size >= last else ROUNDINGS * EPS) * scale:
            return x, (judge(residual, pivot, size), residual, pivot, tally(update, iteration))
        last = size
    return x, (NOT_CONVERGED, residual, -ITERATIONS_TAKEN, tally(update, ITERATIONS))


def differentiated(
    update: Callable[..., tuple[X, Number, Number, Number, Number]], x: X, data: Any, size: Number, report: Report
) -> tuple[X, Report]:
    """Return the solution x with its derivatives, and a report; ``size`` is that of the last increment.

    If numbers are dual, derivatives have been propagated through the iteration that led to x. Further iterations with fixed values give the
    derivatives of its limit::

        dx -> U_x dx + U_data ddata,      x = U(x, data)

    If U is Newton's update with the full matrix, U_x is zero up to rounding and the second iteration changes nothing; if U omits
    derivatives, dx converges as x did. These iterations are not counted as work.
    """
    last = size
    for _ in range(ITERATIONS):
        x1, size, scale, _, _ = update(x, data)
        x = with_tangents(x, x1)
        last = unsettled(size, scale, last)
        if at_rest(last):
            return x, report
    return x, (UNSETTLED, report[1], report[2], report[3])


def once(update: Callable[..., tuple[X, Number, Number, Number, Number]], x: X, data: Any) -> tuple[X, Report]:
    """Return x after one update, and a report."""
    x, size, _, residual, pivot = update(x, data)
    return x, (judge(residual, pivot, size), residual, pivot, tally(update, 1))


def linear(pivot: Number, residual: Number) -> Report:
    """Return the report of a single linear solve."""
    return judge(residual, pivot, residual), residual, pivot, no_work()


def both(first: Report, second: Report) -> Report:
    """Return the report of two solutions in a row: the first that failed, the smaller pivot, the work of both."""
    # The first failure is the cause: what follows it was computed from a result that is not valid.
    if first[0] != OK:
        return first[0], first[1], first[2], plus_work(first[3], second[3])
    return second[0], second[1], min(first[2], second[2]), plus_work(first[3], second[3])
