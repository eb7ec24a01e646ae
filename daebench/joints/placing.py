"""Which points and directions have unknowns of their own, and where everything else is, linear in them.

Bodies are placed in the order in which they are declared. A body takes the points and directions that are known already, from the ground
and from earlier bodies, and gives unknowns only to those that it needs in addition; its other points are linear in these. A point that two
bodies name is one point, so that a joint there takes no equation.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import sympy as sp

from daebench.errors import InvalidProblem, unknown
from daebench.joints.bodies import AnyBody, Body, Plate, PointMass, QuaternionBody
from daebench.joints.exact import Array, Values, levelled, numbers, rank, simplified, spread, vector
from daebench.joints.frames import Column, Frame, fixed_frame, framed, rotation
from daebench.joints.joints import Place, direction
from daebench.systems.picture import Exact

GROUND = "ground"
"""Name of the ground where a joint has that of a body."""


@dataclass(frozen=True, init=False)
class Guided:
    """A point that is led along a line or in a plane, so that it has one unknown or two.

    The unknowns are in units of the directions, from the place of the line or plane that is next to the origin: along (1, 0) it is x.

    Parameters
    ----------
    place : sequence of number or Expr
        Its place at the reference position.
    *along : sequence of number or Expr
        The directions in which it can go.
    """

    place: Sequence[Exact]
    along: tuple[Sequence[Exact], ...]

    def __init__(self, place: Sequence[Exact], *along: Sequence[Exact]) -> None:
        if not along:
            raise InvalidProblem(
                f"a Guided point at {place!r} has no direction of motion; give one, or declare it in ground.", "guided-without-direction"
            )
        object.__setattr__(self, "place", place)
        object.__setattr__(self, "along", along)


@dataclass
class Places:
    """The points and directions by name, and the frames of bodies, that are known so far."""

    dimension: int
    declared: dict[str, Column]
    """All points and directions that move, in their reference place."""
    guides: dict[str, list[sp.Matrix]]
    columns: dict[str, Column]
    """Points and directions whose place is known at any position."""
    values: Values
    """Parameters at which ranks are decided."""
    frames: dict[str, Frame] = field(default_factory=dict)
    q: list[sp.Symbol] = field(default_factory=list)
    reference: list[sp.Expr] = field(default_factory=list)
    owners: dict[str, list[sp.Symbol]] = field(default_factory=dict)
    closures: list[tuple[str, sp.Expr]] = field(default_factory=list)
    names: dict[str, frozenset[str]] = field(default_factory=dict)
    """Points and directions that each body has."""
    holders: dict[str, list[str]] = field(default_factory=dict)
    """Bodies that have each point or direction."""
    quaternions: dict[str, sp.Expr] = field(default_factory=dict)
    """q.q - 1 of bodies with a quaternion, by its name in ``owners``."""

    def given(self, name: str) -> Column:
        """Return a point or direction at its reference place."""
        column = self.columns.get(name) or self.declared.get(name)
        if column is None:
            raise unknown("point or direction of the mechanism", name, [*self.columns, *self.declared])
        return column

    @property
    def v(self) -> sp.Matrix:
        """Symbols of the velocities, shape(d, 1)."""
        return sp.Matrix(sp.symbols(f"v1:{len(self.q) + 1}", real=True))

    @property
    def size(self) -> float:
        """Largest distance of a point from the first of them, m; 1 if all are in one place."""
        every = [*self.columns.values(), *(x for name, x in self.declared.items() if name not in self.columns)]
        return spread(numbers(sp.Matrix.hstack(*(x.reference for x in every if x.weight)), self.values)) or 1.0

    @property
    def scales(self) -> Array:
        """Range of each unknown, shape(d,): the size of the mechanism for one of a point, the length for one of a direction."""
        # Angles and quaternions have no place that is declared.
        ranges = dict.fromkeys(self.owners, 1.0)
        for name in self.owners.keys() & self.declared.keys():
            column = self.declared[name]
            ranges[name] = self.size if column.weight else float(np.linalg.norm(numbers(column.reference, self.values)))
        return np.array([ranges[name] for name, unknowns in self.owners.items() for _ in unknowns])

    def frame(self, what: str, name: str) -> Frame:
        """Return the frame of a body, or of the ground."""
        if name not in self.frames:
            raise unknown(f"body in {what}", name, self.frames)
        return self.frames[name]

    def point(self, what: str, at: Place) -> sp.Matrix:
        """Return a point at the reference position, of its name or its coordinates."""
        return self.given(at).reference if isinstance(at, str) else vector(what, at)

    def direction(self, what: str, axis: Place) -> sp.Matrix:
        """Return a direction at the reference position, of its name or its coordinates."""
        return self.given(axis).reference if isinstance(axis, str) else direction(what, axis)

    def added(self, owner: str, reference: Sequence[sp.Expr]) -> list[sp.Symbol]:
        """Return new unknowns, with their values at the reference position."""
        symbols = [sp.Symbol(f"q{len(self.q) + k + 1}", real=True) for k in range(len(reference))]
        self.q += symbols
        self.reference += reference
        self.owners[owner] = symbols
        return symbols

    def unknowns(self, name: str) -> Column:
        """Return a point or direction with unknowns of its own, which are new."""
        column, guides = self.declared[name], self.guides.get(name)
        start = gone(guides, column.reference) if guides else column.reference
        now = sp.Matrix(self.added(name, list(start)))
        if guides:
            D = sp.Matrix.hstack(*guides)
            # From the foot of the perpendicular from the origin, so that the unknown of a point on an axis is its coordinate.
            now = (column.reference - D * start).applyfunc(simplified) + D * now
        self.columns[name] = Column(name, column.reference, now, column.weight)
        return self.columns[name]

    def named(self, name: str) -> list[str]:
        """Return the names of the unknowns of a point or direction, x, y and z or the way along a guide, of a quaternion or an angle."""
        count = len(self.owners[name])
        if name in self.quaternions:
            return [f"e{k}" for k in range(count)]
        if name not in self.declared:
            return ["angle"]
        if name not in self.guides:
            return [*"xyz"[: self.dimension]]
        return ["way"] if count == 1 else [f"way {k + 1}" for k in range(count)]

    def body(self, name: str, body: AnyBody) -> None:
        """Make the frame of a body, and find where all its points and directions are."""
        if isinstance(body, QuaternionBody):
            self._oriented(name, body)
            return
        known = [x for x in body.names if x in self.columns]
        # Known points come first, so that new unknowns are given only where they are needed.
        chosen = self._independent([*known, *(x for x in body.names if x not in known)], self._needed(body))
        chosen += self._completed(name, body, chosen)
        columns = [self.columns[x] if x in self.columns else self.unknowns(x) for x in chosen]
        # Points first: the directions of a frame are taken from its first column.
        columns.sort(key=lambda column: -column.weight)
        if not columns or not columns[0].weight:
            raise InvalidProblem(f"{name} has only directions; name also a point that is fixed in it.", "body-of-directions-only")
        others = {other: self.names[other] for column in columns for other in self.holders.get(column.name, ())}
        frame = self.frames[name] = framed(name, columns, self.values, tuple(others.values()))
        self.names[name] = frozenset([*body.names, *chosen])
        for column in self.names[name]:
            self.holders.setdefault(column, []).append(name)
        for other in (x for x in body.names if x not in chosen):
            self._derived(name, frame, other)

    def _oriented(self, name: str, body: QuaternionBody) -> None:
        """Place a body by its centre, or a point of the ground, and a quaternion."""
        still = [x for x in body.names if x in self.columns and not self.columns[x].now.free_symbols & {*self.q}]
        at = body.centre if isinstance(body.centre, str) else f"{name}.centre"
        if not isinstance(body.centre, str):
            self.declared[at] = _column(at, body.centre, 1)
        at = next((x for x in still if self.columns[x].weight), at)
        base = self.columns[at] if at in self.columns else self.unknowns(at)
        if self.dimension != 3:
            raise InvalidProblem(
                f"{name} is a QuaternionBody, for space, but the mechanism is plane; make it a Body.", "quaternion-body-in-plane"
            )
        owner = f"{name}.quaternion"
        q = sp.Matrix(self.added(owner, [sp.S.One, sp.S.Zero, sp.S.Zero, sp.S.Zero]))
        self.quaternions[owner] = q.dot(q) - 1
        self.closures.append((f"the length of the quaternion of {name}", self.quaternions[owner]))
        R, axes = rotation(q), sp.eye(3)
        turned = [Column(f"{name}.{letter}", axes[:, k], R[:, k], 0) for k, letter in enumerate("xyz")]
        frame = self.frames[name] = Frame(name, (base, *turned), 1, self.values)
        for other in (x for x in body.names if x != at):
            self._derived(name, frame, other)

    def _needed(self, body: AnyBody) -> int:
        """Return the number of points and directions that a body needs."""
        if isinstance(body, PointMass):
            return 1
        if self.dimension == 2:
            return 2
        return 4 if isinstance(body, Body) else 3 if isinstance(body, Plate) else 2

    def _independent(self, names: Iterable[str], most: int) -> list[str]:
        """Return the first names, ``most`` at most, of which none is a combination of others."""
        chosen: list[str] = []
        for name in names:
            trial = [*chosen, name]
            matrix = sp.Matrix.hstack(*(self.given(x).homogeneous for x in trial))
            if len(chosen) < most and rank(levelled(numbers(matrix, self.values))) == len(trial):
                chosen = trial
        return chosen

    def _completed(self, name: str, body: AnyBody, chosen: list[str]) -> list[str]:
        """Return new directions that a body needs in addition to its names."""
        needed = self._needed(body)
        if len(chosen) == needed:
            return []
        if not isinstance(body, Body):
            raise InvalidProblem(
                f"{name} is a {type(body).__name__} whose first {needed} points are not distinct; place them apart.", "body-points-coincide"
            )
        axes = sp.eye(self.dimension)
        labels = [f"{name}.{letter}" for letter in "xyz"[: self.dimension]]
        for k, label in enumerate(labels):
            self.declared[label] = Column(label, axes[:, k], axes[:, k], 0)
        return self._independent([*chosen, *labels], needed)[len(chosen) :]

    def _derived(self, body: str, frame: Frame, name: str) -> None:
        """Place a point or direction by a body's frame; one that is known already closes a loop."""
        column = self.given(name)
        now = frame.placed(column.reference, column.weight)
        # A guided point has unknowns of its own even if the body determines its place: the guide is then the constraint.
        if name not in self.columns and name not in self.guides:
            self.columns[name] = Column(name, column.reference, now, column.weight)
            return
        there = self.columns[name] if name in self.columns else self.unknowns(name)
        self.closures += [(f"the place of {name} in {body}", x) for x in now - there.now if sp.expand(x) != 0]


