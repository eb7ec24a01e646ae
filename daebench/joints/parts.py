"""The parts of a mechanism in words, and numbers of bodies that are far from those of others, as after a slip of a unit.

A slip of a unit is a factor of 1000, as of 5200 for 5.2, or more. Masses and sizes are held against those of all other bodies of a kind,
or of all kinds where there are fewer than two of its kind: one is doubted that is more than FAR times the largest of these, or less than
the least by that factor. Where none is, the mass for the length is. A moment of inertia is doubted where I / (mass size^2) is that far from
1/12, which it is of a rod, and a point where it is FAR times farther from all others than they are from each other.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import sympy as sp

from daebench.joints.bodies import AnyBody
from daebench.joints.constraints import Labelled
from daebench.joints.drivers import DrivenAngle, DrivenCoordinate, DrivenDistance, Driver
from daebench.joints.exact import Array, Values, exact, numbers
from daebench.joints.forces import Force, Spring
from daebench.joints.frames import Column
from daebench.joints.inertia import moments
from daebench.joints.joints import Distance, Joint

FAR = 100.0
"""Factor between a number and those of all others beyond which it is doubted."""

ROD = 1 / 12
"""I / (mass size^2) of a thin rod about its centre."""


@dataclass(frozen=True)
class _Row:
    """Numbers of a body: principal moments of inertia about its centre, in the plane one, and the largest distance of its points."""

    name: str
    kind: str
    mass: float
    inertia: Array
    centre: Array
    size: float

    @property
    def words(self) -> tuple[str, ...]:
        """Its numbers in words."""
        inertia = "" if self.kind == "PointMass" else ", ".join(f"{x:.4g}" for x in self.inertia)
        return self.name, self.kind, f"{self.mass:.4g}", inertia, ", ".join(f"{x:.4g}" for x in self.centre), f"{self.size:.4g}"


def rows_of(bodies: Mapping[str, AnyBody], columns: Mapping[str, Column], values: Values) -> list[_Row]:
    """Return the numbers of all bodies at the reference position."""
    references = {name: column.reference for name, column in columns.items()}
    return [_row(name, body, references, values) for name, body in bodies.items()]


def _row(name: str, body: AnyBody, references: dict[str, sp.Matrix], values: Values) -> _Row:
    J = numbers(moments(name, body, references, values), values)
    mass, centre = float(J[-1, -1]), J[:-1, -1] / J[-1, -1]
    E = np.linalg.eigvalsh(J[:-1, :-1] - mass * np.outer(centre, centre))
    inertia = np.sort(np.sum(E) - E) if len(E) == 3 else np.array([np.sum(E)])
    places = numbers(sp.Matrix.hstack(*(references[x] for x in body.names)), values) if body.names else np.empty((len(centre), 0))
    points = np.column_stack([places, centre])
    size = float(np.max(np.linalg.norm(points[:, :, None] - points[:, None, :], axis=0)))
    return _Row(name, type(body).__name__, mass, np.maximum(inertia, 0.0), centre, size)


def doubts_of(rows: Sequence[_Row], points: Mapping[str, Column], values: Values) -> list[str]:
    """Return sentences on numbers that are far from those of others."""
    long = [row for row in rows if row.size > 0]
    found = _far(rows, "mass", "kg", lambda row: row.mass) + _far(long, "size", "m", lambda row: row.size)
    found = found or _far(long, "mass for its length", "kg/m", lambda row: row.mass / row.size)
    for row in (row for row in long if row.kind == "Body" and max(row.inertia) > 0):
        largest, of_rod = float(np.max(row.inertia)), ROD * row.mass * row.size**2
        if not 1 / FAR < largest / of_rod < FAR:
            found.append(
                f"the inertia of {row.name}, {largest:.4g} kg m^2, is {_times(largest / of_rod)} that of a rod of its mass and size, "
                f"{of_rod:.4g}; check its unit, and those of its mass and its points"
            )
    return found + _far_points(points, values)


def _far(rows: Sequence[_Row], what: str, unit: str, number: Callable[[_Row], float]) -> list[str]:
    found = []
    for row in rows:
        alike = [other for other in rows if other is not row and other.kind == row.kind]
        kind = row.kind if len(alike) > 1 else "body"
        others, size = [number(x) for x in (alike if len(alike) > 1 else rows) if x is not row], number(row)
        if others and not min(others) / FAR <= size <= FAR * max(others):
            nearest = max(others) if size > max(others) else min(others)
            found.append(
                f"the {what} of {row.name}, {size:.4g} {unit}, is {_times(size / nearest)} that of any other {kind}; check its unit"
            )
    return found


def _far_points(points: Mapping[str, Column], values: Values) -> list[str]:
    names = [name for name, column in points.items() if column.weight]
    if len(names) < 3:
        return []
    x = numbers(sp.Matrix.hstack(*(points[name].reference for name in names)), values)
    apart = np.linalg.norm(x[:, :, None] - x[:, None, :], axis=0)
    found = []
    for k, name in enumerate(names):
        rest = [j for j in range(len(names)) if j != k]
        others, least = float(apart[np.ix_(rest, rest)].max()), float(apart[k, rest].min())
        if others > 0 and least > FAR * others:
            found.append(f"the point {name} is {least:.4g} m from all others, which are at most {others:.4g} m apart; check its unit")
    return found


def _times(factor: float) -> str:
    return f"{factor:.3g} times" if factor > 1 else f"1/{1 / factor:.3g} of"


def forces_of(forces: Sequence[Force], joints: Sequence[Joint | Distance | Driver]) -> list[str]:
    """Return springs, dampers and drivers in words."""
    drivers = [x for x in joints if isinstance(x, DrivenAngle | DrivenCoordinate | DrivenDistance)]
    return [*map(_force, forces), *map(_driver, drivers)]


def _force(force: Force) -> str:
    damping = f"damping {force.damping} N s/m"
    if not isinstance(force, Spring):
        return f"Damper between {force.first} and {force.second}: {damping}"
    length = "that of the reference position" if force.length is None else f"{force.length} m"
    also = f", {damping}" if exact(force.damping) != 0 else ""
    return f"Spring between {force.first} and {force.second}: stiffness {force.stiffness} N/m, length without force {length}{also}"


def _driver(driver: Driver) -> str:
    if isinstance(driver, DrivenCoordinate):
        return f"DrivenCoordinate: coordinate {driver.axis} of {driver.point} is {driver.value} m"
    if isinstance(driver, DrivenDistance):
        return f"DrivenDistance: {driver.first} and {driver.second} are {driver.distance} m apart"
    return f"DrivenAngle: {driver.first} turns against {driver.second} by {driver.angle} rad"


def dropped_of(tied: Labelled, groups: Sequence[range], keepers: Sequence[int | None]) -> list[str]:
    """Return sentences on joints of which no equation is left.

    Parameters
    ----------
    tied : list of (str, Expr)
        All equations with words.
    groups : sequence of range
        Which of them are those of each joint.
    keepers : sequence of int or None
        The equation that keeps each, see :func:`daebench.joints.constraints.keepers`.
    """
    found = []
    for group in groups:
        if all(keepers[k] != k for k in group):
            others = dict.fromkeys(tied[j][0] for k in group if (j := keepers[k]) is not None)
            why = f"{' and '.join(others)} keeps it already" if others else "it holds in any position without it"
            found.append(f"{tied[group.start][0]} adds no equation: {why}")
    return found
