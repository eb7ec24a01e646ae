"""Joints between two bodies: the motion that each allows, and the equations that prevent the rest.

A joint is between two bodies, by their names, or a body and "ground", at a point and along directions of the reference position. Each is as
many equations as degrees of freedom it takes; those that hold in any position, as of a point that both bodies have by name, are left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from daebench.errors import InvalidProblem
from daebench.joints.exact import Values, exact, number, vector
from daebench.systems.picture import Exact

Place = str | Sequence[Exact]
"""A point by its name or its coordinates, or a direction."""


@dataclass(frozen=True)
class _Joint:
    """Base of all joints."""

    first: str
    second: str
    """Names of the bodies; one may be "ground"."""
    at: Place
    """Where it is at the reference position: a named point, or coordinates."""


@dataclass(frozen=True)
class Spherical(_Joint):
    """A ball joint: a point of one body stays at a point of the other. In space, three equations."""


@dataclass(frozen=True)
class Revolute(_Joint):
    """A hinge. In space five equations, and in the plane, where it has no axis, two.

    Parameters
    ----------
    axis : direction, optional
        Axis of the hinge at the reference position, in space.
    """

    axis: Place | None = None


@dataclass(frozen=True)
class Universal(_Joint):
    """A cross of two axes that stay at a right angle, one fixed in either body: four equations.

    Parameters
    ----------
    first_axis, second_axis : direction
        Axis in the first body and in the second, at a right angle at the reference position.
    """

    first_axis: Place
    second_axis: Place


@dataclass(frozen=True)
class Cylindrical(_Joint):
    """A hinge whose bodies can go along its axis too: four equations.

    Parameters
    ----------
    axis : direction
        Axis at the reference position.
    """

    axis: Place


@dataclass(frozen=True)
class Prismatic(_Joint):
    """A slide: bodies go along its axis and do not turn. In space five equations, in the plane two.

    Parameters
    ----------
    axis : direction
        Axis at the reference position.
    """

    axis: Place


@dataclass(frozen=True)
class Fixed(_Joint):
    """A weld: two bodies stay as they are at the reference position. In space six equations, in the plane three."""


@dataclass(frozen=True)
class Slot(_Joint):
    """A pin of the first body in a straight slot of the second, where it slides and turns: in the plane one equation, in space two.

    Parameters
    ----------
    axis : direction
        Direction of the slot at the reference position, through the pin.
    """

    axis: Place


Joint = Spherical | Revolute | Universal | Cylindrical | Prismatic | Slot | Fixed


@dataclass(frozen=True)
class Distance:
    """Two points whose distance stays: a rod without mass, one equation.

    Parameters
    ----------
    first, second : str
        Names of the points.
    """

    first: str
    second: str


def axes_of(joint: Joint) -> list[Place]:
    """Return the directions that a joint is declared with."""
    if isinstance(joint, Universal):
        return [joint.first_axis, joint.second_axis]
    axis = getattr(joint, "axis", None)
    return [] if axis is None else [axis]


def check_axes(joint: Joint, axes: Sequence[sp.Matrix], flat: bool, values: Values) -> None:
    """Refuse a joint whose axes are missing, too many, or not at a right angle where they have to be."""
    what = f"the {type(joint).__name__} joint of {joint.first} and {joint.second}"
    if flat and isinstance(joint, Universal | Cylindrical):
        raise InvalidProblem(f"{what} is for space, but the mechanism is plane; use Revolute or Prismatic.", "joint-for-space-in-plane")
    if not flat and isinstance(joint, Revolute) and not axes:
        raise InvalidProblem(f"{what} has no axis; give axis=(x, y, z), or use Spherical.", "joint-without-axis")
    if isinstance(joint, Universal) and abs(number(axes[0].dot(axes[1]), values)) > 1e-9:
        raise InvalidProblem(
            f"the axes of {what} are not at a right angle at the reference position; change one.", "joint-axes-not-perpendicular"
        )


def direction(what: str, axis: Sequence[Exact]) -> sp.Matrix:
    """Return an axis as a column; refuse one that is 0."""
    column = vector(what, axis)
    if not any(exact(x) for x in column):
        raise InvalidProblem(f"{what} is 0; give a direction.", "direction-zero")
    return column
