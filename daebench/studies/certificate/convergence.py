"""Whether a code converges to the motion of a problem at all: what shows no order may be near round-off, or solve another problem."""

import math
from collections.abc import Sequence
from dataclasses import replace

from daebench.studies.claims.bench import FALLS_SHORT, UNDETERMINED, Finding
from daebench.studies.orders.series import Series

FALLS = 0.75
"""An error falls that is at most so many times the one two step sizes before; order 1 makes a quarter of it, order 1/2 a half."""

LEADING = ("q", "p", "y")
"""Components of a state."""


def leading(series: Sequence[Series]) -> list[Series]:
    """Return the components of the state."""
    return [curve for curve in series if curve.component in LEADING]


def contraction(series: Sequence[Series]) -> float:
    """Return the finest error of the state in parts of the one two step sizes before, of the component that falls least.

    It is 0 where all errors come down to rounding, and NaN where there are not enough step sizes to tell.
    """
    ratios = [_ratio(curve) for curve in leading(series)]
    return float("nan") if not ratios or any(map(math.isnan, ratios)) else max(ratios)


def with_convergence(order: Finding, series: Sequence[Series]) -> Finding:
    """Return the finding on the order; what does not converge has none, and one that is claimed falls short."""
    if not contraction(series) > FALLS:
        return order
    note = f"the errors do not fall with the step size: this is the motion of another problem, or of none. {order.note}".rstrip()
    refuted = order.claimed is not None and order.verdict == UNDETERMINED
    return replace(order, verdict=FALLS_SHORT if refuted else order.verdict, note=note)


def _ratio(curve: Series) -> float:
    errors = [error for error in curve.errors if math.isfinite(error)]
    if "round-off" in curve.fit.reasons or any(error <= curve.floor for error in errors):
        return 0.0
    return errors[-1] / errors[-3] if len(errors) >= 3 else float("nan")
