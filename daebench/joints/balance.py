"""Newton-Euler equations of the bodies of a mechanism that is cut at its joints, linear in what the joints transmit.

::

    sum of the forces of its joints on a body             = d/dt momentum - weight
    sum of their torques about a point r of the body      = d/dt angular momentum about r - torque of the weight
    sum of the forces on a point that several parts share = 0, with the forces that springs, dampers and other joints apply there

They are A z = b. The unknowns z are the forces at shared points, the couples across shared directions, and the multipliers of joints that
have equations. Stresses within bodies do not enter.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from daebench.joints.cut import Cut, Pull, Tie
from daebench.joints.exact import Array
from daebench.joints.placing import GROUND

AXES = np.eye(3)

Part = tuple[str, str]
"""A body, ("body", name), or a point or direction that is shared, ("node", name)."""


@dataclass(frozen=True)
class Port:
    """A joint where it acts on a body or a point: the unknowns that act there, and the point that its torque is about, shape(n, 3)."""

    joint: str
    part: Part
    at: str
    unknowns: tuple[int, ...]
    about: Array


class Balance:
    """Equations of all bodies and shared points at some times, positions, velocities and accelerations.

    Attributes
    ----------
    A, b : ndarray, shape(n, rows, unknowns) and shape(n, rows)
        The equations: six of each body, forces before torques, and then three of each point.
    rows : dict
        The first row of each body, ("body", name), and of each point, ("node", name).
    places : dict
        Points and directions of each body, shape(n, k, 3).
    """

    def __init__(self, cut: Cut, t: Array, q: Array, v: Array, a: Array) -> None:
        self.cut, self.t = cut, t
        self.places = {name: body.columns.at(q) for name, body in cut.bodies.items()}
        self.points = {name: node.place.at(q)[:, 0] for name, node in cut.nodes.items()}
        self.shared = self._shared()
        first = sum(len(tie.equations) for tie in cut.ties)
        self.rows: dict[Part, int] = {("body", name): 6 * k for k, name in enumerate(cut.bodies)}
        self.unknowns: dict[tuple[str, str], range] = {}
        for name in self.shared:
            node = cut.nodes[name]
            if not node.fixed:
                self.rows["node", name] = 6 * len(cut.bodies) + 3 * sum(kind == "node" for kind, _ in self.rows)
            for holder, count in [*((body, 3) for body in node.holders), ("guide", len(node.normals))]:
                self.unknowns[name, holder] = range(first, first + count)
                first += count
        height = 6 * len(cut.bodies) + 3 * (len(self.rows) - len(cut.bodies))
        self.A, self.b = np.zeros((len(t), height, first)), np.zeros((len(t), height))
        self._inertia(a)
        for name in self.shared:
            self._node(name)
        self._ties()
        for pull in cut.pulls:
            self._pull(pull, q, v)

    def _shared(self) -> list[str]:
        """Return the points and directions that have a part in the balance besides that of one body."""
        pulled = {end for pull in self.cut.pulls for end in pull.ends} | {end for tie in self.cut.ties for end in tie.points}
        nodes = self.cut.nodes.items()
        return [x for x, node in nodes if node.holders and (len(node.holders) + node.fixed > 1 or len(node.normals) or x in pulled)]

    def _place(self, body: str, coefficients: Array) -> Array:
        place: Array = np.einsum("k,tki->ti", coefficients, self.places[body])
        return place

    def _act(self, part: Part, to: Array, arm: Array, weight: float, force: Array) -> None:
        """Add a force on a point (weight 1) or direction (weight 0) of a body, or on a shared point, to columns of A, or to b."""
        if part not in self.rows:
            return
        row = self.rows[part]
        if part[0] == "node":
            to[:, row : row + 3] += force
            return
        to[:, row : row + 3] += weight * force
        to[:, row + 3 : row + 6] += np.cross(arm - weight * self.places[part[1]][:, 0], force)

    def _inertia(self, a: Array) -> None:
        for name, body in self.cut.bodies.items():
            pull = np.einsum("kl,tli->tki", body.mass, body.columns.rate(a)) - body.first[:, None] * self.cut.gravity
            for k, weight in enumerate(body.weights):
                self._act(("body", name), self.b, self.places[name][:, k], weight, pull[:, k])

    def _node(self, name: str) -> None:
        """Let each body that has a point or direction be acted on there, and the point by the opposite, or by its guide."""
        node = self.cut.nodes[name]
        for body, coefficients in node.holders.items():
            arm = self._place(body, coefficients)
            for axis, z in zip(AXES, self.unknowns[name, body], strict=True):
                self._act(("body", body), self.A[..., z], arm, node.weight, axis)
                self._act(("node", name), self.A[..., z], arm, 1.0, -axis)
        for normal, z in zip(node.normals, self.unknowns[name, "guide"], strict=True):
            self._act(("node", name), self.A[..., z], self.points[name], 1.0, normal)

    def _ties(self) -> None:
        columns = {("node", name, 0): (x, 1.0) for name, x in self.points.items()}
        for name, body in self.cut.bodies.items():
            columns |= {("body", name, k): (self.places[name][:, k], weight) for k, weight in enumerate(body.weights)}
        gradients = self.cut.gradients(self.t, {key: x for key, (x, _) in columns.items()})
        for (z, key), gradient in zip(self.cut.owners, gradients, strict=True):
            arm, weight = columns[key]
            self._act(key[:2], self.A[..., z], arm, weight, -gradient)

    def _pull(self, pull: Pull, q: Array, v: Array) -> None:
        """Move the force of a spring or damper on its ends to the right side."""
        nodes = [self.cut.nodes[end].place for end in pull.ends]
        gap, rate = ((there - here)[:, 0] for here, there in ([x.at(q) for x in nodes], [x.rate(v) for x in nodes]))
        way = gap if pull.along is None else np.broadcast_to(pull.along, gap.shape)
        length = np.linalg.norm(way, axis=1, keepdims=True)
        stretched = gap
        if pull.rest or pull.along is not None:
            way = way / length
            stretched = (np.sum(gap * way, axis=1, keepdims=True) - pull.rest) * way
        force = pull.stiffness * stretched
        if pull.damping:
            unit = way if pull.along is not None else gap / np.linalg.norm(gap, axis=1, keepdims=True)
            force = force + pull.damping * np.sum(rate * unit, axis=1, keepdims=True) * unit
        for end, sign in zip(pull.ends, (-1.0, 1.0), strict=True):
            self._act(("node", end), self.b, gap, 1.0, sign * force)

    def ports(self) -> Iterator[Port]:
        """Yield all joints, at each body or point that they act on."""
        groups = self._groups()
        for tie, name in zip(self.cut.ties, distinct([tie.name for tie in self.cut.ties]), strict=True):
            yield from self._ports_of(tie, name, groups)
        for holders, names in groups.items():
            points = [name for name in names if self.cut.nodes[name].weight]
            about = self.points[points[0]] if points else np.zeros((len(self.t), 3))
            for body in (x for x in holders if x != GROUND):
                unknowns = tuple(z for name in names for z in self.unknowns[name, body])
                yield Port(f"joint {', '.join(names)}", ("body", body), points[0] if points else names[0], unknowns, about)
        for name in self.shared:
            if self.unknowns[name, "guide"]:
                yield Port(f"guide of {name}", ("node", name), name, tuple(self.unknowns[name, "guide"]), self.points[name])

    def _groups(self) -> dict[tuple[str, ...], list[str]]:
        """Return shared points and directions by the bodies that share them, the ground the last."""
        groups: dict[tuple[str, ...], list[str]] = {}
        for name in self.shared:
            node = self.cut.nodes[name]
            holders = (*sorted(node.holders), *([GROUND] if node.fixed else []))
            if len(holders) > 1:
                groups.setdefault(holders, []).append(name)
        return groups

    def _ports_of(self, tie: Tie, name: str, groups: dict[tuple[str, ...], list[str]]) -> Iterator[Port]:
        parts = [x for x in tie.bodies if x != GROUND] or [x for x in tie.points if ("node", x) in self.rows]
        key = (*sorted(x for x in tie.bodies if x != GROUND), *([GROUND] if GROUND in tie.bodies else []))
        # What is left out of its equations, since bodies share a point or direction, is part of the joint.
        names = groups.pop(key, []) if tie.shares else []
        place = next(iter(tie.place.items()), None)
        for part in parts:
            about = self._place(*place) if place else self.points[part] if tie.points else self.places[part][:, 0]
            shared = tuple(z for x in names for z in self.unknowns[x, part])
            yield Port(name, ("body" if tie.bodies else "node", part), tie.at or part, (*tie.equations, *shared), about)


def distinct(names: list[str]) -> list[str]:
    """Return names in which those that are the same are numbered."""
    counts = [names[: k + 1].count(name) for k, name in enumerate(names)]
    return [f"{name} ({count})" if names.count(name) > 1 else name for name, count in zip(names, counts, strict=True)]
