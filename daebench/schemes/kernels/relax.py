"""Iterations from molecular dynamics for the constraints of a step, each ended by a tolerance."""

from collections.abc import Callable
from typing import Any, TypeVar

from daebench.errors import BadInput, positive
from daebench.schemes.kernels.language import CONSTRAINTS, EPS, INF, dot_moduli, mul_moduli, multiplier, norm, tally
from daebench.schemes.kernels.newton import OK, judge
from daebench.schemes.kernels.spaces import DATA, LENGTH, Jacobian, Multiplier, Number, Report, Rows, Vector

X = TypeVar("X")
NOT_RELAXED = 5
ROUNDS = 1000

FINEST = 4.0
"""Least tolerance, in spacings of the run's numbers at 1."""


def require_tolerance(tolerance: float) -> float:
    """Return the tolerance; raise :class:`BadInput` if it is not between 0 and 1."""
    if positive("tolerance", tolerance) >= 1:
        raise BadInput(
            f"tolerance = {tolerance:g} must be less than 1: it bounds the residuals of constraints relative to their terms.",
            "tolerance-not-below-one",
        )
    return float(tolerance)


def bounds(X: Rows, x: Vector) -> Multiplier:
    """Return the tolerance times sum_i |X_ki x_i|: the change of constraint k under this relative change of x; never below rounding.

    If the terms of a constraint are zero, as between two axes of a body at rest, its rounding is that of the other terms. The tolerance is
    the third of the scheme's numbers, as :mod:`daebench.schemes.kernels.rattle_step` says.
    """
    return multiplier(max(DATA[2] * dot_moduli(X[k], x), 4.0 * EPS * norm(X[k]) * norm(x)) for k in range(CONSTRAINTS))


def position_bounds(X: Jacobian, q: Vector) -> Multiplier:
    """Return the tolerance times sum_i |X_ki q_i|, and four roundings of a position of the problem's length added to each |q_i|.

    The latter is the rounding of a constraint whose terms are zero. It is the same however many positions there are.
    """
    return DATA[2] * mul_moduli(X, q, 4.0 * EPS * LENGTH / DATA[2])


def relax(update: Callable[..., tuple[X, Number, Number, Number]], x: X, data: Any) -> tuple[X, Report]:
    """Return the first x at which every constraint holds within its tolerance, and a report.

    ``update(x, data)`` corrects x for the constraints that do not hold; it returns the next x, the number of such constraints, a sum of
    moduli, and the smallest fraction of a divisor that remains after cancellation. Unlike Newton's, this iteration deliberately ends by the
    residual, because this is the algorithm under study. For the same reason it adds no iterations for a derivative in the imaginary part:
    the derivative is that of the computed map.
    """
    residual = INF
    pivot = INF
    for iteration in range(1, ROUNDS + 1):
        x, unmet, residual, pivot = update(x, data)
        status = judge(residual, pivot, unmet)
        # A count in the run's number type: less than a half is none.
        if status != OK or unmet < 0.5:
            return x, (status, residual, pivot, tally(update, iteration))
    return x, (NOT_RELAXED, residual, pivot, tally(update, ROUNDS))


def until_met(update: Callable[..., tuple[X, Number, Number, Number]], x: X, data: Any) -> tuple[X, Report]:
    """Return the first x at which every constraint holds within its tolerance, and a report.

    It differs from :func:`relax` in that ``update(x, data)`` corrects x for all constraints, whether they hold or not, and returns the
    number of those that do not hold at x: where that is zero, x is returned without the correction.
    """
    residual = INF
    pivot = INF
    for iteration in range(1, ROUNDS + 1):
        x1, unmet, residual, pivot = update(x, data)
        status = judge(residual, pivot, unmet)
        if status != OK or unmet < 0.5:
            # x and not x1: where all constraints hold, the last correction is below the tolerance and is left out, as in ILVES.
            return x, (status, residual, pivot, tally(update, iteration))
        x = x1
    return x, (NOT_RELAXED, residual, pivot, tally(update, ROUNDS))
