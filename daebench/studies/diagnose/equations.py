"""The equations that a code solves: its rates as h goes to zero, on the manifold and off it, and whether they are the problem's."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from daebench.runs.ivp import Array
from daebench.studies.diagnose.agreement import CONFIRMED
from daebench.studies.diagnose.battery import Battery, Map, attempted
from daebench.studies.diagnose.mechanics import Mechanics, State, largest, multiples

MOVED = 1e-2
"""How far states are moved off the manifold, relative to the largest momentum and position."""

SMALL = 1e-3
"""The step in units of the battery's with which a feedback shows; rates are extrapolated from a step, its half and its quarter."""

FEEDBACK_FITS = 1e-5
"""Largest relative residual of the feedback that is fitted."""

LEFT = 1e-6
"""Least |g| relative to the size of G and q that is off the manifold."""

BIASED = 1e-11
"""Largest residual of a bias, relative to the size of G and q."""

SIZES = (0.1, 0.02, 0.004, 0.0008)
"""The steps from which limits are extrapolated, in units of the battery's; an iteration that ends early leaves more in small ones."""

OFF, OFF_SINGLE = 1e-3, 2e-2
"""How far a rate is from that of the problem where it is another one, relative to the largest; in float64 and in float32."""

SURE = 10.0
"""How many times the difference of two limits from different steps a rate is off."""

FITS = 0.05
"""Part of what is off that may remain where an explanation is given."""

PLAIN = 1e-3
"""Largest distance of a factor from one with which nothing is said of it."""


# ---- rates


def rates(step: Map, p: Array, q: Array, h: float) -> State | None:
    """Return p' and q' as h goes to zero, extrapolated twice; None where the step jumps."""
    quotients = []
    for size in (h, h / 2, h / 4):
        p1, q1 = attempted(step, p, q, size)
        quotients.append(np.array([p1 - p, q1 - q]) / size)
    if not np.isfinite(quotients).all():
        return None
    once = [2 * finer - coarser for coarser, finer in pairwise(quotients)]
    rate_p, rate_q = (4 * once[1] - once[0]) / 3
    return rate_p, rate_q


# ---- off the manifold


@dataclass(frozen=True)
class Feedback:
    """The constraint that a code's accelerations meet: g'' = -damping g' - stiffness g."""

    damping: float
    stiffness: float
    """2 alpha and beta^2 of Baumgarte, 1/s and 1/s^2; zero for index-reduced equations."""
    residual: float
    """What is left over, relative to the accelerations."""


def feedback(battery: Battery, step: Map) -> Feedback | None:
    """Return the feedback that the code's accelerations show off the manifold, None where they are those of no index-reduced equations."""
    mechanics, draw = battery.mechanics, np.random.default_rng(11)
    size_p, size_q = battery.scales
    columns, targets, size, rest = [], [], 0.0, 0.0
    for point in battery.points:
        p = point.p + MOVED * size_p * draw.standard_normal(len(point.p))
        q = point.q + MOVED * size_q * draw.standard_normal(len(point.q))
        limits = rates(step, p, q, SMALL * battery.h)
        if limits is None or not largest(limits[0]):  # or a step without any force
            return None
        rate_p, rate_q = limits
        G, W, v = mechanics.gradient(q), mechanics.inverse_mass(q), mechanics.velocity(p, q)
        pull = -(rate_p + mechanics.reduced_slope(p, q))
        lam = multiples(G, pull)
        rest = max(rest, largest(pull - G.T @ lam) / largest(rate_p), largest(rate_q - v) / largest(v))
        columns.append(np.stack([G @ v, mechanics.constraint(q)], axis=1))
        targets.append(G @ W @ G.T @ lam)
        size = max(size, largest(G @ W @ rate_p))
    A, b = np.concatenate(columns), np.concatenate(targets)
    numbers, *_ = np.linalg.lstsq(A, b, rcond=None)
    residual = max(rest, largest(A @ numbers - b) / size)
    if not residual <= FEEDBACK_FITS:
        return None
    acts = largest(A @ numbers) > 10 * FEEDBACK_FITS * size
    damping, stiffness = (float(f"{value:.4g}") if acts else 0.0 for value in numbers)  # about as many digits are known
    return Feedback(damping, stiffness, residual)