def gone(guides: Sequence[sp.Matrix], place: sp.Matrix) -> sp.Matrix:
    """Return the unknowns of a guided point at a place, shape(1, 1) or shape(2, 1)."""
    D = sp.Matrix.hstack(*guides)
    return ((D.T * D).inv() * D.T * place).applyfunc(simplified)


def places_of(
    ground: Mapping[str, Sequence[Exact]],
    points: Mapping[str, Sequence[Exact] | Guided],
    directions: Mapping[str, Sequence[Exact]],
    fixed_directions: Mapping[str, Sequence[Exact]],
    values: Values,
) -> Places:
    """Return the points and directions known before any body: the ground."""
    columns = {name: _column(name, x, 1) for name, x in ground.items()} | {
        name: _column(name, x, 0) for name, x in fixed_directions.items()
    }
    declared = {name: _column(name, x.place if isinstance(x, Guided) else x, 1) for name, x in points.items()}
    declared |= {name: _column(name, x, 0) for name, x in directions.items()}
    if len(columns) + len(declared) < len(ground) + len(fixed_directions) + len(points) + len(directions) or {*columns} & {*declared}:
        raise InvalidProblem("the mechanism uses one name for two points or directions; rename one.", "mechanism-name-twice")
    sizes = {len(column.reference) for column in (*columns.values(), *declared.values())}
    if len(sizes) != 1:
        raise InvalidProblem(
            "a mechanism needs points, all in the plane or all in space: two coordinates each, or three.", "points-of-mixed-dimension"
        )
    guides = {name: [vector(f"guide of {name}", way) for way in x.along] for name, x in points.items() if isinstance(x, Guided)}
    (dimension,) = sizes
    places = Places(dimension, declared, guides, columns, values)
    places.frames[GROUND] = fixed_frame(dimension, values)
    return places


def _column(name: str, place: Sequence[Exact], weight: int) -> Column:
    where = vector(f"{'point' if weight else 'direction'} {name}", place)
    if not weight and not any(where):
        raise InvalidProblem(f"the direction {name} is 0; give one that points somewhere.", "named-direction-zero")
    return Column(name, where, where, weight)
