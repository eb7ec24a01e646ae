"""A mechanism cut at its joints: bodies and shared points as parts of their own, with the equations that hold them together.

Each part has symbols of its own for its points and directions e_k. What a joint can transmit follows from its equations g between such
parts: the force -lam dg/de_k on each e_k. A shared point is a part without mass, to which each body that has it is held by equations.
An angle is a function of the e_k by its own equation, which transmits nothing.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import sympy as sp

from daebench.errors import BadInput
from daebench.joints.angles import Coupling, Gear, Measured, Spin
from daebench.joints.constraints import of_joint
from daebench.joints.drivers import DrivenCoordinate, DrivenDistance, driven_angle
from daebench.joints.exact import vector
from daebench.joints.frames import Column, Frame, framed
from daebench.joints.joints import Distance, Place
from daebench.joints.mechanism import Mechanism, angled, placed
from daebench.joints.placing import GROUND
from daebench.joints.rolling import KnifeEdge, Rolling

Part = tuple[str, str]
"""A body, ("body", name), or a point or direction, ("point", name)."""

POINTS = (Distance, DrivenCoordinate, DrivenDistance)
"""Joints between points; others are between bodies."""


@dataclass(frozen=True)
class Port:
    """A joint where it acts on a part: the numbers of its equations there, and the place that its torque is about, in q.

    ``body`` is the body that is acted on, and "" at a point that several have.
    """

    joint: str
    part: Part
    body: str
    at: str
    about: sp.Matrix
    equations: tuple[int, ...]


def _apart(one: Measured, frames: dict[str, Frame]) -> Measured:
    """Return an angle between bodies apart."""
    if one.driver is None:
        raise BadInput(
            f"{one.words} is a distance with an unknown of its own, for which reactions are not known; leave them out.",
            "reactions-of-distance",
        )
    return replace(one, equation=driven_angle(one.driver, frames[one.driver.first], frames[one.driver.second], one.axis)[0])


class Cut:
    """A mechanism in parts.

    Attributes
    ----------
    places, apart : Places
        Its points and bodies in the unknowns q, and in the symbols of each part.
    angles : Angles
        Its angles, with their equations in the symbols of each part.
    owners : dict
        Part, column and component of each symbol, and its expression in q where the joints hold.
    equations : list of Expr
        The equations that hold the parts together.
    held : dict
        Numbers of the equations that hold a point or direction to a body, by their names.
    ports : list of Port
        The joints where they act.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        if contacts := [x for x in mechanism.joints if isinstance(x, Rolling | KnifeEdge)]:
            name = f"the {type(contacts[0]).__name__} of {contacts[0].first} and {contacts[0].second}"
            raise BadInput(
                f"reactions are not known for mechanisms with wheels or edges, such as {name}; use the multipliers of a run.",
                "reactions-of-wheels",
            )
        self.mechanism, self.places = mechanism, placed(mechanism)
        self.owners: dict[sp.Symbol, tuple[Part, int, int, sp.Expr]] = {}
        self.equations: list[sp.Expr] = []
        self.ports: list[Port] = []
        places, self.fixed = self.places, {*mechanism.ground, *mechanism.fixed_directions}
        frames = {GROUND: places.frames[GROUND]}
        for name in mechanism.bodies:
            # All but the direction across, which a plane body has in addition.
            columns = places.frames[name].columns[: 2 if places.dimension == 2 else 4]
            frames[name] = framed(name, [self._alone(("body", name), k, x) for k, x in enumerate(columns)], places.values)
        points = {name: x if name in self.fixed else self._alone(("point", name), 0, x) for name, x in places.columns.items()}
        self.apart = replace(places, frames=frames, columns=points)
        angles = angled(mechanism, places)
        self.angles = replace(angles, places=self.apart, measured={words: _apart(one, frames) for words, one in angles.measured.items()})
        self.held = {name: self._held(name) for name in points}
        for name, ways in places.guides.items():
            across = sp.Matrix.hstack(*ways).T.nullspace()
            self._at_point(f"guide of {name}", name, self._add([x.dot(points[name].now - points[name].reference) for x in across]))
        self._joints({name: (*links, *([GROUND] if name in self.fixed else [])) for name, links in self.held.items()})

    def _alone(self, part: Part, k: int, column: Column) -> Column:
        """Return a column with symbols of its own."""
        now = sp.Matrix([sp.Dummy(real=True) for _ in column.now])
        self.owners |= {x: (part, k, i, column.now[i]) for i, x in enumerate(now)}
        return replace(column, now=now)

    def _add(self, expressions: Sequence[sp.Expr]) -> tuple[int, ...]:
        self.equations += expressions
        return tuple(range(len(self.equations) - len(expressions), len(self.equations)))

    def _held(self, name: str) -> dict[str, tuple[int, ...]]:
        """Hold a point or direction to the bodies that have it, if one of them is acted on there."""
        column, mechanism, frames = self.apart.columns[name], self.mechanism, self.apart.frames
        bodies = [x for x, body in mechanism.bodies.items() if name in {*body.names, *(y.name for y in frames[x].columns)}]
        ends = {getattr(x, end, "") for x in (*mechanism.forces, *mechanism.joints) for end in ("first", "second", "point")}
        if len(bodies) < 2 and name not in {*self.fixed, *ends, *self.places.guides}:
            return {}
        return {x: self._add(list(frames[x].placed(column.reference, column.weight) - column.now)) for x in bodies}

    def _at_point(self, joint: str, name: str, equations: tuple[int, ...]) -> None:
        bodies = [*self.held[name]]
        if name not in self.fixed:
            body = bodies[0] if len(bodies) == 1 else ""
            self.ports.append(Port(joint, ("point", name), body, name, self.places.columns[name].now, equations))

    def _joints(self, holders: dict[str, tuple[str, ...]]) -> None:
        together = {x: now for x, (*_, now) in self.owners.items()}
        for joint in self.mechanism.joints:
            words, expressions, _ = of_joint(joint, self.angles, self.apart.values)
            equations = self._add([x for x in expressions if sp.expand(x.xreplace(together)) != 0])
            name = words.removeprefix("the ")
            if isinstance(joint, POINTS):
                for end in (joint.point,) if isinstance(joint, DrivenCoordinate) else (joint.first, joint.second):
                    self._at_point(name, end, equations)
            elif isinstance(joint, Gear | Coupling):
                turned = [x for name in (joint.first, joint.second) if not isinstance(x := self.mechanism.angles[name], Spin)]
                acted = dict.fromkeys(x for y in turned for x in (y.first, y.second) if x != GROUND)
                self._at_bodies(name, [*acted], "", equations, [])
            elif equations:
                ends = {joint.first, joint.second}
                # Equations are left out where bodies share a point or direction: what that transmits is part of the joint.
                left = len(equations) < len(expressions)
                points = [x for x, bodies in holders.items() if left and {*bodies} == ends]
                holders = {x: bodies for x, bodies in holders.items() if x not in points}
                self._at_bodies(name, [x for x in (joint.first, joint.second) if x != GROUND], getattr(joint, "at", ""), equations, points)
        for bodies in dict.fromkeys(holders.values()):
            points = [x for x, others in holders.items() if others == bodies]
            # A point before a direction: torques are about it.
            points.sort(key=lambda x: -self.places.columns[x].weight)
            if len(bodies) > 1:
                self._at_bodies(f"joint {', '.join(points)}", [x for x in bodies if x != GROUND], points[0], (), points)

    def _at_bodies(self, name: str, bodies: list[str], at: Place, equations: tuple[int, ...], points: list[str]) -> None:
        first = self.places.frames[bodies[0]]
        place = first.columns[0].reference
        if isinstance(at, str):
            place = self.places.given(at).reference if at else place
        else:
            place, at = vector("its place", at), f"({', '.join(map(str, at))})"
        if any(port.joint == name for port in self.ports):
            name = f"{name} at {at}"
        for body in bodies:
            shared = [z for x in points for z in self.held[x][body]]
            self.ports.append(Port(name, ("body", body), body, at, first.at(place), (*equations, *shared)))
