"""The parts of a mechanism in words: its bodies, its forces, and the quantity that each of its equations keeps."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Parts:
    """Parts of a mechanism in words.

    Parameters
    ----------
    constraints : tuple of str
        What each constraint keeps, in the order of g.
    dropped : tuple of str
        Joints that add no equation, each in a sentence that says which keep them.
    forces : tuple of str
        Springs, dampers and drivers.
    bodies : tuple of tuple of str
        Name, kind, mass, moments of inertia, place and size of each body.
    doubts : tuple of str
        Bodies and points with a number that is far from those of others, each in a sentence.
    """

    constraints: tuple[str, ...]
    dropped: tuple[str, ...] = ()
    forces: tuple[str, ...] = ()
    bodies: tuple[tuple[str, ...], ...] = ()
    doubts: tuple[str, ...] = ()
