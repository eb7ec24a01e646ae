"""One constraint at a time, round after round: the iteration of SHAKE as molecular dynamics runs it, ended by a tolerance."""

from collections.abc import Callable
from typing import Any, TypeVar

from daebench.schemes.kernels.language import INF, tally
from daebench.schemes.kernels.newton import OK, judge
from daebench.schemes.kernels.spaces import Number, Report

X = TypeVar("X")
NOT_RELAXED = 5
ROUNDS = 1000


def relax(update: Callable[..., tuple[X, Number, Number, Number]], x: X, data: Any) -> tuple[X, Report]:
    """Return the first x at which every constraint is met within its tolerance, and a report.

    ``update(x, data)`` visits the constraints in turn and corrects x along each that is not met; it returns the next x, how many
    were not met, the sum of the moduli met on the way, and the smallest share that cancellation has left of what it divided by.
    Unlike Newton's, this iteration ends on a residual, on purpose: it is what is studied. For the same reason it does no further
    rounds for a derivative in the imaginary part: what is differentiated is the map as it is computed.
    """
    residual = INF
    pivot = INF
    for iteration in range(1, ROUNDS + 1):
        x, unmet, residual, pivot = update(x, data)
        status = judge(residual, pivot, unmet)
        if status != OK or unmet < 0.5:
            return x, (status, residual, pivot, tally(update, iteration))
    return x, (NOT_RELAXED, residual, pivot, tally(update, ROUNDS))
