"""Forces and torques in the joints of a mechanism: the Newton-Euler equations of its bodies, solved for what joints can transmit.

::

    A z = b       a body:   forces and torques of its joints      = rates of momentum and angular momentum - those of its weight,
                                                                    and of springs, dampers, motors and rotors at its angles
                  a shared point:   forces of its joints          = - those of springs and dampers

Stresses within bodies do not enter. Redundant joints leave directions N of z free, A N = 0: a component R z of a force or torque is
determined by rigid bodies if R N = 0, and NaN otherwise; no solution of least norm stands in its place.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
import sympy as sp

from daebench.joints.cut import Cut, Part, Port
from daebench.joints.drivers import t as time
from daebench.joints.exact import Array, Values, exact, numbers, vector
from daebench.joints.forces import Damper, Force, Spring, length_along, rest_length
from daebench.joints.frames import Column
from daebench.joints.inertia import by_columns, moments
from daebench.joints.mechanism import Mechanism
from daebench.joints.placing import Places
from daebench.joints.torques import RotationalSpring, torque_force

RANK = 1e-9
"""Part of the largest singular value below which one is 0."""

FREE = 1e-6
"""Change of a force by a free direction below which it is determined; of a torque, times the size of the mechanism."""

AT_ONCE = 256
"""Number of times that are solved together."""


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
        self.cut = cut = Cut(mechanism)
        places = cut.places
        self.size = max(places.frames[name].size for name in mechanism.bodies)
        parts: dict[Part, Sequence[Column]] = {("body", name): places.frames[name].columns for name in mechanism.bodies}
        parts |= {("point", name): [places.columns[name]] for name, links in cut.held.items() if links and name not in cut.fixed}
        self.rows = {part: 6 * k for k, part in enumerate(parts)}
        self.columns = [(part, x) for part, columns in parts.items() for x in columns]
        self.first = {part: next(n for n, (owner, _) in enumerate(self.columns) if owner == part) for part in parts}
        self.inertia = {name: _inertia(name, mechanism, places, values) for name in mechanism.bodies}
        self.gravity = numbers(_in_space(vector("gravity", mechanism.gravity or [0] * places.dimension)), values).ravel()
        self.reference = numbers(sp.Matrix.hstack(*(_in_space(x.reference) for _, x in self.columns)), values).T
        v, a = (sp.symbols(f"{x}1:{len(places.q) + 1}", real=True) for x in "va")
        rates = dict(zip((*places.q, *v), (*v, *a), strict=True))
        gradients = {(z, *x): way for z, equation in enumerate(cut.equations) for x, way in _gradient(cut, equation).items()}
        between = [force for force in mechanism.forces if isinstance(force, Spring | Damper)]
        pulls = [(("point", end), 0, way) for force in between for end, way in _pull(force, places, v)]
        pulls += [(*x, tau * way) for theta, tau in _torques(cut, v, rates) for x, way in _gradient(cut, theta).items()]
        self.acted = [*gradients, *((None, part, k) for part, k, _ in pulls)]
        places_now = [x.now for _, x in self.columns]
        twice = [_rate(_rate(x, rates), rates) for x in places_now]
        vectors = [*places_now, *twice, *gradients.values(), *(x for *_, x in pulls)]
        flat = [list(_in_space(x).subs(values)) for x in (*vectors, *(port.about for port in cut.ports))]
        self.call = sp.lambdify([places.q, v, a, time], flat, "numpy", cse=True)

    def at(self, t: Array, q: Array, v: Array, a: Array) -> tuple[list[Load], float]:
        """Return the loads at some times and states, and the largest residual of an equation relative to the largest term."""
        values = [[np.broadcast_to(x, len(t)) for x in row] for row in self.call(q.T, v.T, a.T, t)]
        ends = np.cumsum([len(self.columns), len(self.columns), len(self.acted)])
        e, rates, forces, about = np.split(np.array(values, dtype=float).transpose(0, 2, 1), ends)
        A = np.zeros((len(t), 6 * len(self.rows), len(self.cut.equations)))
        b = np.zeros(A.shape[:2])
        for (z, part, k), force in zip(self.acted, forces, strict=True):
            self._act(b if z is None else A[:, :, z], e, part, k, -force)
        for name, (mass, moment) in self.inertia.items():
            n = self.first["body", name]
            pull = np.einsum("kl,lti->kti", mass, rates[n : n + len(mass)]) - moment[:, None, None] * self.gravity
            for k, force in enumerate(pull):
                self._act(b, e, ("body", name), k, force)
        x, free, residual = solved(A, b, self.size)
        return [self._load(port, place, A, e, x, free) for port, place in zip(self.cut.ports, about, strict=True)], residual

    def _act(self, to: Array, e: Array, part: Part, k: int, force: Array) -> None:
        """Add a force on a column of a part, where that moves, to forces and torques about its first column."""
        if part in self.rows:
            row, n = self.rows[part], self.first[part]
            weight = self.columns[n + k][1].weight
            to[:, row : row + 3] += weight * force
            to[:, row + 3 : row + 6] += np.cross(e[n + k] - weight * e[n], force)

    def _load(self, port: Port, about: Array, A: Array, e: Array, z: Array, free: Array) -> Load:
        """Return the force and torque of a joint: R z, with NaN where R N is not 0."""
        row, unknowns, n = self.rows[port.part], list(port.equations), self.first[port.part]
        forces = A[:, row : row + 3, unknowns]
        torques = A[:, row + 3 : row + 6, unknowns] + np.cross((e[n] - about)[:, :, None], forces, axis=1)
        torques[np.abs(torques) < RANK * self.size] = 0.0  # rounding, of forces at the joint's own point
        turn = self._turn(port.body, e) if port.body else np.broadcast_to(np.eye(3), (len(z), 3, 3))
        shown = {}
        for name, rows, unit, axes in (("force", forces, 1.0, [0, 1]), ("torque", torques, self.size, [2])):
            for where, seen in (("", rows), ("_in_body", turn.swapaxes(1, 2) @ rows)):
                entries = np.einsum("tiz,tz->ti", seen, z[:, unknowns])
                entries[np.linalg.norm(seen @ free[:, unknowns], axis=2) > FREE * unit] = np.nan
                shown[name + where] = entries[:, axes] if self.cut.places.dimension == 2 else entries
        return Load(port.joint, port.body or port.part[1], port.at, **shown)

    def _turn(self, body: str, e: Array) -> Array:
        """Return how a body is turned from the reference position, shape(n, 3, 3): a rod in space by the least angle."""
        n, count = self.first["body", body], len(self.inertia[body][0])
        weights = np.array([x.weight for _, x in self.columns[n : n + count]])[1:, None]
        was, now = self.reference[n + 1 : n + count] - weights * self.reference[n], e[n + 1 : n + count] - weights[:, :, None] * e[n]
        lengths = np.linalg.norm(was, axis=1)[:, None]
        was, now = was / lengths, now.swapaxes(0, 1) / lengths
        if count == 1:
            return np.broadcast_to(np.eye(3), (e.shape[1], 3, 3))
        if count == 2:
            # Half a turn about the first direction, and half a turn about the middle of both.
            middle = was[0] + now[:, 0]
            return _half_turn(middle) @ _half_turn(was)
        left, _, right = np.linalg.svd(np.einsum("tki,kj->tij", now, was))
        left[:, :, 2] *= np.linalg.det(left @ right)[:, None]
        return np.asarray(left @ right)


def _half_turn(axes: Array) -> Array:
    return np.asarray(2 * np.einsum("ti,tj->tij", axes, axes) / np.sum(axes**2, axis=1)[:, None, None] - np.eye(3))


def solved(A: Array, b: Array, size: float) -> tuple[Array, Array, float]:
    """Return z of A z = b, the free directions as columns with 0 in place of all others, and the largest relative residual.

    Torques are divided by the size of the mechanism, and columns of A by their lengths, so that ranks depend on no unit.
    """
    units = np.tile([1.0, 1.0, 1.0, 1 / size, 1 / size, 1 / size], A.shape[1] // 6)
    A, b = units[:, None] * A, units * b
    lengths = np.linalg.norm(A, axis=1, keepdims=True)
    left, sizes, right = np.linalg.svd(A / np.where(lengths > 0, lengths, 1.0))
    count = sizes.shape[1]
    positive = sizes > RANK * sizes[:, :1]
    along = np.divide(np.einsum("trk,tr->tk", left[:, :, :count], b), sizes, out=np.zeros_like(sizes), where=positive)
    right = right / np.where(lengths > 0, lengths, 1.0)
    z = np.einsum("tkz,tk->tz", right[:, :count], along)
    right[:, :count][positive] = 0.0
    largest = max(np.abs(A * z[:, None, :]).max(initial=0.0), np.abs(b).max(initial=0.0)) or 1.0
    return z, right.swapaxes(1, 2), float(np.abs(np.einsum("trz,tz->tr", A, z) - b).max(initial=0.0) / largest)


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


def _in_space(x: sp.Matrix) -> sp.Matrix:
    return sp.Matrix([*x, *[0] * (3 - len(x))])


def _inertia(name: str, mechanism: Mechanism, places: Places, values: Values) -> tuple[Array, Array]:
    """Return the mass matrix of a body by columns of its frame, shape(k, k), and its moments of order 1, by which gravity acts on them."""
    references = {x: column.reference for x, column in (places.declared | places.columns).items()}
    J, C = moments(name, mechanism.bodies[name], references, values), by_columns(places.frames[name])
    return numbers(C * J * C.T, values), numbers(C * J[:, -1], values).ravel()


def _gradient(cut: Cut, f: sp.Expr) -> dict[tuple[Part, int], sp.Matrix]:
    """Return the gradients df/de, in q, by the part and its column: an angle has -g_e / g_theta by its equation g."""
    together = {x: now for x, (*_, now) in cut.owners.items()}
    terms = [(sp.S.One, f)]
    terms += [(-f.diff(x.theta) / x.equation.diff(x.theta), x.equation) for x in cut.angles.measured.values() if f.has(x.theta)]
    gradients: dict[tuple[Part, int], sp.Matrix] = {}
    for factor, term in terms:
        for x in cut.owners.keys() & term.free_symbols:
            part, k, i, _ = cut.owners[x]
            gradients.setdefault((part, k), sp.zeros(3, 1))[i] += (factor * term.diff(x)).xreplace(together)
    return gradients


def _rate(x: sp.Matrix, rates: dict[sp.Symbol, sp.Symbol]) -> sp.Matrix:
    """Return the derivative of a matrix by the time."""
    return sum((x.diff(y) * rates[y] for y in x.free_symbols & rates.keys()), sp.zeros(*x.shape))


def _torques(cut: Cut, v: Sequence[sp.Symbol], rates: dict[sp.Symbol, sp.Symbol]) -> list[tuple[sp.Symbol, sp.Expr]]:
    """Return the torques of springs, dampers, motors and rotors at each unknown angle."""
    angles, mechanism = cut.angles, cut.mechanism
    torques = [x for x in mechanism.forces if not isinstance(x, Spring | Damper)]
    U = sp.Add(*(x.energy(angles.given(x.angle)) for x in torques if isinstance(x, RotationalSpring)))
    others = torque_force(torques, angles, v, angles.places.values) or [sp.S.Zero] * len(v)
    rotors = [(exact(x.armature), sp.Matrix([angles.given(name)])) for name, x in mechanism.angles.items()]
    return [
        (x, tau - U.diff(x) - sum(inertia * _rate(_rate(angle, rates), rates)[0] * angle.diff(x)[0] for inertia, angle in rotors))
        for x, tau in zip(angles.places.q, others, strict=True)
        if x in {one.theta for one in angles.measured.values()}
    ]


def _pull(force: Force, places: Places, v: Sequence[sp.Symbol]) -> list[tuple[str, sp.Matrix]]:
    """Return the forces of a spring or damper on the points at its ends: -(stiffness (l - length) + damping l') along it."""
    a, b = places.columns[force.first], places.columns[force.second]
    gap, length = b.now - a.now, length_along(force, places.columns, places.values)
    way = (gap / (sp.sqrt(gap.dot(gap)) if length is None else length)).applyfunc(sp.cancel)
    rate, pull = way.dot(gap.jacobian(places.q) * sp.Matrix(v)), sp.zeros(places.dimension, 1)
    if isinstance(force, Spring):
        pull = exact(force.stiffness) * (gap - rest_length(force, places.columns) * way)
    pull += exact(force.damping) * rate * way
    return [(force.first, pull), (force.second, -pull)]
