"""A plane of starts, two coordinates on a grid and the others moved until the start is on the manifold, of one energy if asked.

A Poincare section shows where motions from there come through a value of a third coordinate, upwards.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.diagnostics.freedom import freedom
from daebench.diagnostics.symplecticity import tangent_basis
from daebench.errors import BadInput, real, unknown, whole
from daebench.methods.ensemble.run import run_members
from daebench.methods.fixed_step.base import FixedStepMethod
from daebench.runs.ivp import Array, Ivp
from daebench.runs.make_ivp import constrained
from daebench.runs.members import Members, members
from daebench.runs.request import Request
from daebench.runs.scales import constrained_scales_of
from daebench.runs.texts import bounds, number, words
from daebench.starts.box import Bounds, bounds_of, columns, coordinates
from daebench.studies.chaos.cells import INDEPENDENT, Cells

OUTSIDE = "outside of the domain"
"""Why a cell has no start."""

MOST_CELLS = 256
"""Most cells along a side, whose growth in two thousand intervals is a gigabyte."""


def plane_in(text: str) -> dict[str, tuple[float, float] | None]:
    """Return two coordinates with their bounds, or None in place of these, of a text such as q1=-1:1,p2."""
    parts = words(text)
    bounded = bounds("--plane", [part for part in parts if "=" in part]) or {}
    return {name: bounded.get(name) for name in (part.partition("=")[0].strip() for part in parts)}


def energy_in(text: str) -> float | str:
    """Return the energy in a text, which may be that of the case."""
    return text if text == "case" else number("--energy", text)


@dataclass(frozen=True)
class Plane:
    """A grid of starts over two coordinates.

    Parameters
    ----------
    names : (str, str)
        The coordinates across and up.
    across, up : ndarray, shape(c,) and shape(r,)
        Their values at the centres of cells.
    members : Members
        The starts that there are.
    cells : ndarray of int, shape(n,)
        The cell of each, counted row by row.
    reasons : ndarray of str, shape(r * c,)
        Why there is no start in a cell; "" where there is one.
    about : str
        A sentence that says what the starts are.
    """

    names: tuple[str, str]
    across: Array
    up: Array
    members: Members
    cells: NDArray[np.intp]
    reasons: NDArray[np.str_]
    about: str

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return len(self.up), len(self.across)

    def spread(self, values: Array, empty: Any = np.nan) -> Any:
        """Return numbers or words of the starts as those of cells, shape(r, c)."""
        filled = np.full(self.reasons.shape, empty, dtype=np.result_type(values.dtype, type(empty)))
        filled[self.cells] = values
        return filled.reshape(self.shape)


def plane_of(
    ivp: Ivp,
    names: Mapping[str, tuple[float, float] | None] | None,
    *,
    cells: int,
    h: float,
    energy: float | str | None = None,
    cut: tuple[str, float] | None = None,
) -> Plane:
    """Return the starts of a plane.

    The coordinates of the plane are those of the cell exactly. The others begin with their values in the case, or in a cell beside it, and
    are moved to the nearest ones on the manifold, positions first, in the metric of kinetic energy; where an energy is given, momenta are
    moved to that too. What cannot be reached so is an empty cell.

    Parameters
    ----------
    ivp : InitialValueProblem
        The problem; its start is where others are sought from.
    names : mapping of str to (float, float) or None, optional
        Two coordinates, as q1, p2 or y1, with bounds, or None for bounds about the start. The default is the first two that are independent
        on the manifold.
    cells : int
        Cells along a side.
    h : float
        Step size of the members, s.
    energy : float or "case", optional
        Energy of all starts, or that of the problem's start.
    cut : (str, float), optional
        A third coordinate and its value in all starts.

    Raises
    ------
    BadInput
        If names or numbers are invalid, or no start is found.
    """
    if not 2 <= whole("cells", cells) <= MOST_CELLS:
        raise BadInput(f"cells = {cells} must be from 2 to {MOST_CELLS} along a side.", "cells-out-of-range")
    if ivp.arrays:
        raise BadInput(
            f"a plane of starts needs short vectors, and those of {ivp.problem} are arrays; choose fewer bodies or sites.",
            "plane-of-arrays",
        )
    bounds = _bounds(ivp, names)
    first, second = bounds
    across, up = (_centres(*bounds[name], cells) for name in bounds)
    values = {first: np.tile(across, cells), second: np.repeat(up, cells), **({cut[0]: np.full(cells * cells, cut[1])} if cut else {})}
    start = tuple(np.repeat(vector[None], cells * cells, axis=0) for vector in ivp.start)
    for name, numbers in values.items():
        vector, place = coordinates(ivp)[name]
        start[vector][:, place] = numbers
    some = members(ivp, start, h, {})
    level = _level(ivp, energy)
    reasons = np.full(cells * cells, "", dtype="U40")
    if not ivp.on_manifold and ivp.facts.DOMAIN:
        reasons[~some.along("inside", some.start[0]).astype(bool)] = OUTSIDE
    if ivp.on_manifold:
        start = Cells(ivp, some, list(values), level, cells).settled(reasons)
    there = np.flatnonzero(reasons == "")
    if not len(there):
        why, count = _most_common(reasons)
        raise BadInput(
            f"no start of the plane {first}, {second} of {ivp.problem}: {why} in {count} of {cells * cells} cells; change its bounds.",
            "plane-without-starts",
        )
    about = _about(ivp, bounds, cells, len(there), level, cut)
    return Plane((first, second), across, up, members(ivp, tuple(part[there] for part in start), h, {}), there, reasons, about)


def _most_common(reasons: NDArray[np.str_]) -> tuple[str, int]:
    words, counts = np.unique(reasons, return_counts=True)
    return str(words[np.argmax(counts)]), int(np.max(counts))


def _about(ivp: Ivp, bounds: Bounds, cells: int, there: int, level: float | None, cut: tuple[str, float] | None) -> str:
    ranges = " and ".join(f"{name} from {lo:g} to {hi:g}" for name, (lo, hi) in bounds.items())
    of_energy = "" if level is None else f", all of energy {level:.6g}"
    where = "" if cut is None else f", at {cut[0]} = {cut[1]:g}"
    return f"{there} starts in {cells} x {cells} cells of {ranges}{where}, about {ivp.problem}, case {ivp.case}{of_energy}."


def _centres(lo: float, hi: float, cells: int) -> Array:
    return lo + (hi - lo) * (np.arange(cells) + 0.5) / cells


def _level(ivp: Ivp, energy: float | str | None) -> float | None:
    """Return the energy that all starts are to have, or None."""
    if energy is None:
        return None
    constrained(ivp, "whose starts are not moved to an energy; leave out the energy")
    if energy == "case":
        return float(ivp.value("H", *ivp.start))
    if isinstance(energy, str):
        raise BadInput(f"energy {energy!r} must be a number, or case for the energy of the case.", "plane-energy-malformed")
    return real("energy", energy)


def _bounds(ivp: Ivp, names: Mapping[str, tuple[float, float] | None] | None) -> dict[str, tuple[float, float]]:
    """Return the names of two coordinates with their bounds."""
    known = coordinates(ivp)
    chosen = dict(names) if names is not None else dict.fromkeys(_independent(ivp))
    if len(chosen) != 2:
        raise BadInput(f"a plane has two coordinates, for example q1 and p2, not {len(chosen)}.", "plane-not-two-coordinates")
    for name in chosen:
        if name not in known:
            raise unknown(f"coordinate of {ivp.problem}", name, known)
    return {name: bounds_of(name, given) if given is not None else _about_start(ivp, name) for name, given in chosen.items()}


def _independent(ivp: Ivp) -> list[str]:
    """Return the first two coordinates, positions first, that can be changed independently along the manifold at the start."""
    known = coordinates(ivp)
    names = [*(name for name in known if name[0] != "p"), *(name for name in known if name[0] == "p")]
    ends = np.cumsum([0, *map(len, ivp.start)])
    basis = tangent_basis(ivp, *ivp.start) if ivp.on_manifold else np.eye(ivp.size)
    chosen: list[str] = []
    for name in names:
        rows = [basis[ends[vector] + place] for vector, place in (known[other] for other in (*chosen, name))]
        if np.linalg.svd(np.array(rows), compute_uv=False)[-1] > INDEPENDENT:
            chosen.append(name)
        if len(chosen) == 2:
            return chosen
    raise BadInput(f"{ivp.problem} has no two independent coordinates, and thus no plane of starts.", "no-plane-of-starts")


def _about_start(ivp: Ivp, name: str) -> tuple[float, float]:
    """Return bounds about the start, as far off as it is large."""
    vector, place = coordinates(ivp)[name]
    centre = float(ivp.start[vector][place])
    if not ivp.on_manifold:
        reach = float(np.max(np.abs(ivp.start[vector]))) / 2 or 1.0
        return centre - reach, centre + reach
    length, rate = (float(x[0]) for x in constrained_scales_of(members(ivp, tuple(v[None] for v in ivp.start), 1.0, {}), rated=True))
    reach = length / 2
    if name[0] == "p":
        mass = float(np.max(np.abs(ivp.value("mass", *ivp.start))))
        reach = max(float(np.max(np.abs(ivp.start[0]))), mass * length * rate) / 2
    return centre - (reach or 1.0), centre + (reach or 1.0)


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
        raise BadInput(f"a section is one coordinate with its value, for example q3=0, not {len(given)}.", "section-malformed")
    ((name, value),) = given.items()
    if not _of_two_degrees(ivp):
        raise BadInput(
            f"a section is for constrained problems of two degrees of freedom, which {ivp.problem} is not; leave it out.",
            "section-not-two-degrees",
        )
    if energy is None:
        raise BadInput("a section shows motions of one energy; give an energy, too.", "section-without-energy")
    known = [other for other in coordinates(ivp) if other[0] == "q"]
    if name not in known:
        raise unknown(f"position of {ivp.problem} to cut at", name, known)
    if not plane or name in plane:
        raise BadInput(f"a section at {name} takes a plane of two other coordinates; name them.", "section-of-plane-coordinate")
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
