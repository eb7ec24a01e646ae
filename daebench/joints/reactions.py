"""Forces and torques in the joints of a mechanism: the Newton-Euler equations of its bodies, solved for what joints can transmit.

::

    A z = b       a body:   forces and torques of its joints      = rates of momentum and angular momentum - those of its weight,
                                                                    and of springs, dampers, motors and rotors at its angles
                  a shared point:   forces of its joints          = - those of springs and dampers

Stresses within bodies do not enter. Redundant joints leave directions N of z free, A N = 0: a component R z of a force or torque is
determined by rigid bodies if R N = 0, and NaN otherwise; no solution of least norm stands in its place.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
import sympy as sp

from daebench.errors import BadInput
from daebench.joints.cut import Cut, Part, Port
from daebench.joints.drivers import t as time
from daebench.joints.exact import Array, Values, exact, numbers, vector
from daebench.joints.forces import Damper, Spring, length_along, rest_length
from daebench.joints.frames import Column
from daebench.joints.inertia import by_columns, moments
from daebench.joints.mechanism import Mechanism
from daebench.joints.torques import RotationalSpring, torque_force

RANK = 1e-9
"""Part of the largest singular value below which one is 0."""

FREE = 1e-6
"""Change of a force by a free direction below which it is determined; of a torque, times the size of the mechanism."""

AT_ONCE = 256
"""Number of times that are solved together."""

Push = tuple[int | None, Part, int, sp.Matrix]
"""Force on a column of a part, with the number of the unknown by which it is multiplied; None of one on the right side."""


@dataclass(frozen=True)
class Load:
    """Force and torque of a joint on one of its bodies, or of a constraint on the coordinates.

    Parameters
    ----------
    joint, on, at : str
        Names of the joint, of the body or point that it acts on, and of the joint's point.
    force, torque : ndarray, shape(n, k)
        In the axes of the ground, N and N m, the torque about the joint's point: three components each in space, two and one in the
        plane. What rigid bodies do not determine is NaN.
    force_in_body, torque_in_body : ndarray, shape(n, k)
        The same in the axes of the body, which are those of the ground at the reference position.
    """

    joint: str
    on: str
    at: str
    force: Array
    torque: Array
    force_in_body: Array
    torque_in_body: Array


class Balance:
    """Newton-Euler equations of a mechanism with the numbers of a run."""

    def __init__(self, mechanism: Mechanism, values: Values) -> None:
        self.mechanism, self.values, self.cut = mechanism, values, Cut(mechanism)
        self.places, self.vectors = self.cut.places, list[list[sp.Expr]]()
        self.size = max(self.places.frames[name].size for name in mechanism.bodies)
        self.parts: dict[Part, Sequence[Column]] = {("body", name): self.places.frames[name].columns for name in mechanism.bodies}
        points = [name for name, links in self.cut.held.items() if links and name not in self.cut.fixed]
        self.parts |= {("point", name): [self.places.columns[name]] for name in points}
        self.rows = {part: 6 * k for k, part in enumerate(self.parts)}
        v, a = (sp.symbols(f"{x}1:{len(self.places.q) + 1}", real=True) for x in "va")
        self.rates = dict(zip((*self.places.q, *v), (*v, *a), strict=True))
        pushes = [*self._ties(), *self._pulls(sp.Matrix(v)), *self._torques(v), *self._inertia()]
        self.acts = [self._act(*push) for push in pushes if push[1] in self.parts]
        self.arms = [self._vector(self.parts[port.part][0].now - port.about) for port in self.cut.ports]
        self.legs = {name: [self._vector(now) for _, now in self.places.frames[name].directions] for name in mechanism.bodies}
        self.call = sp.lambdify([self.places.q, v, a, time], self.vectors, "numpy", cse=True)

    def _vector(self, x: sp.Matrix) -> int:
        """Return the number of a vector that is evaluated at each state."""
        self.vectors.append([*x.subs(self.values), *[0] * (3 - len(x))])
        return len(self.vectors) - 1

    def _act(self, z: int | None, part: Part, k: int, force: sp.Matrix) -> tuple[int | None, int, int, int, int]:
        """Return the row, weight, arm and force of what acts on a column of a part, with the unknown z or without one."""
        column, first = self.parts[part][k], self.parts[part][0]
        return z, self.rows[part], column.weight, self._vector(column.now - column.weight * first.now), self._vector(force)

    def _ties(self) -> Iterator[Push]:
        """Yield the gradients dg/de of all equations."""
        for z, equation in enumerate(self.cut.equations):
            yield from ((z, part, k, -gradient) for (part, k), gradient in self._gradients(equation).items())

    def _gradients(self, f: sp.Expr) -> dict[tuple[Part, int], sp.Matrix]:
        """Return the gradients df/de, in q, by the part and its column: an angle has -g_e / g_theta by its equation g."""
        owners, measured = self.cut.owners, self.cut.angles.measured.values()
        together = {x: now for x, (*_, now) in owners.items()}
        turns = [(-f.diff(x.theta) / x.equation.diff(x.theta), x.equation) for x in measured if f.has(x.theta)]
        gradients: dict[tuple[Part, int], sp.Matrix] = {}
        for factor, term in [(sp.S.One, f), *turns]:
            for x in (x for x in owners if x in term.free_symbols):
                part, k, i, _ = owners[x]
                gradients.setdefault((part, k), sp.zeros(self.places.dimension, 1))[i] += (factor * term.diff(x)).xreplace(together)
        return gradients

    def _twice(self, x: sp.Matrix) -> sp.Matrix:
        """Return the second derivative by the time."""
        for _ in range(2):
            x = sum((x.diff(y) * self.rates[y] for y in self.rates if y in x.free_symbols), sp.zeros(*x.shape))
        return x

    def _torques(self, v: Sequence[sp.Symbol]) -> Iterator[Push]:
        """Yield the forces of springs, dampers, motors and rotors at angles."""
        angles, torques = self.cut.angles, [x for x in self.mechanism.forces if not isinstance(x, Spring | Damper)]
        thetas = {one.theta for one in angles.measured.values()}
        acted = [*(x.angle for x in torques), *(name for name, x in self.mechanism.angles.items() if exact(x.armature) != 0)]
        if others := [x for x in acted if x in angles.slopes or angles.given(x).free_symbols & {*self.places.q} - thetas]:
            raise BadInput(
                f"{others[0]} has no unknown of its own, and the reactions to what acts along it are not known; leave them out.",
                "reactions-without-unknown",
            )
        U = sp.Add(*(x.energy(angles.given(x.angle)) for x in torques if isinstance(x, RotationalSpring)))
        total = sp.Matrix(torque_force(torques, angles, v, self.values) or [0] * len(v)) - sp.Matrix([U]).jacobian(self.places.q).T
        for name, angle in self.mechanism.angles.items():
            turned = sp.Matrix([angles.given(name)])
            total -= exact(angle.armature) * turned.jacobian(self.places.q).T * self._twice(turned)
        for theta, torque in zip(self.places.q, total, strict=True):
            if torque != 0:
                yield from ((None, part, k, -torque * way) for (part, k), way in self._gradients(theta).items())

    def _pulls(self, v: sp.Matrix) -> Iterator[Push]:
        """Yield the forces of springs and dampers on their ends, stiffness (l - length) + damping l' along them."""
        places = self.places
        for force in (x for x in self.mechanism.forces if isinstance(x, Spring | Damper)):
            a, b = places.columns[force.first], places.columns[force.second]
            gap, length = b.now - a.now, length_along(force, places.columns, places.values)
            way = (gap / (sp.sqrt(gap.dot(gap)) if length is None else length)).applyfunc(sp.cancel)
            pull = exact(force.damping) * way.dot(gap.jacobian(places.q) * v) * way
            if isinstance(force, Spring):
                pull += exact(force.stiffness) * (gap - rest_length(force, places.columns) * way)
            yield from ((None, ("point", end), 0, sign * pull) for end, sign in ((force.first, -1), (force.second, 1)))

    def _inertia(self) -> Iterator[Push]:
        """Yield the rates of momentum of bodies less their weights, column by column."""
        places, pull = self.places, vector("gravity", self.mechanism.gravity or [0] * self.places.dimension)
        references = {x: column.reference for x, column in (places.declared | places.columns).items()}
        for name, body in self.mechanism.bodies.items():
            columns, C = places.frames[name].columns, by_columns(places.frames[name])
            J = moments(name, body, references, self.values)
            masses = sp.Matrix.hstack(*(self._twice(x.now) for x in columns)) * C * J * C.T - pull * (C * J[:, -1]).T
            yield from ((None, ("body", name), k, masses[:, k]) for k in range(len(columns)))

    def at(self, t: Array, q: Array, v: Array, a: Array) -> tuple[list[Load], float]:
        """Return the loads at some times and states, and the largest residual of an equation relative to the largest term."""
        rows = self.call(q.T, v.T, a.T, t)
        V = np.array([[np.broadcast_to(x, len(t)) for x in row] for row in rows], dtype=float).transpose(0, 2, 1)
        A = np.zeros((len(t), 6 * len(self.rows), len(self.cut.equations)))
        b = np.zeros(A.shape[:2])
        for z, row, weight, arm, force in self.acts:
            to = b if z is None else A[:, :, z]
            to[:, row : row + 3] += weight * V[force]
            to[:, row + 3 : row + 6] += np.cross(V[arm], V[force])
        x, free, residual = solved(A, b, self.size)
        turns = {name: self._turn(name, V[legs]) for name, legs in self.legs.items()} | {"": np.eye(3)}
        ports = zip(self.cut.ports, self.arms, strict=True)
        return [self._load(port, V[arm], A, turns[port.body], x, free) for port, arm in ports], residual

    def _load(self, port: Port, arm: Array, A: Array, turn: Array, z: Array, free: Array) -> Load:
        """Return the force and torque of a joint: R z, with NaN where R N is not 0."""
        row, unknowns = self.rows[port.part], list(port.equations)
        forces = A[:, row : row + 3, unknowns]
        torques = A[:, row + 3 : row + 6, unknowns] + np.cross(arm[:, :, None], forces, axis=1)
        torques[np.abs(torques) < RANK * self.size] = 0.0  # rounding, of forces at the joint's own point
        shown = {}
        for name, rows, unit, axes in (("force", forces, 1.0, [0, 1]), ("torque", torques, self.size, [2])):
            for where, seen in (("", rows), ("_in_body", turn.swapaxes(-1, -2) @ rows)):
                entries = np.einsum("tiz,tz->ti", seen, z[:, unknowns])
                entries[np.linalg.norm(seen @ free[:, unknowns], axis=2) > FREE * unit] = np.nan
                shown[name + where] = entries[:, axes] if self.places.dimension == 2 else entries
        return Load(port.joint, port.body or port.part[1], port.at, **shown)

    def _turn(self, body: str, now: Array) -> Array:
        """Return how a body is turned from the reference position, shape(n, 3, 3): a rod in space by the least angle."""
        directions = [was for was, _ in self.places.frames[body].directions]
        if not directions:
            return np.eye(3)
        was = np.pad(numbers(sp.Matrix.hstack(*directions), self.values).T, ((0, 0), (0, 3 - self.places.dimension)))
        lengths = np.linalg.norm(was, axis=1)[:, None]
        was, now = was / lengths, now / lengths[:, None]
        if len(was) == 1:
            # Half a turn about the first direction, and half a turn about the middle of both.
            return np.asarray(_half_turn(was + now[0]) @ _half_turn(was))
        left, _, right = np.linalg.svd(np.einsum("kti,kj->tij", now, was))
        left[:, :, 2] *= np.linalg.det(left @ right)[:, None]
        return np.asarray(left @ right)


