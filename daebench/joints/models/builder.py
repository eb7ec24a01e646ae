"""Points and directions of links under their names: those that two links share are joints that take no equation."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from daebench.joints.bodies import Body
from daebench.joints.models.links import FIXED, Array, Link
from daebench.joints.models.names import Names
from daebench.joints.models.space import ROUNDED, Space, parallel, rounded
from daebench.joints.placing import GROUND

APART = 0.3
"""Least singular value of the unit vectors that the unknowns of a body are chosen by: with less they are nearly in one plane."""


@dataclass(frozen=True)
class Fixed:
    """A point (weight 1) or direction (weight 0) that is fixed in a link."""

    link: int
    place: Array
    """At the reference position, shape(3,)."""
    weight: int


@dataclass
class Builder:
    """The points and directions of all links that have names so far."""

    space: Space
    names: Names
    links: dict[int, Link]
    size: float
    """Length with which places are compared, m."""
    fixed: dict[str, Fixed] = field(default_factory=dict)
    """By name: the link that had it first."""
    of: dict[int, list[str]] = field(default_factory=dict)
    """Names that each link has; those that it shares with its parent are first."""
    shared: dict[int, int] = field(default_factory=dict)
    """How many these are."""
    guides: dict[str, Sequence[Array]] = field(default_factory=dict)

    def point(self, link: int, place: Array, name: str) -> str:
        """Return the name of a point of a link, one that it has there, or this one."""
        for other in self.of.setdefault(link, []):
            there = self.fixed[other]
            if there.weight and np.linalg.norm(there.place - place) < ROUNDED * self.size:
                return other
        return self._new(link, Fixed(link, place, 1), name)

    def direction(self, link: int, along: Array, name: str) -> str:
        """Return the name of a direction of a link, one that it has along the same line, or this one."""
        for other in self.of.setdefault(link, []):
            there = self.fixed[other]
            if not there.weight and parallel(there.place, along):
                return other
        return self._new(link, Fixed(link, along, 0), name)

    def _new(self, link: int, where: Fixed, name: str) -> str:
        name = self.names.new(name)
        self.fixed[name] = where
        self.of[link].append(name)
        return name

    def share(self, link: int, names: Sequence[str]) -> None:
        """Give a link points and directions of its parent, or its own first ones."""
        there = self.of.setdefault(link, [])
        there += [name for name in names if name not in there]
        self.shared[link] = len(there)

    def joined(self, link: int, point: str) -> bool:
        """Give a link a point of an earlier one, if its first independent names stay far from dependent; return whether it has it."""
        names, many = self.of[link], self.shared[link]
        first = self.fixed[names[0]].place
        vectors = [self._unit(name, first) for name in (*names[1:many], point)]
        ways = [x for x in vectors if x is not None]
        if len(ways) < len(vectors) or many > (1 if self.space.plane else 3) or _least(ways) < APART:
            return False
        names.insert(many, point)
        self.shared[link] += 1
        return True

    def named(self, link: int) -> str:
        """Return the name of a link as a joint has it."""
        return GROUND if link == FIXED else self.links[link].name

    def body(self, link: Link) -> Body:
        """Return the body of a link."""
        names, space = self._ordered(link), self.space
        centre = next((x for x in names if self.fixed[x].weight and self._near(x, link.centre)), None)
        return Body(
            *names,
            mass=rounded(link.mass),
            centre=centre or space.vector(link.centre, self.size),
            inertia=space.inertia(link.inertia),
        )

    def _near(self, name: str, place: Array) -> bool:
        return bool(np.linalg.norm(self.fixed[name].place - place) < ROUNDED * self.size)

    def _ordered(self, link: Link) -> list[str]:
        """Return the names of a link in an order in which the first independent ones are far from dependent.

        Its unknowns are those. Axes of the space are added where it has too few.
        """
        names, needed = list(self.of[link.number]), 1 if self.space.plane else 3
        chosen = names[: self.shared[link.number]]
        first = self.fixed[chosen[0]].place
        vectors = [x for name in chosen[1:] if (x := self._unit(name, first)) is not None]
        rest = [(name, x) for name in names[len(chosen) :] if (x := self._unit(name, first)) is not None]
        while _rank(vectors) < needed and rest:
            name, x = max(rest, key=lambda pair: _least([*vectors, pair[1]]))
            if _least([*vectors, x]) < APART:
                break
            rest.remove((name, x))
            chosen.append(name)
            vectors.append(x)
        while _rank(vectors) < needed:
            x = max(np.eye(len(self.space.axes)), key=lambda axis: _least([*vectors, axis]))
            letter = "xyz"[int(np.argmax(self.space.axes.T @ x))]
            chosen.append(self._new(link.number, Fixed(link.number, self.space.axes.T @ x, 0), f"{link.name}_{letter}"))
            vectors.append(x)
        return [*chosen, *(name for name in names if name not in chosen)]

    def _unit(self, name: str, first: Array) -> Array | None:
        """Return the unit vector from a link's first point to another, or of a direction; None for a point at the same place."""
        there = self.fixed[name]
        vector = self.space.axes @ (there.place - there.weight * first)
        length = float(np.linalg.norm(vector))
        return None if length < ROUNDED * self.size else vector / length


def _least(vectors: Sequence[Array]) -> float:
    return float(np.linalg.svd(np.array(vectors), compute_uv=False)[-1]) if len(vectors) <= len(vectors[0]) else 0.0


def _rank(vectors: Sequence[Array]) -> int:
    return int(np.linalg.matrix_rank(np.array(vectors), tol=1e-6)) if vectors else 0
