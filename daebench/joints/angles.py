"""Angles between bodies as unknowns of their own, which count whole turns, and the couplings of two of them, such as gears.

::

    0 = g(q, theta) = s cos(theta) - c sin(theta)      c, s: cosine and sine of the angle by the directions of both bodies

This equation is smooth, and its derivative by theta is -(c^2 + s^2)^(1/2), so that theta goes on at pi, where atan2 jumps. It holds half a
turn off as well, a branch that is far away; the start is on the right one. T is the same with or without theta as long as g holds:

- In the plane a body gives half of its moment of inertia to its angle, so that M stays constant.
- In space T has inertia/2 (g')^2 more, which is 0 on the constraints, unless the angle has an armature.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import sympy as sp

from daebench.errors import InvalidProblem, unknown
from daebench.joints.drivers import DrivenAngle, driven_angle
from daebench.joints.exact import Values, exact, length_of, number, simplified
from daebench.joints.inertia import Square, spread_about_centre
from daebench.joints.joints import Place
from daebench.joints.placing import GROUND, Places
from daebench.systems.picture import Exact


@dataclass(frozen=True)
class Angle:
    """The angle by which a body is turned against another since the reference position; whole turns are counted.

    Parameters
    ----------
    first, second : str
        Names of the two bodies, or "ground".
    axis : direction, optional
        Axis at the reference position, in space: both bodies have it in common, as by a hinge.
    armature : number or Expr
        Moment of inertia of a rotor that turns by this angle, kg m^2: T has armature/2 angle'^2 more.
    """

    first: str
    second: str = GROUND
    axis: Place | None = None
    armature: Exact = 0


@dataclass(frozen=True)
class Travel:
    """The distance by which a body has gone along an axis of another since the reference position; it stands where an angle may.

    Parameters
    ----------
    first, second : str
        Names of the two bodies, or "ground".
    at : point
        The point of the first body that goes, at the reference position.
    axis : direction
        Axis at the reference position, fixed in the second body.
    armature : number or Expr
        Mass that goes by this distance, kg: T has armature/2 travel'^2 more.
    """

    first: str
    second: str
    at: Place
    axis: Place
    armature: Exact = 0


@dataclass(frozen=True)
class Coupling:
    """An angle that is a polynomial of another.

    Parameters
    ----------
    first, second : str
        Names of the angles.
    coefficients : sequence of number or Expr
        c of first = c[0] + c[1] second + c[2] second^2 + ..., of degree 4 at most.
    """

    first: str
    second: str
    coefficients: Sequence[Exact]


@dataclass(frozen=True)
class Gear:
    """Two angles in a fixed ratio: first = ratio second + offset.

    Parameters
    ----------
    first, second : str
        Names of the angles.
    ratio : number or Expr
        Turns of the first for one of the second, negative for wheels that touch from outside.
    offset : number or Expr
        The first angle where the second is 0, rad.
    """

    first: str
    second: str
    ratio: Exact
    offset: Exact = 0

    @property
    def coefficients(self) -> tuple[Exact, Exact]:
        """The coefficients of a :class:`Coupling`."""
        return self.offset, self.ratio


@dataclass(frozen=True)
class Measured:
    """An unknown that is an angle, words for it, its equation, and an expression that is negative half a turn from it."""

    theta: sp.Symbol
    words: str
    equation: sp.Expr
    positive: sp.Expr
    turning: bool = True
    """Whether it is an angle, and not a distance."""

    def value(self, at: Mapping[sp.Symbol, sp.Expr], values: Values) -> sp.Expr:
        """Return the angle between -pi and pi at some places, or the distance."""
        if not self.turning:
            return simplified(self.equation.subs(self.theta, 0).xreplace(at))
        s, c = (simplified(x.subs(self.theta, 0).xreplace(at)) for x in (self.equation, self.positive))
        # Without atan2 where it is 0 or pi: SymPy leaves atan2(0, c) as it is unless it knows the sign of c.
        return sp.atan2(s, c) if s != 0 else sp.S.Zero if number(c, values) > 0 else sp.pi


@dataclass
class Angles:
    """The angles of a mechanism, each in the unknowns that it is made of."""

    places: Places
    moments: dict[str, sp.Matrix]
    """J of each body, of which its angle takes a part."""
    by_name: dict[str, sp.Expr] = field(default_factory=dict)
    measured: dict[str, Measured] = field(default_factory=dict)
    """Unknowns that are angles, by the words for each."""
    squares: list[Square] = field(default_factory=list)
    """Their kinetic energy."""

    def given(self, name: str) -> sp.Expr:
        """Return an angle by its name."""
        if name not in self.by_name:
            raise unknown("angle of the mechanism", name, self.by_name)
        return self.by_name[name]

    def add(self, name: str, angle: Angle | Travel) -> None:
        """Give an angle its unknowns, with their equations and their inertia."""
        what = f"the angle {name}"
        if angle.first == angle.second:
            raise InvalidProblem(f"{what} is of {angle.first} against itself; name two bodies.")
        # In the plane by the angles of both bodies against the ground, which can take over inertia of theirs.
        flat = self.places.dimension == 2
        if isinstance(angle, Travel):
            self.by_name[name] = self._gone(what, angle)
        else:
            self.by_name[name] = self._turn(what, angle.first) - self._turn(what, angle.second) if flat else self._in_space(what, angle)
        if exact(angle.armature) != 0:
            self.squares.append((exact(angle.armature), self.by_name[name]))

    def _turn(self, what: str, body: str) -> sp.Expr:
        """Return the angle of a body of the plane against the ground."""
        if body == GROUND:
            return sp.S.Zero
        words = f"the angle of {body}"
        if words not in self.measured:
            self._measure(what, words, Angle(body), None)
            part = spread_about_centre(self.moments[body]) / 4
            self.moments[body] -= sp.diag(part, part, 0)
            self.squares.append((2 * part, self.measured[words].theta))
        return self.measured[words].theta

    def _gone(self, what: str, travel: Travel) -> sp.Expr:
        """Return a distance along an axis of the ground, linear in the unknowns, or an unknown of its own along one that moves."""
        a, b = (self.places.frame(what, name) for name in (travel.first, travel.second))
        at, axis = self.places.point(f"the place of {what}", travel.at), self.places.direction(f"the axis of {what}", travel.axis)
        gone = sp.expand((a.at(at) - b.at(at)).dot(b.along(axis)) / length_of(axis))
        if not {*self.places.q} & b.along(axis).free_symbols:
            return gone
        s = self.places.added(what, [sp.S.Zero])[0]
        self.measured[what] = Measured(s, what, gone - s, sp.S.One, turning=False)
        if exact(travel.armature) == 0:
            body = travel.second if travel.first == GROUND else travel.first
            self.squares.append((self.moments[body][-1, -1], gone - s))
        return s

    def _in_space(self, what: str, angle: Angle) -> sp.Expr:
        one = self._measure(what, what, angle, None if angle.axis is None else self.places.direction(f"the axis of {what}", angle.axis))
        if exact(angle.armature) == 0:
            body = angle.second if angle.first == GROUND else angle.first
            length = one.positive.xreplace(dict(zip(self.places.q, self.places.reference, strict=True)))
            self.squares.append((spread_about_centre(self.moments[body]) / simplified(length**2), one.equation))
        return one.theta

    def _measure(self, what: str, words: str, angle: Angle, axis: sp.Matrix | None) -> Measured:
        a, b = (self.places.frame(what, name) for name in (angle.first, angle.second))
        theta = self.places.added(words, [sp.S.Zero])[0]
        one = Measured(theta, words, *driven_angle(DrivenAngle(angle.first, angle.second, theta), a, b, axis))
        self.measured[words] = one
        return one


def coupled(coupling: Coupling | Gear, angles: Angles) -> sp.Expr:
    """Return the equation of two angles that are coupled."""
    c = [exact(x) for x in coupling.coefficients]
    if len(c) > 5:
        raise InvalidProblem(f"the coupling of {coupling.first} and {coupling.second} has degree {len(c) - 1}; it may be 4 at most.")
    second = angles.given(coupling.second)
    return angles.given(coupling.first) - sum((x * second**k for k, x in enumerate(c)), sp.S.Zero)