def _half_turn(axes: Array) -> Array:
    return np.asarray(2 * np.einsum("ti,tj->tij", axes, axes) / np.sum(axes**2, axis=1)[:, None, None] - np.eye(3))


def solved(A: Array, b: Array, size: float) -> tuple[Array, Array, float]:
    """Return z of A z = b, directions that are free as columns, and the largest residual relative to the largest term.

    Torques are divided by the size of the mechanism, and columns of A by their lengths, so that ranks depend on no unit.
    """
    units = np.tile(np.repeat([1.0, 1 / size], 3), A.shape[1] // 6)
    A, b = units[:, None] * A, units * b
    lengths = np.linalg.norm(A, axis=1, keepdims=True)
    lengths[lengths == 0] = 1.0
    z, free = _by_elimination(A / lengths, b) or _by_rank(A / lengths, b)
    z, free = z / lengths[:, 0], free / lengths.swapaxes(1, 2)
    largest = max(np.abs(A * z[:, None, :]).max(initial=0.0), np.abs(b).max(initial=0.0)) or 1.0
    return z, free, float(np.abs(np.einsum("trz,tz->tr", A, z) - b).max(initial=0.0) / largest)


def _by_elimination(A: Array, b: Array) -> tuple[Array, Array] | None:
    """Return z where all of it is determined at all times, which takes a fifth of the time; None elsewhere."""
    if A.shape[1] < A.shape[2]:
        return None
    Q, R = np.linalg.qr(A)
    try:
        inverse = np.linalg.inv(R)
    except np.linalg.LinAlgError:
        return None
    if np.linalg.norm(inverse, axis=(1, 2)).max() > 1 / FREE:
        return None
    return np.einsum("tzk,trk,tr->tz", inverse, Q, b, optimize=True), np.zeros((*A.shape[::2], 0))


def _by_rank(A: Array, b: Array) -> tuple[Array, Array]:
    """Return the z of least norm, and the null vectors of A with 0 in place of other singular vectors."""
    left, sizes, right = np.linalg.svd(A)
    count = sizes.shape[1]
    positive = sizes > RANK * sizes[:, :1]
    along = np.divide(np.einsum("trk,tr->tk", left[:, :, :count], b), sizes, out=np.zeros_like(sizes), where=positive)
    z = np.einsum("tkz,tk->tz", right[:, :count], along)
    right[:, :count][positive] = 0.0
    return z, right.swapaxes(1, 2)


def reactions_of(mechanism: Mechanism, values: Values, t: Array, q: Array, v: Array, a: Array) -> tuple[list[Load], float]:
    """Return the loads in all joints, and the largest residual of an equation relative to the largest term in any.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    values : mapping of Symbol to float
        Values of its parameters.
    t : ndarray, shape(n,)
        Times, s.
    q, v, a : ndarray, shape(n, d)
        Unknowns of the mechanism that satisfy its joints, their velocities and accelerations.
    """
    balance = Balance(mechanism, values)
    pieces, residuals = zip(*(balance.at(*(x[k : k + AT_ONCE] for x in (t, q, v, a))) for k in range(0, len(t), AT_ONCE)), strict=True)
    arrays = [item.name for item in fields(Load)][3:]
    joined = [replace(same[0], **{x: np.concatenate([getattr(y, x) for y in same]) for x in arrays}) for same in zip(*pieces, strict=True)]
    return joined, max(residuals)
