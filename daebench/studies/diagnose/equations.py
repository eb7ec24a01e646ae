"""The equations that a code solves, if they are not those of the problem: the masses or forces that explain its rates."""

from collections.abc import Iterator, Sequence

import numpy as np

from daebench.runs.ivp import Array
from daebench.studies.diagnose.battery import Battery, Map
from daebench.studies.diagnose.limit import Rate, beside, limit_of, off, on_manifold, projector, settled
from daebench.studies.diagnose.mechanics import Mechanics

FITS = 0.05
"""Part of what is off that may remain where an explanation is given."""

PLAIN = 1e-3
"""Largest distance of a factor from one with which nothing is said of it."""


def other_equations(battery: Battery, step: Map) -> str:
    """Return in which equations a code's steps have their limit, "" where they are the problem's, or there is no limit.

    Rates of p are compared beside the gradients of the constraints: what is along them is a matter of multipliers.
    """
    mechanics = battery.mechanics
    limits = [(p, q, limit) for p, q in on_manifold(battery) if (limit := limit_of(step, p, q, battery))]
    if not limits:
        return ""
    moving = [Rate(p, q, at[1], mechanics.velocity(p, q), error[1]) for p, q, (at, error) in limits]
    if not settled(moving):
        return ""
    pushed = [beside(mechanics, p, q, at[0], error[0]) for p, q, (at, error) in limits]
    if not off(battery, moving):
        return _told(_of_force(battery, pushed)) if settled(pushed) and off(battery, pushed) else ""
    return _told(_of_mass(battery, moving), _at_rest(battery, step))


def _told(*parts: str) -> str:
    return f"as h goes to zero the step solves other equations: {'; '.join(part for part in parts if part)}"


# ---- the mass


def _of_mass(battery: Battery, limits: Sequence[Rate]) -> str:
    """Return which masses explain rates of q: M' q' = p beside the gradients, M' with the entries of M that are not zero."""
    mechanics = battery.mechanics
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
        change, *_ = np.linalg.lstsq(columns[:, some], target, rcond=1e-9)
        if np.max(np.abs(columns[:, some] @ change - target)) <= FITS * np.max(np.abs(target)):
            olds = [M[pairs[k]] for k in some]
            others = [(pairs[k], old, old + c) for k, old, c in zip(some, olds, change, strict=True) if abs(c) > PLAIN * abs(old)]
            return _listed(f"M[{i + 1},{j + 1}] = {_near(new, old):.4g} in place of {old:.4g}" for (i, j), old, new in others)
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


def _near(number: float, size: float) -> float:
    """Return a number that was fitted, zero where it is far below a size."""
    return number if abs(number) > PLAIN * abs(size) else 0.0


# ---- the force


def _at_rest(battery: Battery, step: Map) -> str:
    """Return which force a code has that has another mass: from rest, where no mass counts; "" where it is the problem's."""
    limits = []
    for p, q in on_manifold(battery):
        if limit := limit_of(step, np.zeros_like(p), q, battery):
            limits.append(beside(battery.mechanics, np.zeros_like(p), q, limit[0][0], limit[1][0]))
    return _of_force(battery, limits) if limits and settled(limits) and off(battery, limits) else ""


def _of_force(battery: Battery, limits: Sequence[Rate]) -> str:
    """Return how the force differs: by one factor, by factors in components, by a constant, or in which components."""
    if (factor := _common(limits)) is not None:
        return "p' is that of " + _times_the("problem's force", factor)
    mechanics = battery.mechanics
    forces = [-mechanics.slope(rate.p, rate.q) for rate in limits]
    away = [projector(mechanics, rate.q) for rate in limits]
    target = np.concatenate([rate.given - rate.right for rate in limits])
    if factors := _explained(target, np.concatenate([P * F for P, F in zip(away, forces, strict=True)])):
        return "p' is that of " + _listed(f"{_times_the('force', 1 + c)} in component {k + 1}" for k, c in factors)
    if constants := _explained(target, np.concatenate(away)):
        return "p' is that of a force with " + _listed(f"{c:.4g} more in component {k + 1}" for k, c in constants)
    return f"p' is off by {_components('p', limits)}"


def _explained(target: Array, columns: Array) -> list[tuple[int, float]]:
    """Return the fewest neighbouring columns that give a vector, and their factors; none where they do not."""
    d = columns.shape[1]
    for length in range(1, d + 1):
        best: tuple[float, list[tuple[int, float]]] = (np.inf, [])
        for first in range(d - length + 1):
            some = range(first, first + length)
            factors, *_ = np.linalg.lstsq(columns[:, some], target, rcond=1e-9)
            rest = float(np.max(np.abs(columns[:, some] @ factors - target)))
            best = min(best, (rest, list(zip(some, map(float, factors), strict=True))), key=lambda pair: pair[0])
        if best[0] <= FITS * np.max(np.abs(target)):
            return [(k, c) for k, c in best[1] if abs(c) > PLAIN]
    return []


# ---- words


def _common(limits: Sequence[Rate]) -> float | None:
    """Return the factor of all rates, None where they have none in common."""
    given, right = (np.concatenate([getattr(rate, name) for rate in limits]) for name in ("given", "right"))
    if not np.any(right):
        return None
    factor = float(right @ given / (right @ right))
    return factor if np.max(np.abs(given - factor * right)) <= FITS * np.max(np.abs(given - right)) else None


def _times_the(what: str, factor: float) -> str:
    return f"{factor:.4g} times the {what}" if abs(factor) > PLAIN else "no force"


def _components(name: str, limits: Sequence[Rate]) -> str:
    """Return the components that are off, and by how much."""
    apart = np.max(np.abs([rate.given - rate.right for rate in limits]), axis=0)
    return _listed(f"{apart[k]:.3g} in {name}{k + 1}'" for k in np.flatnonzero(apart > FITS * np.max(apart)))


def _listed(words: Iterator[str]) -> str:
    *others, last = words
    return f"{', '.join(others)} and {last}" if others else last
