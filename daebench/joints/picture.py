"""The picture of a mechanism: bodies as lines through their points, point masses, springs and dampers, and fixed points."""

from collections.abc import Mapping, Sequence

import sympy as sp

from daebench.joints.bodies import AnyBody, PointMass
from daebench.joints.exact import exact
from daebench.joints.forces import Force, Spring
from daebench.joints.frames import Column, Frame
from daebench.joints.joints import Distance
from daebench.systems.picture import Picture


def drawn(
    bodies: Mapping[str, AnyBody],
    frames: Mapping[str, Frame],
    links: list[Distance],
    forces: Sequence[Force],
    columns: Mapping[str, Column],
    fixed: list[str],
) -> Picture:
    """Return the picture of a mechanism, with the places of all its named points."""
    rods = [line for name, body in bodies.items() for line in _lines(body, frames[name], columns)]
    rods += [[tuple(columns[end].now) for end in (link.first, link.second)] for link in links]
    masses = [tuple(columns[body.point].now) for body in bodies.values() if isinstance(body, PointMass)]
    points = {name: tuple(column.now) for name, column in columns.items() if column.weight}
    springs = [force for force in forces if isinstance(force, Spring) and exact(force.stiffness) != 0]
    dampers = [force for force in forces if exact(force.damping) != 0]

    def ends(forces: Sequence[Force]) -> list[tuple[tuple[sp.Expr, ...], tuple[sp.Expr, ...]]]:
        return [(tuple(columns[force.first].now), tuple(columns[force.second].now)) for force in forces]

    still = [tuple(columns[name].now) for name in fixed]
    return Picture(rods=rods, masses=masses, fixed=still, springs=ends(springs), dampers=ends(dampers), points=points)


def _lines(body: AnyBody, frame: Frame, columns: Mapping[str, Column]) -> list[list[tuple[sp.Expr, ...]]]:
    """Return the lines of a body: between all its points, or along its directions where it has one point alone."""
    if isinstance(body, PointMass):
        return []
    points = [columns[name].now for name in body.names if columns[name].weight]
    if len(points) == 1:
        return [[tuple(points[0]), tuple(points[0] + column.now)] for column in frame.columns if not column.weight]
    if len(points) == 2:
        return [[tuple(x) for x in points]]
    ring = [*points, points[0]]
    # The diagonals of four points: their ring alone looks like a plane figure.
    spokes = [(a, b) for k, a in enumerate(points) for b in points[k + 2 :] if not (k == 0 and b is points[-1])]
    return [[tuple(x) for x in ring], *([tuple(a), tuple(b)] for a, b in (spokes if len(points) == 4 else []))]
