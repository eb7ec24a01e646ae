"""The parts of a mechanism in words: its bodies, its forces, and the quantity that each of its equations keeps."""

from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True, kw_only=True)
class Parts:
    """Parts of a mechanism in words."""

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
    mechanism: Any = field(default=None, repr=False, compare=False)
    """The mechanism itself, for the forces in its joints."""
