"""How far numbers of a certificate may be off by rounding, in trees of the shape of the numbers; and whether a code converges at all.

A code that shows no order may be near round-off, or solve another problem.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import accumulate
from typing import Any

from daebench.records.comparison import Place, Rounding, is_number, same_sentence
from daebench.studies.claims.bench import FALLS_SHORT, ROUNDINGS, UNDETERMINED, Bench, Finding
from daebench.studies.orders.series import Point, Series

FALLS = 0.75
"""An error falls that is at most so many times the one two step sizes before; order 1 makes a quarter of it, order 1/2 a half."""

LEADING = ("q", "p", "y")
"""Components of a state."""

FLOORS = 9.0
"""What rounding alone decides, as the floor of differences, is known to a factor of ten: it may be off by so many times itself."""

RELATIVE = 1e-6
"""Numbers may differ by this part of the larger one besides: it is less than any of them is worth."""

UNKNOWN = object()
"""In the place of a value that is not there; it agrees with nothing."""


def allowance(within: Any, elsewhere: Any) -> Rounding:
    """Return which differences between a certificate and a new measurement rounding may make.

    ::

        |a - b| <= 1e-6 max(|a|, |b|) + within

    Other values may be those of the measurement ``elsewhere``, from a start that is rounded differently; sentences may differ in the
    numbers and paths in them.

    Parameters
    ----------
    within : object
        How far each number may be off by rounding, of the shape of the certificate where it is known.
    elsewhere : object
        The values from a start that is rounded differently.
    """

    def rounding(place: Place, old: Any, new: Any) -> bool:
        other, most = _at(elsewhere, place), _at(within, place)
        if is_number(old) and is_number(new):
            return bool(abs(old - new) <= RELATIVE * max(abs(old), abs(new)) + (most if is_number(most) else 0.0))
        return same_sentence(old, new) or same_sentence(old, other)

    return rounding


def _at(tree: Any, place: Place) -> Any:
    """Return the value in a place of a tree; :data:`UNKNOWN` if there is none."""
    for key in place:
        if isinstance(tree, dict):
            tree = tree.get(key, UNKNOWN)
        else:
            tree = tree[key] if isinstance(tree, list) and isinstance(key, int) and key < len(tree) else UNKNOWN
    return tree


def differences(a: Any, b: Any, factor: float) -> Any:
    """Return so many times the differences of two trees in each of their numbers, and 0 where one has no number."""
    if isinstance(a, dict):
        return {key: differences(value, b.get(key) if isinstance(b, dict) else None, factor) for key, value in a.items()}
    if isinstance(a, list):
        others = b if isinstance(b, list) and len(b) == len(a) else [None] * len(a)
        return [differences(value, other, factor) for value, other in zip(a, others, strict=True)]
    off = abs(a - b) if is_number(a) and is_number(b) else 0.0
    return factor * off if math.isfinite(off) else 0.0


def of_runs(numbers: Mapping[str, Any], elsewhere: Mapping[str, Any], bench: Bench[Any, Any], steps: int) -> dict[str, Any]:
    """Return how far what is said of runs may be off."""
    within: dict[str, Any] = differences(numbers, elsewhere, ROUNDINGS * math.sqrt(steps))
    sizes = {name: size for name, (_, size) in bench.conserved().items()}
    for name in within["conserved"].keys() & sizes.keys():
        within["conserved"][name] = larger(within["conserved"][name], bench.bound(steps, sizes[name]))
    of_value = bench.bound(1, sizes["energy"])
    within["curve"] |= {name: _envelope(within["curve"][name], of_value) for name in ("least", "largest")}
    energy, off = numbers["energy"], within["energy"]
    off |= {name: max(off[name], of_value) for name in ("largest", "change_bound")}
    off["size"] = max(off["size"], energy["size"] * of_value / energy["largest"] if energy["largest"] else 0.0)
    limit = numbers["error"]["bound"]
    within["error"] |= {"value": larger(within["error"]["value"], limit), "bound": larger(0.0, FLOORS * limit)}
    return within


def _envelope(within: list[float], least: float) -> list[float]:
    """Return the largest that a bound was up to each time: what rounding has done stays done, though it may be unseen for a moment."""
    return list(accumulate(within, max, initial=least))[1:]


def larger(a: float, b: float) -> float:
    """Return the larger of two bounds, of which the second may be unknown."""
    return a if math.isnan(b) else max(a, b)


def of_claims(findings: Sequence[Finding]) -> dict[str, dict[str, float]]:
    """Return how far what is measured of claims may be off.

    What is to be zero, or below a bound, is known to that bound, or where it has none, to the largest of the others; an order to its
    standard error. Bounds follow from sizes, but for those with a floor of differences in them, or the worst of several defects.
    """
    exact = [finding.bound for finding in findings if finding.property != "order"]
    most = max(filter(math.isfinite, exact), default=0.0)
    allowed = {}
    for finding in findings:
        slope_error = larger(0.0, finding.standard_error)
        known = slope_error if finding.property == "order" else most if math.isnan(finding.bound) else finding.bound
        rough = finding.property == "Poisson map" or "by differences" in finding.note
        limit = FLOORS * finding.bound if rough and math.isfinite(finding.bound) else 2 * slope_error
        allowed[finding.property] = {"measured": known, "bound": limit, "standard_error": slope_error}
    return allowed


def points(series: Sequence[Series]) -> tuple[Point, ...]:
    """Return the runs of an order study, coarsest first."""
    return max((curve.points for curve in leading(series)), key=len, default=())


def of_orders(series: Sequence[Series]) -> dict[str, Any]:
    """Return how far the numbers of an order study may be off: orders by their standard errors, errors by what counts as round-off."""
    slopes = {curve.component: larger(0.0, curve.fit.slope_error) for curve in leading(series)}
    return {
        "components": {name: {"order": slope, "standard_error": slope} for name, slope in slopes.items()},
        "contraction": FALLS,
        "h": [0.0] * len(points(series)),
        "errors": {curve.component: [curve.floor] * len(curve.errors) for curve in leading(series)},
    }


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
