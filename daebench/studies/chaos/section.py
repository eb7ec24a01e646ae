"""A Poincare section of motions that start on a plane: where a third coordinate comes through a value, upwards."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.diagnostics.freedom import freedom
from daebench.errors import BadInput, real, unknown
from daebench.methods.ensemble.run import run_members
from daebench.methods.fixed_step.base import FixedStepMethod
from daebench.runs.ivp import Array, Ivp
from daebench.runs.request import Request
from daebench.starts.box import columns, coordinates
from daebench.studies.chaos.plane import Plane

MOTIONS = 64
"""Motions whose crossings are drawn, evenly chosen from the starts of a plane."""

MOST_STATES = 2_000_000
"""States that are stored at most, of all motions together: a motion of more steps is looked at in its first ones."""


@dataclass(frozen=True)
class Section:
    """Crossings of a surface, by motions from a plane of starts."""

    name: str
    """The coordinate that comes through a value."""
    value: float
    """The value."""
    start: NDArray[np.intp]
    """Which start of the plane each crossing is of; shape (k,)."""
    across: Array
    up: Array
    """The coordinates of the plane there; shape (k,)."""


def surface(ivp: Ivp, given: Mapping[str, float] | None, plane: Mapping[str, Any] | None, energy: Any) -> tuple[str, float] | None:
    """Return the coordinate and the value of a section, or None where none is asked for."""
    if not given:
        return None
    if len(given) != 1:
        raise BadInput(f"a section is one coordinate with its value, for example q3=0, not {len(given)}.")
    ((name, value),) = given.items()
    if not _of_two_degrees(ivp):
        raise BadInput(f"a section is for constrained problems of two degrees of freedom, which {ivp.problem} is not; leave it out.")
    if energy is None:
        raise BadInput("a section shows motions of one energy; give an energy, too.")
    known = [other for other in coordinates(ivp) if other[0] == "q"]
    if name not in known:
        raise unknown(f"position of {ivp.problem} to cut at", name, known)
    if not plane or name in plane:
        raise BadInput(f"a section at {name} takes a plane of two other coordinates; name them.")
    return name, real(name, value)


def _of_two_degrees(ivp: Ivp) -> bool:
    """Return whether it is a constrained problem of two degrees of freedom whose energy is constant."""
    if not ivp.on_manifold or ivp.facts.EXTENDED:
        return False
    counted = freedom(ivp)
    return (counted.degrees if counted else ivp.d - ivp.m) == 2


def section_of(method: FixedStepMethod[Any, Any], plane: Plane, cut: tuple[str, float], steps: int, threads: int | None) -> Section:
    """Return the crossings of motions from a plane of starts, each interpolated linearly between two steps."""
    chosen = np.unique(np.linspace(0, len(plane.cells) - 1, min(MOTIONS, len(plane.cells))).astype(int))
    steps = max(1, min(steps, MOST_STATES // len(chosen)))
    request = Request(value=plane.members.h, steps=steps, every=1, watch=(), count=False)
    states = run_members(method, plane.members.some(chosen), request, threads=threads).states
    places = columns(plane.members.ivp)
    name, value = cut
    height = states[:, :, places[name]] - value
    row, motion = np.nonzero((height[:-1] < 0) & (height[1:] >= 0))
    part = height[row, motion] / (height[row, motion] - height[row + 1, motion])
    across, up = ((1 - part) * states[row, motion, places[other]] + part * states[row + 1, motion, places[other]] for other in plane.names)
    return Section(name, value, chosen[motion], across, up)
