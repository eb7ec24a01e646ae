"""The parts of a mechanism in words: its bodies, forces and drivers, and the joints that add no equation."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import sympy as sp

from daebench.joints.angles import AnyAngle, Travel
from daebench.joints.bodies import AnyBody
from daebench.joints.constraints import Labelled, Tie
from daebench.joints.drivers import DrivenAngle, DrivenCoordinate, DrivenDistance, Driver
from daebench.joints.exact import Array, Values, exact, numbers
from daebench.joints.forces import Spring
from daebench.joints.frames import Column
from daebench.joints.inertia import moments
from daebench.joints.torques import AnyForce, AtAngle


@dataclass(frozen=True)
class BodyRow:
    """Numbers of a body: principal moments of inertia about its centre, in the plane one, and the largest distance of its points."""

    name: str
    kind: str
    mass: float
    inertia: Array
    centre: Array
    size: float

    @property
    def words(self) -> tuple[str, ...]:
        """The numbers of the body as texts, for a row of a table."""
        inertia = "" if self.kind == "PointMass" else ", ".join(f"{x:.4g}" for x in self.inertia)
        return self.name, self.kind, f"{self.mass:.4g}", inertia, ", ".join(f"{x:.4g}" for x in self.centre), f"{self.size:.4g}"


def rows_of(bodies: Mapping[str, AnyBody], columns: Mapping[str, Column], values: Values) -> list[BodyRow]:
    """Return the numbers of all bodies at the reference position."""
    references = {name: column.reference for name, column in columns.items()}
    return [_row(name, body, references, values) for name, body in bodies.items()]


def _row(name: str, body: AnyBody, references: dict[str, sp.Matrix], values: Values) -> BodyRow:
    J = numbers(moments(name, body, references, values), values)
    mass, centre = float(J[-1, -1]), J[:-1, -1] / J[-1, -1]
    E = np.linalg.eigvalsh(J[:-1, :-1] - mass * np.outer(centre, centre))
    # Eigenvalues of I = tr(E) - E from those of the Euler tensor.
    inertia = np.sort(np.sum(E) - E) if len(E) == 3 else np.array([np.sum(E)])
    places = numbers(sp.Matrix.hstack(*(references[x] for x in body.names)), values) if body.names else np.empty((len(centre), 0))
    points = np.column_stack([places, centre])
    size = float(np.max(np.linalg.norm(points[:, :, None] - points[:, None, :], axis=0)))
    return BodyRow(name, type(body).__name__, mass, np.maximum(inertia, 0.0), centre, size)


def forces_of(forces: Sequence[AnyForce], joints: Sequence[Tie], angles: Mapping[str, AnyAngle]) -> list[str]:
    """Return springs, dampers, motors, drivers and rotors in words."""
    drivers = [x for x in joints if isinstance(x, DrivenAngle | DrivenCoordinate | DrivenDistance)]
    heavy = [(name, x, "kg" if isinstance(x, Travel) else "kg m^2") for name, x in angles.items() if exact(x.armature) != 0]
    rotors = [f"Armature of the {type(x).__name__.lower()} {name}: {x.armature} {unit}" for name, x, unit in heavy]
    return [*map(_force, forces), *map(_driver, drivers), *rotors]


def _force(force: AnyForce) -> str:
    if isinstance(force, AtAngle):
        return f"{type(force).__name__} at {force.angle}: {force.words}"
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
    """Return sentences on joints of which no equation is left."""
    sentences = []
    for group in groups:
        if all(keepers[k] != k for k in group):
            others = dict.fromkeys(tied[j][0] for k in group if (j := keepers[k]) is not None)
            why = (
                f"{' and '.join(others)} {'keep' if len(others) > 1 else 'keeps'} it already"
                if others
                else "it holds in any position without it"
            )
            sentences.append(f"{tied[group.start][0]} adds no equation: {why}")
    return sentences
