"""Wheels, discs and balls that roll without slipping, and edges that do not slide aside: equations of velocities.

::

    v(P) = r' + sum_i e_i' (e_i . (P - r))      velocity of what is at P in a body with a point r and unit directions e_i
    0 = w . (v_1(P) - v_2(P))                   for directions w of the two bodies' plane of contact, or across an edge
"""

from dataclasses import dataclass

import sympy as sp

from daebench.errors import InvalidProblem
from daebench.joints.angles import Angles
from daebench.joints.exact import exact, length_of
from daebench.joints.frames import QUARTER_TURN, Frame
from daebench.joints.joint_equations import across
from daebench.joints.joints import Place
from daebench.joints.placing import GROUND
from daebench.systems.picture import Exact


@dataclass(frozen=True)
class KnifeEdge:
    """A point of a body moves along a direction of this body only, as a skate does: in the plane one equation, in space two.

    Parameters
    ----------
    first, second : str
        Names of the body with the edge, and of the body that it moves on, or "ground".
    at : point
        The point of the first body, at the reference position.
    axis : direction
        The edge, fixed in the first body, at the reference position.
    """

    first: str
    second: str
    at: Place
    axis: Place


@dataclass(frozen=True)
class Rolling:
    """A wheel, disc or ball rolls without slipping on a plane of another body or of the ground.

    In space it is a body of its own, a ball without an axis. It takes one equation of positions, that it touches the plane, and two of
    velocities. In the plane, as seen from above, it stands upright below a body, and takes two equations of velocities.

    Parameters
    ----------
    first, second : str
        Names of the wheel, or in the plane of the body above it, and of the body that it rolls on, or "ground".
    at : point
        The point of contact at the reference position.
    axis : direction, optional
        The axle at the reference position, fixed in the first body: in the plane a wheel with a positive rate rolls to the right of it.
    centre : point, optional
        Centre of the wheel at the reference position, in space; the radius is its distance from the point of contact.
    normal : direction, optional
        Normal of the plane of contact, in space; by default from the point of contact to the centre.
    angle : str
        Name of the ``Spin`` of the wheel, in the plane.
    radius : number or Expr, optional
        Radius, m, in the plane.
    slides : bool
        Whether it may slide along its axle: of two wheels on one axle, one has to, or their constraints depend on each other.
    """

    first: str
    second: str
    at: Place
    axis: Place | None = None
    centre: Place | None = None
    normal: Place | None = None
    angle: str = ""
    radius: Exact | None = None
    slides: bool = False


Labelled = list[tuple[str, sp.Expr]]
"""Equations with words for each."""


