"""Drivers: an angle, a distance or a coordinate as a function of time, each one equation in q and t."""

from collections.abc import Mapping
from dataclasses import dataclass

import sympy as sp

from daebench.errors import InvalidProblem
from daebench.joints.exact import exact, length_of, simplified
from daebench.joints.frames import QUARTER_TURN, Column, Frame
from daebench.joints.joint_equations import across
from daebench.joints.joints import Place
from daebench.systems.picture import Exact

t = sp.Symbol("t", real=True)
"""Time, on which drivers depend."""


@dataclass(frozen=True)
class DrivenAngle:
    """A body that is turned against another: the angle from their reference position, a function of time.

    Parameters
    ----------
    first, second : str
        Names of the two bodies, or "ground".
    angle : Expr
        Angle of the first, seen from the second, in ``daebench.joints.t``, rad.
    axis : direction, optional
        Axis at the reference position, in space: both bodies have it in common, as by a hinge.
    """

    first: str
    second: str
    angle: Exact
    axis: Place | None = None


@dataclass(frozen=True)
class DrivenDistance:
    """Two points whose distance is a function of time, as of an actuator.

    Parameters
    ----------
    first, second : str
        Names of the points.
    distance : Expr
        Their distance in ``daebench.joints.t``, m.
    """

    first: str
    second: str
    distance: Exact


@dataclass(frozen=True)
class DrivenCoordinate:
    """A point of which one coordinate is a function of time.

    Parameters
    ----------
    point : str
        Name of the point.
    axis : int
        Which coordinate: 0, 1 or 2.
    value : Expr
        The coordinate in ``daebench.joints.t``, m.
    """

    point: str
    axis: int
    value: Exact


Driver = DrivenAngle | DrivenDistance | DrivenCoordinate


def driven_distance(driver: DrivenDistance, columns: Mapping[str, Column]) -> sp.Expr:
    """Return the equation of two points at a prescribed distance."""
    gap = columns[driver.second].now - columns[driver.first].now
    return gap.dot(gap) - exact(driver.distance) ** 2


def driven_coordinate(driver: DrivenCoordinate, columns: Mapping[str, Column]) -> sp.Expr:
    """Return the equation of a point with a prescribed coordinate."""
    place = columns[driver.point].now
    if driver.axis not in range(len(place)):
        raise InvalidProblem(f"the driver of {driver.point} has axis {driver.axis!r}; it is 0, 1 or, in space, 2.", "driver-axis-index")
    return place[driver.axis] - exact(driver.value)


def driven_angle(driver: DrivenAngle, a: Frame, b: Frame, axis: sp.Matrix | None) -> tuple[sp.Expr, sp.Expr]:
    """Return the equation of a driven angle, and an expression that is negative half a turn from it.

    ::

        u_a . (cos(angle) n x u_b - sin(angle) |n| u_b) = 0      u: a direction of both bodies at right angles to the axis n
    """
    angle = exact(driver.angle)
    u, turned, length = _hand(driver, a, b, axis)
    along, aside = b.along(u) * length, b.along(turned)
    hand = a.along(u)
    # One equation and a sign: the equation holds at the opposite angle as well, which only the start can tell apart.
    return hand.dot(sp.cos(angle) * aside - sp.sin(angle) * along), hand.dot(sp.cos(angle) * along + sp.sin(angle) * aside)


def _hand(driver: DrivenAngle, a: Frame, b: Frame, axis: sp.Matrix | None) -> tuple[sp.Matrix, sp.Matrix, sp.Expr]:
    """Return a direction of both bodies perpendicular to the axis, the same turned by a right angle, and the factor of its length."""
    if axis is None:
        if len(a.columns[0].reference) == 3:
            raise InvalidProblem(
                f"the angle of {driver.first} and {driver.second} has no axis; give axis=(x, y, z).", "driver-without-axis"
            )
        candidates = [(was, QUARTER_TURN * was, sp.S.One) for was, _ in a.directions]
    else:
        length = length_of(axis)
        perpendicular = [was for was, _ in a.directions if simplified(was.dot(axis)) == 0]
        candidates = [(u, axis.cross(u), length) for u in (*perpendicular, *across(axis))]
    for u, turned, length in candidates:
        # A body has only the directions that it names: both bodies have to have u, and the second its perpendicular.
        if a.holds(u, 0) and b.holds(u, 0) and b.holds(turned, 0):
            return u, turned, length
    raise InvalidProblem(
        f"the angle of {driver.first!r} and {driver.second!r} has no direction across its axis to measure it by; "
        "swap the bodies, or make one a Body.",
        "driver-axis-ambiguous",
    )
