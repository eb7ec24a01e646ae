"""Iterations of molecular dynamics for the constraints of a step, each ended by a tolerance."""

from collections.abc import Callable
from typing import Any, TypeVar

from daebench.errors import BadInput, positive
from daebench.schemes.kernels.language import CONSTRAINTS, EPS, INF, dot_moduli, multiplier, norm, tally
from daebench.schemes.kernels.newton import OK, judge
from daebench.schemes.kernels.spaces import DATA, Multiplier, Number, Report, Rows, Vector

X = TypeVar("X")
NOT_RELAXED = 5
ROUNDS = 1000

FINEST = 4.0
"""Least tolerance, in spacings of the run's numbers at 1."""


def require_tolerance(tolerance: float) -> float:
    """Return the tolerance; raise :class:`BadInput` where it is not between 0 and 1."""
    if positive("tolerance", tolerance) >= 1:
        raise BadInput(f"tolerance = {tolerance:g} must be less than 1: it is what constraints may be off by, relative to their terms.")
    return float(tolerance)


def bounds(X: Rows, x: Vector) -> Multiplier:
    """Return the tolerance times sum_i |X_ki x_i|: what a relative change of x by it makes of constraint k; never below rounding.

    The rounding of a constraint between what is zero, as between two axes of a body at rest, is that of what is not. The tolerance is the
    third of the scheme's numbers, as :mod:`daebench.schemes.kernels.rattle_step` says.
    """
    return multiplier(max(DATA[2] * dot_moduli(X[k], x), 4.0 * EPS * norm(X[k]) * norm(x)) for k in range(CONSTRAINTS))


def relax(update: Callable[..., tuple[X, Number, Number, Number]], x: X, data: Any) -> tuple[X, Report]:
    """Return the first x at which every constraint is met within its tolerance, and a report.

    ``update(x, data)`` corrects x where constraints are not met; it returns the next x, how many were not met, the sum of the moduli met
    on the way, and the smallest share that cancellation has left of what it divided by. Unlike Newton's, this iteration ends on a
    residual, on purpose: it is what is studied. For the same reason it does no further rounds for a derivative in the imaginary part:
    what is differentiated is the map as it is computed.
    """
    residual = INF
    pivot = INF
    for iteration in range(1, ROUNDS + 1):
        x, unmet, residual, pivot = update(x, data)
        status = judge(residual, pivot, unmet)
        if status != OK or unmet < 0.5:
            return x, (status, residual, pivot, tally(update, iteration))
    return x, (NOT_RELAXED, residual, pivot, tally(update, ROUNDS))