class Contact:
    """Where two bodies touch: the point, and the rows that keep it from slipping."""

    def __init__(self, joint: KnifeEdge | Rolling, angles: Angles) -> None:
        self.joint, self.angles, places = joint, angles, angles.places
        at = joint.at if isinstance(joint.at, str) else f"({', '.join(map(str, joint.at))})"
        self.what = f"the {type(joint).__name__} of {joint.first} and {joint.second} at {at}"
        self.q, self.v = places.q, places.v
        self.a, self.b = (places.frame(self.what, name) for name in (joint.first, joint.second))
        self.flat, self.at = places.dimension == 2, places.point(f"the place of {self.what}", joint.at)
        axis = None if joint.axis is None else places.direction(f"the axis of {self.what}", joint.axis)
        self.axis = None if axis is None else axis / length_of(axis)
        if isinstance(joint, Rolling):
            self._require(joint)

    def _require(self, joint: Rolling) -> None:
        """Refuse a wheel that lacks something, or has what it cannot have."""
        needed = {"axis": joint.axis, "angle": joint.angle, "radius": joint.radius} if self.flat else {"centre": joint.centre}
        if joint.slides:
            needed["axis"] = joint.axis
        missing = [name for name, value in needed.items() if value in (None, "")]
        if missing:
            raise InvalidProblem(f"{self.what} has no {' and no '.join(missing)}; give {'=, '.join(missing)}=.", "rolling-part-missing")
        if self.flat and joint.angle not in self.angles.spins:
            raise InvalidProblem(
                f"{self.what} has the angle {joint.angle!r}, which is no Spin; declare it as one in angles.", "rolling-angle-not-spin"
            )

    def _wheel(self) -> tuple[sp.Matrix, sp.Matrix, sp.Expr]:
        """Return the centre, the normal and the radius of a wheel in space, at the reference position."""
        assert isinstance(self.joint, Rolling)
        assert self.joint.centre is not None
        centre = self.angles.places.point(f"the centre of {self.what}", self.joint.centre)
        leg = centre - self.at
        if not any(leg):
            raise InvalidProblem(f"the centre of {self.what} is its point of contact; place it above.", "wheel-centre-at-contact")
        given = self.joint.normal
        normal = leg if given is None else self.angles.places.direction(f"the normal of {self.what}", given)
        return centre, normal / length_of(normal), length_of(leg)

    def heights(self) -> list[sp.Expr]:
        """Return the equation that keeps a wheel in space on the plane."""
        if self.flat or isinstance(self.joint, KnifeEdge):
            return []
        centre, normal, radius = self._wheel()
        n, height = self.b.along(normal), (self.a.at(centre) - self.b.at(self.at)).dot(self.b.along(normal))
        return [height - radius] if self.axis is None else [height**2 + (radius * n.dot(self.a.along(self.axis))) ** 2 - radius**2]

    def rows(self) -> Labelled:
        """Return the equations of velocities, linear in v, with their words."""
        joint = self.joint
        if isinstance(joint, Rolling) and not self.flat:
            return self._rolling(joint.slides)
        place = self.a.at(self.at)
        slip = place.jacobian(self.q) * self.v - self._carried(place)
        if isinstance(joint, KnifeEdge):
            ways = [QUARTER_TURN * self.axis] if self.flat else across(self.axis)
            return [(f"{self.what}, across", self.a.along(way).dot(slip)) for way in ways]
        axle, rate = self.a.along(self.axis), (self.angles.slope(joint.angle) * self.v)[0]
        along = -(QUARTER_TURN * axle).dot(slip) - exact(joint.radius or 0) * rate
        return [(f"{self.what}, along", along), (f"{self.what}, across", axle.dot(slip))][: 2 - joint.slides]

    def _rolling(self, slides: bool) -> Labelled:
        centre, normal, radius = self._wheel()
        c, n = self.a.at(centre), self.b.along(normal)
        v, spun = c.jacobian(self.q) * self.v, self._turned(self.a, n)
        if self.axis is None:
            arm, turned, ways = -radius * n, -radius * spun, [self.b.along(way / length_of(way)) for way in across(normal)]
        else:
            axle, height = self.a.along(self.axis), (c - self.b.at(self.at)).dot(n)
            # To the lowest point of the rim: its length is R, as R^2 = height^2 + (R n . axle)^2.
            lean, scale = n.dot(axle), radius**2 / height
            arm, turned = scale * (lean * axle - n), scale * (lean * axle.jacobian(self.q) * self.v - spun)
            ways = [axle.cross(n), axle - lean * n]
        slip = v + turned - self._carried(c + arm)
        return [(f"{self.what}, {name}", way.dot(slip)) for name, way in zip(("along", "across"), ways, strict=True)][: 2 - slides]

    def _carried(self, place: sp.Matrix) -> sp.Matrix:
        """Return the velocity of what is at a place in the second body."""
        first = self.b.columns[0].now
        return first.jacobian(self.q) * self.v + self._turned(self.b, place - first)

    def _turned(self, frame: Frame, arm: sp.Matrix) -> sp.Matrix:
        """Return the velocity of the end of an arm by the turning of a body."""
        none = sp.zeros(arm.rows, 1)
        axes = [] if frame.body == GROUND else [frame.along(sp.eye(arm.rows)[:, k]) for k in range(arm.rows)]
        return sum((e.jacobian(self.q) * self.v * e.dot(arm) for e in axes), none)
