"""Boxes: bounds of coordinates by name, q1, p2 or y1, and of parameters that differ from member to member."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from daebench.errors import BadInput, unknown
from daebench.runs.ivp import Array, Ivp

Bounds = Mapping[str, tuple[float, float]]
"""Lower and upper bound of a coordinate or parameter by its name."""


def coordinates(ivp: Ivp) -> dict[str, tuple[int, int]]:
    """Return the names of the coordinates of a start, each with its place: which vector, and which component."""
    return {f"{letter}{i + 1}": (k, i) for k, letter in enumerate(ivp.state.vectors) for i in range(len(ivp.start[k]))}


def columns(ivp: Ivp) -> dict[str, int]:
    """Return the names of the coordinates of a state, each with its column in states as they are stored, (p, q) or y."""
    first = np.cumsum([0, *map(len, ivp.start)])
    return {name: int(first[vector]) + place for name, (vector, place) in coordinates(ivp).items()}


def bounds_of(name: str, given: Any, *, infinite: bool = False) -> tuple[float, float]:
    """Return a lower and an upper bound as two numbers."""
    try:
        lo, hi = (float(value) for value in given)
    except (TypeError, ValueError):
        raise BadInput(f"the bounds of {name} are {given!r}; give two numbers, (lo, hi).", "bounds-malformed") from None
    if math.isnan(lo + hi) and not (infinite and math.isinf(lo) and math.isinf(hi)):
        raise BadInput(f"the bounds of {name} are {given!r}; give two numbers, (lo, hi).", "bounds-malformed")
    if not infinite and not (math.isfinite(lo) and math.isfinite(hi)):
        raise BadInput(f"the bounds of {name}, {lo:g} and {hi:g}, must be finite.", "bounds-not-finite")
    if not lo < hi:
        raise BadInput(f"the lower bound of {name}, {lo:g}, must be less than the upper one, {hi:g}.", "bounds-out-of-order")
    return lo, hi


def box_of(ivp: Ivp, box: Bounds, allowed: str) -> tuple[tuple[Array, Array], ...]:
    """Return lower and upper bounds of each vector of a start, infinite where a coordinate is not named."""
    places = coordinates(ivp)
    vectors = tuple((np.full(len(vector), -np.inf), np.full(len(vector), np.inf)) for vector in ivp.start)
    for name, given in box.items():
        if name not in places or name[0] not in allowed:
            raise unknown(f"coordinate of {ivp.problem} in a box", name, [place for place in places if place[0] in allowed])
        k, i = places[name]
        vectors[k][0][i], vectors[k][1][i] = bounds_of(name, given, infinite=True)
    return vectors


def require_bounded(ivp: Ivp, bounds: tuple[Array, Array], letter: str, why: str) -> None:
    """Refuse a vector of which a component has no finite bounds."""
    free = [f"{letter}{i + 1}" for i in np.flatnonzero(~np.isfinite(bounds[0]) | ~np.isfinite(bounds[1]))]
    if free:
        raise BadInput(f"a box in the states of {ivp.problem} needs finite bounds of {', '.join(free)}: {why}.", "box-unbounded")


def excess(x: Array, bounds: tuple[Array, Array]) -> Array:
    """Return how far states are outside of their bounds: the sum over components, each relative to the width where that is finite.

    Shapes: x (d, n); bounds (d,).
    """
    total = np.zeros(x.shape[1])
    for row, lo, hi in zip(x, *bounds, strict=True):
        if np.isfinite(lo) or np.isfinite(hi):
            width = hi - lo if np.isfinite(hi - lo) else 1.0
            total += (np.maximum(lo - row, 0.0) + np.maximum(row - hi, 0.0)) / width
    return total


def in_words(box: Bounds) -> str:
    """Return bounds as words, ``-1 <= p1 <= 1``; an infinite one is left out."""
    parts = []
    for name in sorted(box, key=_natural):
        lo, hi = (float(value) for value in box[name])
        parts.append(
            f"{lo:g} <= {name} <= {hi:g}"
            if math.isfinite(lo) and math.isfinite(hi)
            else f"{name} >= {lo:g}"
            if math.isfinite(lo)
            else f"{name} <= {hi:g}"
        )
    return " and ".join(parts)


def _natural(name: str) -> tuple[str, int]:
    match = re.fullmatch(r"(\D+)(\d+)", name)
    return (match[1], int(match[2])) if match else (name, 0)


@dataclass(frozen=True)
class Vary:
    """Parameters uniform between bounds, independent of each other and of the starts.

    Parameters
    ----------
    box : mapping of str to (float, float)
        Bounds by the names of parameters.
    """

    box: Bounds = field(default_factory=dict)

    def parameters(self, ivp: Ivp, n: int, seed: int) -> dict[str, Array]:
        """Return the values of each parameter, shape(n,); those of a member are the same however many there are.

        Raises
        ------
        BadInput
            If a name is unknown, bounds are no bounds, or a parameter that must be positive could be zero.
        """
        values = {}
        names = list(ivp.parameters)
        for name, given in self.box.items():
            if name not in ivp.parameters:
                raise unknown(f"parameter of {ivp.problem}", name, names)
            lo, hi = bounds_of(name, given)
            if name in ivp.facts.POSITIVE and not lo > 0:
                raise BadInput(
                    f"{name} of {ivp.problem} must be greater than 0, and its lower bound is {lo:g}.", "lower-bound-not-positive"
                )
            values[name] = np.random.default_rng([seed, 6, names.index(name)]).uniform(lo, hi, n)
        return values

    @property
    def about(self) -> str:
        """The distribution as part of a sentence."""
        return f"parameters uniform in {in_words(self.box)}"
