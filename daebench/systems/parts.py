"""The parts of a mechanism in words: its bodies, its forces, and the quantity that each of its equations keeps; and its points by name."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from daebench.systems.lazily import sympy as sp


@dataclass(frozen=True, kw_only=True)
class Parts:
    """Parts of a mechanism in words, and the points and directions by which a start is given."""

    constraints: tuple[str, ...]
    """Quantity that each constraint keeps, in the order of g."""
    dropped: tuple[str, ...] = ()
    """Joints that add no equation, each in a sentence that says which keep them."""
    forces: tuple[str, ...] = ()
    """Springs, dampers and drivers."""
    bodies: tuple[tuple[str, ...], ...] = ()
    """Name, kind, mass, moments of inertia, place and size of each body."""
    doubts: tuple[str, ...] = ()
    """Bodies and points with a number that is far from those of others, each in a sentence."""
    coordinates: tuple[str, ...] = ()
    """Name of each position, for example "x of B"."""
    places: Mapping[str, "sp.Matrix"] = field(default_factory=dict)
    """Points and directions, linear in the positions."""
    turning: Mapping[str, "Sequence[sp.Matrix]"] = field(default_factory=dict)
    """Directions of each body, which turn with it."""
    mechanism: Any = field(default=None, repr=False, compare=False)
    """The mechanism itself, for the forces in its joints."""
