"""The rates of a code: the limit of (step - state) / h as h goes to zero, what it is known to, and whether it is the problem's."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from daebench.runs.ivp import Array
from daebench.studies.diagnose.agreement import CONFIRMED
from daebench.studies.diagnose.battery import Battery, Map
from daebench.studies.diagnose.feedback import rates
from daebench.studies.diagnose.mechanics import Mechanics, State

SIZES = (0.1, 0.02, 0.004, 0.0008)
"""The steps from which limits are extrapolated, in units of the battery's; an iteration that ends early leaves more in small ones."""

OFF, OFF_SINGLE = 1e-3, 2e-2
"""How far a rate is from that of the problem where it is another one, relative to the largest; in float64 and in float32."""

SURE = 10.0
"""How many times the difference of two limits from different steps a rate is off."""


@dataclass(frozen=True)
class Rate:
    """Rates of a code in a state, and their distance from those of the problem."""

    p: Array
    q: Array
    """The state."""
    given: Array
    right: Array
    """A rate of the code, and of the problem."""
    error: float
    """What the limit is known to."""


def on_manifold(battery: Battery) -> Iterator[State]:
    """Yield the states before steps that meet both constraints: a code that keeps only one may leave others."""
    mechanics, rounding = battery.mechanics, battery.rounding(CONFIRMED)
    for point in battery.points:
        v = mechanics.velocity(point.p, point.q)
        G = mechanics.gradient(point.q)
        tangent = np.max(np.abs(G @ v)) <= rounding * np.max(np.abs(G)) * np.max(np.abs(v))
        if tangent and mechanics.distance(point.q) <= rounding * float(battery.scales[1]):
            yield point.p, point.q


def limit_of(step: Map, p: Array, q: Array, battery: Battery) -> tuple[State, tuple[float, float]] | None:
    """Return the rates of p and q, and what each is known to: from the two neighbouring sizes whose limits differ least."""
    limits = [limit for size in SIZES if (limit := rates(step, p, q, size * battery.h))]
    if len(limits) < 2:
        return None
    rate, error = zip(*(_nearest_two([limit[k] for limit in limits]) for k in (0, 1)), strict=True)
    return (rate[0], rate[1]), (error[0], error[1])


def _nearest_two(limits: Sequence[Array]) -> tuple[Array, float]:
    apart = [float(np.max(np.abs(one - other))) for one, other in pairwise(limits)]
    k = int(np.argmin(apart))
    return limits[k + 1], apart[k]


def beside(mechanics: Mechanics, p: Array, q: Array, rate: Array, error: float) -> Rate:
    """Return the rate of p beside the gradients of the constraints."""
    away = projector(mechanics, q)
    return Rate(p, q, away @ rate, -away @ mechanics.slope(p, q), error)


def projector(mechanics: Mechanics, q: Array) -> Array:
    """Return the matrix that takes away what is along the gradients."""
    G = mechanics.gradient(q)
    return np.asarray(np.eye(len(q)) - np.linalg.pinv(G) @ G)


def _size(limits: Sequence[Rate]) -> float:
    return max(float(np.max(np.abs([rate.given, rate.right]))) for rate in limits)


def settled(limits: Sequence[Rate]) -> bool:
    """Return whether there are limits: they are known better than the size of the rates."""
    return max(rate.error for rate in limits) * SURE <= _size(limits)


def off(battery: Battery, limits: Sequence[Rate]) -> bool:
    """Return whether rates are others than the problem's, by more than they are known to."""
    least = (OFF_SINGLE if battery.single else OFF) * _size(limits)
    return any(float(np.max(np.abs(rate.given - rate.right))) > max(least, SURE * rate.error) for rate in limits)