def bias(battery: Battery) -> float | None:
    """Return c where velocities are solved for with a bias, G(q0) (q1 - q0) = -c g(q0), as game engines do; None where they are not.

    It shows in steps from states of the code's own run, which has left the manifold.
    """
    mechanics, points = battery.mechanics, battery.points
    g = np.concatenate([mechanics.constraint(point.q) for point in points])
    taken = -np.concatenate([mechanics.gradient(point.q) @ (point.after[1] - point.q) for point in points])
    size = largest(*(mechanics.gradient(point.q) for point in points)) * battery.scales[1]
    if largest(g) < LEFT * size:
        return None
    c = float(g @ taken / (g @ g))
    return c if largest(taken - c * g) <= BIASED * size and 0 < c < 1 else None


# ---- on the manifold


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

    @property
    def off(self) -> float:
        """The largest component of the distance."""
        return largest(self.given - self.right)


def on_manifold(battery: Battery) -> Iterator[State]:
    """Yield the states before steps that meet both constraints: a code that keeps only one may leave others."""
    mechanics, rounding = battery.mechanics, battery.rounding(CONFIRMED)
    for point in battery.points:
        v, G = mechanics.velocity(point.p, point.q), mechanics.gradient(point.q)
        tangent = largest(G @ v) <= rounding * largest(G) * largest(v)
        if tangent and mechanics.distance(point.q) <= rounding * battery.scales[1]:
            yield point.p, point.q


def _limits(battery: Battery, step: Map, states: Iterable[State]) -> tuple[list[Rate], list[Rate]]:
    """Return the rates of q in some states, and those of p beside the gradients of the constraints, where there are limits.

    Each is taken from the two neighbouring sizes of the step whose limits differ least.
    """
    mechanics, moving, pushed = battery.mechanics, [], []
    for p, q in states:
        limits = [limit for size in SIZES if (limit := rates(step, p, q, size * battery.h))]
        if len(limits) < 2:
            continue
        rate: list[Array] = []
        error: list[float] = []
        for some in zip(*limits, strict=True):
            apart = [largest(one - other) for one, other in pairwise(some)]
            rate.append(some[int(np.argmin(apart)) + 1])
            error.append(min(apart))
        away = projector(mechanics, q)
        moving.append(Rate(p, q, rate[1], mechanics.velocity(p, q), error[1]))
        pushed.append(Rate(p, q, away @ rate[0], -away @ mechanics.slope(p, q), error[0]))
    return moving, pushed


def projector(mechanics: Mechanics, q: Array) -> Array:
    """Return the matrix that takes away what is along the gradients."""
    G = mechanics.gradient(q)
    return np.asarray(np.eye(len(q)) - np.linalg.pinv(G) @ G)


def settled(limits: Sequence[Rate]) -> bool:
    """Return whether there are limits: they are known better than the size of the rates."""
    return bool(limits) and max(rate.error for rate in limits) * SURE <= _size(limits)


def off(battery: Battery, limits: Sequence[Rate]) -> bool:
    """Return whether rates are others than the problem's, by more than they are known to."""
    least = (OFF_SINGLE if battery.single else OFF) * _size(limits)
    return any(rate.off > max(least, SURE * rate.error) for rate in limits)


def _size(limits: Sequence[Rate]) -> float:
    return max(largest(rate.given, rate.right) for rate in limits)


def other_equations(battery: Battery, step: Map) -> str:
    """Return in which equations a code's steps have their limit, "" where they are the problem's, or there is no limit.

    Rates of p are compared beside the gradients of the constraints: what is along them is a matter of multipliers. Which force a code has
    that has another mass shows from rest, where no mass counts.
    """
    states = list(on_manifold(battery))
    moving, pushed = _limits(battery, step, states)
    if not settled(moving):
        return ""
    parts = []
    if off(battery, moving):
        parts.append(_of_mass(battery.mechanics, moving))
        _, pushed = _limits(battery, step, [(np.zeros_like(p), q) for p, q in states])
    if settled(pushed) and off(battery, pushed):
        parts.append(_of_force(battery.mechanics, pushed))
    return f"as h goes to zero the step solves other equations: {'; '.join(parts)}" if parts else ""


def _of_mass(mechanics: Mechanics, limits: Sequence[Rate]) -> str:
    """Return which masses explain rates of q: M' q' = p beside the gradients, M' with the entries of M that are not zero."""
    if (factor := _common(limits)) is not None:
        return f"q' is {factor:.4g} times M^-1 p" if mechanics.separable else f"q' is {factor:.4g} times H_p"
    if mechanics.separable and (entries := _entries(mechanics, limits)):
        return f"q' is that of another mass matrix, {entries}"
    return f"q' is off by {_components('q', limits)}"


