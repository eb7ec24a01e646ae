"""Angles between bodies as unknowns of their own, which count whole turns, and the couplings of two of them, such as gears.

::

    0 = g(q, theta) = s cos(theta) - c sin(theta)      c, s: cosine and sine of the angle by the directions of both bodies

This equation is smooth, and its derivative by theta is -(c^2 + s^2)^(1/2), so that theta goes on at pi, where atan2 jumps. It holds half a
turn off as well, a branch that is far away; the start is on the right one. T is the same with or without theta as long as g holds:

- About a fixed axis, as in the plane, a body gives part of its moment of inertia to its angle, so that M stays constant.
- About another, T has inertia/2 (g')^2 more, which is 0 on the constraints, unless the angle has an armature.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import sympy as sp

from daebench.errors import InvalidProblem, unknown
from daebench.joints.bodies import QuaternionBody
from daebench.joints.drivers import DrivenAngle, driven_angle
from daebench.joints.exact import CLOSE, Values, exact, length_of, number, numbers, simplified
from daebench.joints.inertia import Square, spread_about, spread_about_centre
from daebench.joints.joint_equations import across
from daebench.joints.joints import Cylindrical, Place, Prismatic, Revolute
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
class Spin:
    """The angle by which a wheel has turned about its axle, for a ``Rolling`` in the plane; it stands where an angle may.

    Parameters
    ----------
    armature : number or Expr
        Moment of inertia of the wheel about its axle, kg m^2.
    """

    armature: Exact


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


AnyAngle = Angle | Travel | Spin
"""Declarations that torques and couplings refer to by name."""


@dataclass(frozen=True)
class Measured:
    """An unknown that is an angle, words for it, its equation, and an expression that is negative half a turn from it."""

    theta: sp.Symbol
    words: str
    driver: DrivenAngle | None
    """The angle as a driver would turn it; None of a distance."""
    axis: sp.Matrix | None
    equation: sp.Expr
    positive: sp.Expr

    def value(self, at: Mapping[sp.Symbol, sp.Expr], values: Values) -> sp.Expr:
        """Return the angle between -pi and pi at some places, or the distance."""
        if self.driver is None:
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
    joints: Sequence[object] = ()
    by_name: dict[str, sp.Expr] = field(default_factory=dict)
    measured: dict[str, Measured] = field(default_factory=dict)
    """Unknowns that are angles, by the words for each."""
    valued: frozenset[str] = frozenset()
    """Names of those whose value plays a part, and not their rate alone."""
    slopes: dict[str, Callable[[Sequence[sp.Symbol]], sp.Matrix]] = field(default_factory=dict)
    """Slopes of those without an unknown."""
    squares: list[Square] = field(default_factory=list)
    """Their kinetic energy."""
    spins: set[str] = field(default_factory=set)
    """Names of those that are angles of wheels."""

    def given(self, name: str) -> sp.Expr:
        """Return an angle by its name."""
        if name not in self.by_name:
            raise unknown("angle of the mechanism", name, self.by_name)
        return self.by_name[name]

    def add(self, name: str, angle: AnyAngle) -> None:
        """Give an angle its unknowns, with their equations and their inertia."""
        what = f"the angle {name}"
        if not isinstance(angle, Spin) and angle.first == angle.second:
            raise InvalidProblem(f"{what} is of {angle.first} against itself; name two bodies.", "angle-against-itself")
        armature = exact(angle.armature)
        if number(armature, self.places.values) < 0:
            raise InvalidProblem(f"{what} has the armature {armature}; give a positive one, or leave it out.", "armature-not-positive")
        if isinstance(angle, Spin):
            self.by_name[name] = self.places.added(name, [sp.S.Zero])[0]
            self.spins.add(name)
        elif isinstance(angle, Travel):
            self.by_name[name] = self._gone(what, angle)
        else:
            self._turned(name, what, angle)
        if armature != 0:
            self.squares.append((armature, self.by_name[name]))

    def _turned(self, name: str, what: str, angle: Angle) -> None:
        """Give an angle of bodies its unknowns, where its value is needed, or its slope alone."""
        flat, armature = self.places.dimension == 2, exact(angle.armature)
        if not flat and angle.axis is None:
            raise InvalidProblem(f"{what} has no axis; give axis=(x, y, z).", "turned-joint-without-axis")
        axis = None if flat or angle.axis is None else self.places.direction(f"the axis of {what}", angle.axis)
        pair = (angle.first, angle.second)
        # About a fixed axis by the angles of both bodies against the ground, which can take over inertia of theirs.
        if axis is None or {*pair} <= self._about(axis):
            first, second = (self._turn(what, body, axis) for body in pair)
            self.by_name[name] = first - second
        elif armature == 0 and name not in self.valued:
            # Dampers and constant torques need no value, and M stays constant without it.
            self.by_name[name], self.slopes[name] = sp.S.Zero, self._slope(what, angle, axis)
        else:
            one = self._measure(what, what, angle, axis)
            self.by_name[name] = one.theta
            if armature == 0:
                self._add_gauge(one, pair[0] if pair[0] != GROUND else pair[1])

    def slope(self, name: str) -> sp.Matrix:
        """Return the derivative of an angle by the unknowns, shape(1, d)."""
        angle = self.given(name)
        return self.slopes[name](self.places.q) if name in self.slopes else sp.Matrix([angle]).jacobian(self.places.q)

    def _slope(self, what: str, angle: Angle, axis: sp.Matrix) -> Callable[[Sequence[sp.Symbol]], sp.Matrix]:
        """Return a function of the unknowns for the slope (c ds - s dc)/(c^2 + s^2), whose denominator is constant."""
        a, b = (self.places.frame(what, name) for name in (angle.first, angle.second))
        s, c = (sp.Matrix([x]) for x in driven_angle(DrivenAngle(angle.first, angle.second, 0), a, b, axis))
        size = simplified(c[0].xreplace(dict(zip(self.places.q, self.places.reference, strict=True))) ** 2)
        return lambda q: (c[0] * s.jacobian(q) - s[0] * c.jacobian(q)) / size

    def _about(self, axis: sp.Matrix) -> set[str]:
        """Return the bodies that can turn about a fixed axis alone, and the ground."""
        q, frames = {*self.places.q}, self.places.frames
        bodies = {name for name, x in frames.items() if x.holds(axis, 0) and not x.along(axis).free_symbols & q}
        hinges = [x for x in self.joints if isinstance(x, Revolute | Cylindrical | Prismatic)]
        for joint in [*hinges] * len(hinges):
            pair = {joint.first, joint.second}
            along = self.places.direction("an axis", joint.axis or ())
            if pair & bodies and (isinstance(joint, Prismatic) or not any(axis.cross(along).applyfunc(simplified))):
                bodies |= pair
        return bodies

    def _turn(self, what: str, body: str, axis: sp.Matrix | None) -> sp.Expr:
        """Return the angle of a body against the ground."""
        directions = self.places.frame("an angle", body).directions
        if not {*self.places.q} & {x for _, now in directions for x in now.free_symbols}:
            # The ground, and bodies that only slide.
            return sp.S.Zero
        words = f"the angle of {body}" + (f" about {tuple(axis)}" if axis else "")
        if words not in self.measured:
            one = self._measure(what, words, Angle(body), axis)
            part = self._part(body, axis)
            if part is None:
                self._add_gauge(one, body)
            else:
                self.moments[body] -= sp.diag(part, sp.zeros(1, 1))
                self.squares.append((part.trace(), one.theta))
        return self.measured[words].theta

    def _gone(self, what: str, travel: Travel) -> sp.Expr:
        """Return a distance along an axis as a polynomial, or an unknown of its own where a mass goes by it along one that moves."""
        a, b = (self.places.frame(what, name) for name in (travel.first, travel.second))
        at, axis = self.places.point(f"the place of {what}", travel.at), self.places.direction(f"the axis of {what}", travel.axis)
        gone = sp.expand((a.at(at) - b.at(at)).dot(b.along(axis)) / length_of(axis))
        if exact(travel.armature) == 0 or not {*self.places.q} & b.along(axis).free_symbols:
            return gone
        s = self.places.added(what, [sp.S.Zero])[0]
        self.measured[what] = Measured(s, what, None, None, gone - s, sp.S.One)
        return s

    def _part(self, body: str, axis: sp.Matrix | None) -> sp.Matrix | None:
        """Return a part of a body's Euler tensor across an axis that can be that of its angle; None where none is positive for sure."""
        J, values = self.moments[body], self.places.values
        if axis is None:
            return spread_about_centre(J) / 4 * sp.eye(2)
        E = J[:-1, :-1] - J[:-1, -1] * J[:-1, -1].T / J[-1, -1]
        frame = self.places.frames[body]
        for way in (*(was for was, _ in frame.directions if simplified(was.dot(axis)) == 0), *across(axis)):
            for share in (2, 8, 32) if frame.holds(way, 0) else ():
                part = way * way.T * simplified((way.T * E * way)[0] / way.dot(way) ** 2) / share
                sizes = np.linalg.eigvalsh(numbers(E - part, values))
                if sizes[0] >= -CLOSE * sizes[-1] and any(part):
                    return part
        return None

    def _add_gauge(self, one: Measured, body: str) -> None:
        length = one.positive.subs(dict(zip(self.places.q, self.places.reference, strict=True)))
        self.squares.append((spread_about_centre(self.moments[body]) / simplified(length**2), one.equation))

    def _measure(self, what: str, words: str, angle: Angle, axis: sp.Matrix | None) -> Measured:
        a, b = (self.places.frame(what, name) for name in (angle.first, angle.second))
        theta = self.places.added(words, [sp.S.Zero])[0]
        driver = DrivenAngle(angle.first, angle.second, theta)
        one = Measured(theta, words, driver, axis, *driven_angle(driver, a, b, axis))
        self.measured[words] = one
        return one


def gauge(name: str, body: QuaternionBody, angles: Angles) -> Square:
    """Return the kinetic energy that gives a body with a quaternion its gauge, besides that of its changing length."""
    J, base = angles.moments[name], angles.places.frames[name].columns[0].reference
    wanted = spread_about_centre(J) * 2 / 3 if body.gauge is None else exact(body.gauge)
    if not number(wanted, angles.places.values) > 0:
        raise InvalidProblem(f"{name} has the gauge {wanted}; give a positive moment of inertia, or leave it out.", "gauge-without-inertia")
    return wanted - spread_about(J, base), angles.places.quaternions[f"{name}.quaternion"]


def coupled(coupling: Coupling | Gear, angles: Angles) -> sp.Expr:
    """Return the equation of two angles that are coupled."""
    c = [exact(x) for x in coupling.coefficients]
    if len(c) > 5:
        raise InvalidProblem(
            f"the coupling of {coupling.first} and {coupling.second} has degree {len(c) - 1}; it may be 4 at most.",
            "coupling-degree-too-high",
        )
    second = angles.given(coupling.second)
    return angles.given(coupling.first) - sum((x * second**k for k, x in enumerate(c)), sp.S.Zero)
