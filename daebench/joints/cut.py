"""A mechanism cut at its joints: free bodies, the points and directions that they share, and the equations of the other joints.

Every body gets its own points and directions, e_k, which are affine in the unknowns q of the mechanism where the joints hold. What a joint
can transmit follows from its equation g, written for bodies that are apart: the force -lam dg/de_k on each e_k of a body. A point that
bodies share transmits any force to each of them, and a direction u that they share any couple across u.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import sympy as sp

from daebench.joints.constraints import of_joint
from daebench.joints.drivers import DrivenCoordinate, DrivenDistance, t
from daebench.joints.exact import Array, Values, exact, number, numbers, spread, vector
from daebench.joints.forces import Force, Spring, length_along, rest_length
from daebench.joints.frames import Column, Frame, framed
from daebench.joints.inertia import by_columns, moments
from daebench.joints.joints import Distance
from daebench.joints.mechanism import Mechanism, placed
from daebench.joints.placing import GROUND, Places

Key = tuple[str, str, int]
"""A point or direction: that of a body by its number, ("body", name, k), or one that has a name, ("node", name, 0)."""


@dataclass(frozen=True)
class Affine:
    """Points and directions of space, slope q + still; those of the plane have z = 0."""

    slope: Array
    still: Array

    @classmethod
    def of(cls, columns: list[sp.Matrix], q: list[sp.Symbol], values: Values) -> "Affine":
        """Return columns of expressions in q."""
        stacked, n = sp.Matrix.vstack(*columns), len(columns[0])
        still = numbers(stacked.subs(dict.fromkeys(q, 0)), values).reshape(-1, n)
        slope = numbers(stacked.jacobian(q), values).reshape(-1, n, len(q))
        return cls(np.pad(slope, ((0, 0), (0, 3 - n), (0, 0))), np.pad(still, ((0, 0), (0, 3 - n))))

    def rate(self, v: Array) -> Array:
        """Return the velocities, or accelerations, for those of q, shape(n, d); shape(n, k, 3)."""
        rate: Array = np.einsum("kid,td->tki", self.slope, v)
        return rate

    def at(self, q: Array) -> Array:
        """Return the places, shape(n, k, 3)."""
        return self.rate(q) + self.still


@dataclass(frozen=True)
class FreeBody:
    """A body with the points and directions that its frame has."""

    columns: Affine
    reference: Array
    """The columns at the reference position, shape(k, 3)."""
    weights: Array
    """1 of points and 0 of directions, shape(k,)."""
    mass: Array
    """Its mass matrix by columns, shape(k, k)."""
    first: Array
    """Its moments of order 1 by columns, shape(k,): gravity acts on column k with first_k times the acceleration."""


@dataclass(frozen=True)
class Node:
    """A point or direction that has a name, with the bodies that have it."""

    place: Affine
    weight: int
    fixed: bool
    """Whether the ground has it, too."""
    holders: Mapping[str, Array]
    """Coefficients of the place in the columns of each body that has it."""
    normals: Array
    """Directions across the guide of a guided point, shape(., 3)."""


@dataclass(frozen=True)
class Tie:
    """A joint, distance or driver that has equations."""

    name: str
    equations: range
    """Numbers of its equations."""
    bodies: tuple[str, ...]
    """Bodies that it is between, the ground among them; none if it is between points."""
    points: tuple[str, ...]
    place: Mapping[str, Array]
    """Coefficients of its point in the columns of each of its bodies."""
    at: str
    shares: bool
    """Whether points and directions that the bodies share are part of it, so that equations were left out."""


@dataclass(frozen=True)
class Pull:
    """A spring or damper: its ends, stiffness, length without force, damping, and the direction of a length that has a sign."""

    ends: tuple[str, str]
    stiffness: float
    rest: float
    damping: float
    along: Array | None


@dataclass(frozen=True)
class Cut:
    """A mechanism in parts, with the numbers of a run."""

    dimension: int
    size: float
    """Size of the mechanism, m."""
    gravity: Array
    bodies: Mapping[str, FreeBody]
    nodes: Mapping[str, Node]
    ties: tuple[Tie, ...]
    pulls: tuple[Pull, ...]
    owners: tuple[tuple[int, Key], ...]
    """Number of the equation and the column of each gradient."""
    gradients: Callable[[Array, Mapping[Key, Array]], list[Array]]
    """Gradients dg/de, each shape(n, 3), of times and of the places of columns."""


def cut(mechanism: Mechanism, values: Values) -> Cut:
    """Return a mechanism cut at its joints, with these values of its parameters."""
    places = placed(mechanism)
    bodies = {name: _free(name, mechanism, places, values) for name in mechanism.bodies}
    apart, symbols = _apart(places)
    ties, equations = _ties(mechanism, places, apart, symbols, values)
    owners, gradients = _gradients(equations, symbols, values)
    nodes = {name: _node(name, mechanism, places, values) for name in places.columns}
    reference = [body.reference[body.weights > 0] for body in bodies.values()]
    size = spread(np.concatenate([*reference, *(x.place.still for x in nodes.values() if x.fixed and x.weight)]).T) or 1.0
    pull = sp.zeros(places.dimension, 1) if mechanism.gravity is None else vector("gravity", mechanism.gravity)
    gravity = np.pad(numbers(pull, values).ravel(), (0, 3 - places.dimension))
    pulls = tuple(_pull(force, places, values) for force in mechanism.forces)
    return Cut(places.dimension, size, gravity, bodies, nodes, ties, pulls, owners, gradients)


def _free(name: str, mechanism: Mechanism, places: Places, values: Values) -> FreeBody:
    frame, references = places.frames[name], {x: column.reference for x, column in (places.declared | places.columns).items()}
    J, C = moments(name, mechanism.bodies[name], references, values), by_columns(frame)
    reference = numbers(sp.Matrix.hstack(*(x.reference for x in frame.columns)), values).T
    return FreeBody(
        Affine.of([x.now for x in frame.columns], places.q, values),
        np.pad(reference, ((0, 0), (0, 3 - places.dimension))),
        np.array([float(x.weight) for x in frame.columns]),
        numbers(C * J * C.T, values),
        numbers(C * J[:, -1], values).ravel(),
    )


def _coefficients(frame: Frame, column: Column, values: Values) -> Array:
    return numbers(sp.Matrix(frame.coefficients(column.reference, column.weight)), values).ravel()


def _node(name: str, mechanism: Mechanism, places: Places, values: Values) -> Node:
    column = places.columns[name]
    having = [
        body
        for body, declared in mechanism.bodies.items()
        if name in declared.names or name in {x.name for x in places.frames[body].columns}
    ]
    normals = np.zeros((0, 3))
    if name in places.guides:
        ways = numbers(sp.Matrix.hstack(*places.guides[name]), values).T
        _, sizes, rows = np.linalg.svd(ways)
        normals = np.pad(rows[len(sizes) :], ((0, 0), (0, 3 - places.dimension)))
    return Node(
        Affine.of([column.now], places.q, values),
        column.weight,
        name in mechanism.ground or name in mechanism.fixed_directions,
        {body: _coefficients(places.frames[body], column, values) for body in having},
        normals,
    )


def _apart(places: Places) -> tuple[Places, dict[sp.Symbol, tuple[Key, int, sp.Expr]]]:
    """Return places in which each column is a symbol of its own, and of each symbol its column, component and expression in q."""
    symbols: dict[sp.Symbol, tuple[Key, int, sp.Expr]] = {}

    def alone(kind: str, name: str, k: int, column: Column) -> Column:
        now = sp.Matrix([sp.Dummy(real=True) for _ in column.now])
        symbols.update({x: ((kind, name, k), i, column.now[i]) for i, x in enumerate(now)})
        return replace(column, now=now)

    moves = {*places.q}
    columns = {name: alone("node", name, 0, x) if x.now.free_symbols & moves else x for name, x in places.columns.items()}
    frames = {GROUND: places.frames[GROUND]}
    for name, frame in places.frames.items():
        if name != GROUND:
            alike = [alone("body", name, k, x) for k, x in enumerate(frame.columns[: frame.declared])]
            frames[name] = framed(name, alike, places.values)
    return replace(places, columns=columns, frames=frames), symbols


def _ties(
    mechanism: Mechanism, places: Places, apart: Places, symbols: Mapping[sp.Symbol, tuple[Key, int, sp.Expr]], values: Values
) -> tuple[tuple[Tie, ...], list[sp.Expr]]:
    """Return the joints that have equations, and their equations between bodies that are apart."""
    together = {x: now for x, (_, _, now) in symbols.items()}
    ties: list[Tie] = []
    equations: list[sp.Expr] = []
    for joint in mechanism.joints:
        words, expressions, _ = of_joint(joint, apart, dict(mechanism.parameters))
        # What shared points and directions keep in any position is theirs to transmit.
        left = [x for x in expressions if sp.expand(x.xreplace(together)) != 0]
        if not left:
            continue
        named = (joint.point,) if isinstance(joint, DrivenCoordinate) else (joint.first, joint.second)
        bodies, points = ((), named) if isinstance(joint, Distance | DrivenCoordinate | DrivenDistance) else (named, ())
        place: dict[str, Array] = {}
        at = ", ".join(points)
        if where := getattr(joint, "at", None):
            column = places.given(where) if isinstance(where, str) else Column("", vector("its place", where), sp.Matrix(), 1)
            place = {x: _coefficients(places.frames[x], column, values) for x in bodies if x != GROUND}
            at = where if isinstance(where, str) else f"({', '.join(map(str, where))})"
        equations_here = range(len(equations), len(equations) + len(left))
        ties.append(Tie(words.removeprefix("the "), equations_here, bodies, points, place, at, len(left) < len(expressions)))
        equations += left
    return tuple(ties), equations


def _gradients(
    equations: list[sp.Expr], symbols: Mapping[sp.Symbol, tuple[Key, int, sp.Expr]], values: Values
) -> tuple[tuple[tuple[int, Key], ...], Callable[[Array, Mapping[Key, Array]], list[Array]]]:
    """Return the gradients of all equations with respect to the columns in them, as one function."""
    entries: dict[tuple[int, Key], list[Any]] = {}
    for z, equation in enumerate(equations):
        for x in sorted(equation.free_symbols & {*symbols}, key=lambda x: symbols[x][:2]):
            key, i, _ = symbols[x]
            entries.setdefault((z, key), [sp.S.Zero] * 3)[i] = equation.diff(x).subs(values)
    call = sp.lambdify([t, list(symbols)], list(entries.values()), "numpy", cse=True)

    def gradients(time: Array, places: Mapping[Key, Array]) -> list[Array]:
        rows = call(time, [places[key][:, i] for key, i, _ in symbols.values()])
        return [np.stack([np.broadcast_to(x, len(time)) for x in row], axis=1).astype(float) for row in rows]

    return tuple(entries), gradients


def _pull(force: Force, places: Places, values: Values) -> Pull:
    """Return a spring or damper; its length has a sign where its ends stay on one line."""
    columns = places.columns
    stiffness, rest = (force.stiffness, rest_length(force, columns)) if isinstance(force, Spring) else (0, sp.S.Zero)
    along = None
    if length_along(force, columns, places.values) is not None:
        a, b = columns[force.first], columns[force.second]
        gap = Affine.of([b.now - a.now], places.q, values)
        ways = np.column_stack([gap.slope[0], gap.still[0]])
        along = ways[:, np.linalg.norm(ways, axis=0).argmax()]
        was = numbers(b.reference - a.reference, values).ravel()
        along = along / np.linalg.norm(along) * (-1.0 if along[: len(was)] @ was < 0 else 1.0)
    return Pull(
        (force.first, force.second), number(exact(stiffness), values), number(rest, values), number(exact(force.damping), values), along
    )