def _entries(mechanics: Mechanics, limits: Sequence[Rate]) -> str:
    """Return the entries of M that differ, "" where none explain the rates: those of one value first, then all."""
    M = mechanics.mass(limits[0].q)
    away = [projector(mechanics, rate.q) for rate in limits]
    target = np.concatenate([P @ (rate.p - M @ rate.given) for P, rate in zip(away, limits, strict=True)])
    pairs = [(i, j) for i, j in zip(*np.nonzero(M), strict=True) if i <= j]
    columns = np.stack([np.concatenate([P @ _times(i, j, x.given) for P, x in zip(away, limits, strict=True)]) for i, j in pairs], axis=1)
    for some in _subsets(mechanics, pairs):
        change, rest = _fitted(columns[:, some], target)
        if rest <= FITS * largest(target):
            news = [(pairs[k], M[pairs[k]], c) for k, c in zip(some, change, strict=True)]
            return _listed(
                f"M[{i + 1},{j + 1}] = {old + c if abs(old + c) > PLAIN * abs(old) else 0.0:.4g} in place of {old:.4g}"
                for (i, j), old, c in news
                if abs(c) > PLAIN * abs(old)
            )
    return ""


def _subsets(mechanics: Mechanics, pairs: Sequence[tuple[int, int]]) -> Iterator[list[int]]:
    """Yield entries that may be wrong together: one, those of two or three neighbouring positions, which are a body, and all."""
    for length in (1, 2, 3):
        for first in range(mechanics.ivp.d - length + 1):
            if some := [k for k, (i, j) in enumerate(pairs) if first <= i and j < first + length]:
                yield some
    yield list(range(len(pairs)))


def _times(i: int, j: int, vector: Array) -> Array:
    """Return the product of a vector and the symmetric matrix whose entries i, j and j, i are one."""
    product = np.zeros_like(vector)
    product[i], product[j] = vector[j], vector[i]
    return product


def _fitted(columns: Array, target: Array) -> tuple[Array, float]:
    """Return the factors of columns whose sum is nearest to a vector, and what is left."""
    factors, *_ = np.linalg.lstsq(columns, target, rcond=1e-9)
    return np.asarray(factors, dtype=float), largest(columns @ factors - target)


def _of_force(mechanics: Mechanics, limits: Sequence[Rate]) -> str:
    """Return how the force differs: by one factor, by factors in components, by a constant, or in which components."""
    if (factor := _common(limits)) is not None:
        return "p' is that of " + _times_the("problem's force", factor)
    away = [projector(mechanics, rate.q) for rate in limits]
    forces = [P * -mechanics.slope(rate.p, rate.q) for P, rate in zip(away, limits, strict=True)]
    target = np.concatenate([rate.given - rate.right for rate in limits])
    if factors := _explained(target, np.concatenate(forces)):
        return "p' is that of " + _listed(f"{_times_the('force', 1 + c)} in component {k + 1}" for k, c in factors)
    if constants := _explained(target, np.concatenate(away)):
        return "p' is that of a force with " + _listed(f"{c:.4g} more in component {k + 1}" for k, c in constants)
    return f"p' is off by {_components('p', limits)}"


def _explained(target: Array, columns: Array) -> list[tuple[int, float]]:
    """Return the fewest neighbouring columns that give a vector, and their factors; none where they do not."""
    d = columns.shape[1]
    for length in range(1, d + 1):
        fits = [(first, *_fitted(columns[:, first : first + length], target)) for first in range(d - length + 1)]
        first, factors, rest = min(fits, key=lambda fit: fit[2])
        if rest <= FITS * largest(target):
            return [(k, float(c)) for k, c in enumerate(factors, first) if abs(c) > PLAIN]
    return []


# ---- words


def _common(limits: Sequence[Rate]) -> float | None:
    """Return the factor of all rates, None where they have none in common."""
    given, right = (np.concatenate([getattr(rate, name) for rate in limits]) for name in ("given", "right"))
    if not np.any(right):
        return None
    factor = float(right @ given / (right @ right))
    return factor if largest(given - factor * right) <= FITS * largest(given - right) else None


def _times_the(what: str, factor: float) -> str:
    return f"{factor:.4g} times the {what}" if abs(factor) > PLAIN else "no force"


def _components(name: str, limits: Sequence[Rate]) -> str:
    """Return the components that are off, and by how much."""
    apart = np.max(np.abs([rate.given - rate.right for rate in limits]), axis=0)
    return _listed(f"{apart[k]:.3g} in {name}{k + 1}'" for k in np.flatnonzero(apart > FITS * np.max(apart)))


def _listed(words: Iterator[str]) -> str:
    *others, last = words
    return f"{', '.join(others)} and {last}" if others else last
