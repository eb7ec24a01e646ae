"""The picture of a mechanism: bodies, point masses, springs, dampers, cylinders, fixed points, and rings at its angles."""

from collections.abc import Mapping, Sequence

import sympy as sp

from daebench.joints.angles import Angle
from daebench.joints.bodies import AnyBody, PointMass
from daebench.joints.constraints import Tie
from daebench.joints.drivers import DrivenAngle, DrivenDistance
from daebench.joints.exact import exact, simplified, vector
from daebench.joints.forces import Force, Spring
from daebench.joints.frames import QUARTER_TURN, Column, Frame
from daebench.joints.joint_equations import across
from daebench.joints.joints import Distance, Joint, Place
from daebench.joints.placing import GROUND, Places
from daebench.systems.picture import Picture

CORNERS, RADIUS = 12, sp.Rational(1, 16)
"""Corners of the ring at an angle, and its radius in parts of the size of the mechanism."""

Line = list[tuple[sp.Expr, ...]]


def drawn(
    bodies: Mapping[str, AnyBody],
    places: Places,
    ties: Sequence[Tie],
    forces: Sequence[Force],
    angles: Sequence[Angle | DrivenAngle],
    fixed: list[str],
) -> Picture:
    """Return the picture of a mechanism, with the places of all its named points."""
    columns = places.columns
    rods = [line for name, body in bodies.items() for line in _lines(body, places.frames[name], columns)]
    rods += [[tuple(columns[end].now) for end in (x.first, x.second)] for x in ties if isinstance(x, Distance | DrivenDistance)]
    rods += [_barrel(columns[x.first].now, columns[x.second].now) for x in ties if isinstance(x, DrivenDistance) and places.dimension == 2]
    rods += [ring for angle in angles for ring in _ring(angle, bodies, places, ties, fixed)]
    masses = [tuple(columns[body.point].now) for body in bodies.values() if isinstance(body, PointMass)]
    points = {name: tuple(column.now) for name, column in columns.items() if column.weight}
    springs = [force for force in forces if isinstance(force, Spring) and exact(force.stiffness) != 0]
    dampers = [force for force in forces if exact(force.damping) != 0]

    def ends(forces: Sequence[Force]) -> list[tuple[tuple[sp.Expr, ...], tuple[sp.Expr, ...]]]:
        return [(tuple(columns[force.first].now), tuple(columns[force.second].now)) for force in forces]

    still = [tuple(columns[name].now) for name in fixed]
    return Picture(rods=rods, masses=masses, fixed=still, springs=ends(springs), dampers=ends(dampers), points=points)


def _barrel(a: sp.Matrix, b: sp.Matrix) -> Line:
    """Return the barrel of a cylinder between two points of the plane, from which its piston goes on."""
    gap, aside = b - a, QUARTER_TURN * (b - a)
    corners = [(8, 1), (8, -1), (1, -1), (1, 1), (8, 1)]
    return [tuple(a + (x * gap + y * aside) / 16) for x, y in corners]


def _ring(angle: Angle | DrivenAngle, bodies: Mapping[str, AnyBody], places: Places, ties: Sequence[Tie], fixed: list[str]) -> list[Line]:
    """Return a ring with a spoke, which turns with the first body of an angle, at the place of its hinge; none where there is no hinge."""
    pair = (angle.first, angle.second)
    names = [fixed if body == GROUND else bodies[body].names for body in pair]
    hinges: list[Place] = [x for x in names[0] if x in names[1] and places.given(x).weight]
    hinges += [x.at for x in ties if isinstance(x, Joint) and {x.first, x.second} == {*pair}]
    frame = places.frames[pair[0] if pair[0] != GROUND else pair[1]]
    flat = places.dimension == 2
    ways = [sp.Matrix([1, 0]), sp.Matrix([0, 1])] if flat else across(places.direction("an axis", angle.axis or ()))
    if not hinges or not all(frame.holds(way, 0) for way in ways):
        return []
    at = hinges[0]
    centre = frame.at(places.given(at).reference if isinstance(at, str) else vector("a hinge", at))
    radius = RADIUS * sp.Rational(str(places.size))
    u, w = (frame.along(way) * radius / sp.sqrt(simplified(way.dot(way))) for way in ways)
    turns = [2 * sp.pi * k / CORNERS for k in range(CORNERS + 1)]
    return [[tuple(centre + sp.cos(x) * u + sp.sin(x) * w) for x in turns] + [tuple(centre)]]


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
