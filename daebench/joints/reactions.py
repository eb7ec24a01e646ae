"""Forces and torques in the joints of a mechanism, by the balance of its bodies.

Where joints are redundant, directions N of the unknowns z change no balance, A N = 0. A component R z of a force or torque is determined by
rigid bodies if R N = 0; it is NaN otherwise, and no least-squares solution stands in its place.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from daebench.joints.balance import Balance, Port
from daebench.joints.cut import Cut, FreeBody
from daebench.joints.exact import Array

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
    free : str
        Directions in which rigid bodies do not determine it, in words, at the first time that there are any; "" if there are none.
    """

    joint: str
    on: str
    at: str
    force: Array
    torque: Array
    force_in_body: Array
    torque_in_body: Array
    free: str = ""


def reactions_of(cut: Cut, t: Array, q: Array, v: Array, a: Array) -> tuple[list[Load], float]:
    """Return the loads in all joints, and the largest residual of an equation relative to the largest term in any.

    Parameters
    ----------
    cut : Cut
        The mechanism.
    t : ndarray, shape(n,)
        Times, s.
    q, v, a : ndarray, shape(n, d)
        Unknowns of the mechanism that satisfy its joints, their velocities and accelerations.
    """
    pieces, residuals = [], []
    for k in range(0, len(t), AT_ONCE):
        loads, residual = _at_once(cut, *(x[k : k + AT_ONCE] for x in (t, q, v, a)))
        pieces.append(loads)
        residuals.append(residual)
    return [_joined(list(piece)) for piece in zip(*pieces, strict=True)], max(residuals)


def _joined(pieces: list[Load]) -> Load:
    names = ("force", "torque", "force_in_body", "torque_in_body")
    arrays = {name: np.concatenate([getattr(piece, name) for piece in pieces]) for name in names}
    first = pieces[0]
    return Load(first.joint, first.on, first.at, **arrays, free=next((piece.free for piece in pieces if piece.free), ""))


def _at_once(cut: Cut, t: Array, q: Array, v: Array, a: Array) -> tuple[list[Load], float]:
    balance = Balance(cut, t, q, v, a)
    z, free, residual = solved(balance)
    turned = {name: rotation(body, balance.places[name]) for name, body in cut.bodies.items()}
    return [_load(balance, port, z, free, turned) for port in balance.ports()], residual


def solved(balance: Balance) -> tuple[Array, Array, float]:
    """Return z, shape(n, unknowns), the free directions, shape(n, unknowns, unknowns), 0 in place of others, and the relative residual.

    Torques are divided by the size of the mechanism, and columns of A by their lengths, so that ranks depend on no unit. A free direction
    changes forces by about 1.
    """
    units = np.ones(balance.A.shape[1])
    units[: 6 * len(balance.cut.bodies)].reshape(-1, 6)[:, 3:] = 1 / balance.cut.size
    A, b = units[:, None] * balance.A, units * balance.b
    lengths = np.linalg.norm(A, axis=1, keepdims=True)
    lengths[lengths == 0] = 1.0
    left, sizes, right = np.linalg.svd(A / lengths, full_matrices=True)
    count = sizes.shape[1]
    positive = sizes > RANK * sizes[:, :1]
    inverse = np.divide(1.0, sizes, out=np.zeros_like(sizes), where=positive)
    x = np.einsum("tkz,tk->tz", right[:, :count], inverse * np.einsum("trk,tr->tk", left[:, :, :count], b))
    determined = np.pad(positive, ((0, 0), (0, right.shape[1] - count)))
    free = np.swapaxes(np.where(determined[:, :, None], 0.0, right) / lengths, 1, 2)
    z = x / lengths[:, 0]
    largest = max(float(np.abs(A * z[:, None, :]).max(initial=0.0)), float(np.abs(b).max(initial=0.0)))
    residual = float(np.abs(np.einsum("trz,tz->tr", A, z) - b).max(initial=0.0))
    return z, free, residual / largest if largest else 0.0


def _load(balance: Balance, port: Port, z: Array, free: Array, turned: Mapping[str, Array]) -> Load:
    """Return the force and torque of a joint: R z, with NaN where R N is not 0."""
    unknowns, cut = list(port.unknowns), balance.cut
    kind, name = port.part
    row = balance.rows[port.part]
    forces = balance.A[:, row : row + 3, unknowns]
    torques = np.zeros_like(forces)
    if kind == "body":
        arm = (balance.places[name][:, 0] - port.about)[:, :, None]
        torques = balance.A[:, row + 3 : row + 6, unknowns] + np.cross(arm, forces, axis=1)
        body = name
    else:
        holders = [*cut.nodes[name].holders]
        body = holders[0] if len(holders) == 1 else ""
    torques[np.abs(torques) < RANK * cut.size] = 0.0  # what a force at the joint's own point leaves of its torque is rounding
    R = turned[body] if body else np.broadcast_to(np.eye(3), (len(z), 3, 3))
    x, N = z[:, unknowns], free[:, unknowns]
    shown, words = {}, []
    for quantity, rows, unit, axes in (("force", forces, 1.0, slice(0, 2)), ("torque", torques, cut.size, slice(2, 3))):
        bound = FREE * unit
        for where, turn in (("", None), ("_in_body", R)):
            seen = rows if turn is None else np.swapaxes(turn, 1, 2) @ rows
            entries = np.einsum("tiz,tz->ti", seen, x)
            entries[np.linalg.norm(seen @ N, axis=2) > bound] = np.nan
            shown[quantity + where] = entries[:, axes] if cut.dimension == 2 else entries
        words += _free_words(quantity, rows @ N, bound, cut.dimension)
    return Load(port.joint, body or name, port.at, **shown, free="; ".join(words))


def _free_words(quantity: str, RN: Array, bound: float, dimension: int) -> list[str]:
    """Return the directions in which a quantity is free, in words, at the first time that there are any; none if there are none."""
    loose = np.flatnonzero(np.linalg.norm(RN, axis=(1, 2)) > bound)
    if not len(loose):
        return []
    directions, sizes, _ = np.linalg.svd(RN[loose[0]])
    count = int(np.sum(sizes > bound))
    if count == 3 or (dimension == 2 and (count == 2 or quantity == "torque")):
        return [quantity]
    way, name = (directions[:, 0], "along") if count == 1 else (directions[:, 2], "across")
    way = way * np.sign(way[np.abs(way).argmax()]) + 0.0
    return [f"{quantity} {name} ({', '.join(f'{x:.3g}' for x in way[:dimension])})"]


def rotation(body: FreeBody, places: Array) -> Array:
    """Return how a body is turned from its reference position, shape(n, 3, 3); by the least angle where it is a line, as a rod in space."""
    was = (body.reference - body.weights[:, None] * body.reference[0])[1:]
    now = (places - body.weights[:, None] * places[:, :1])[:, 1:]
    lengths = np.linalg.norm(was, axis=1, keepdims=True)
    was, now = was / lengths, now / lengths
    if not len(was):
        return np.broadcast_to(np.eye(3), (len(places), 3, 3))
    if len(was) == 1:
        return _least_turn(was[0], now[:, 0] / np.linalg.norm(now[:, 0], axis=1, keepdims=True))
    left, _, right = np.linalg.svd(np.einsum("tki,kj->tij", now, was))
    left[:, :, 2] *= np.linalg.det(left @ right)[:, None]
    turned: Array = left @ right
    return turned


def _least_turn(was: Array, now: Array) -> Array:
    """Return the rotation of least angle from one unit vector to others, shape(n, 3): half a turn about any axis to an opposite one."""
    axis, cosine = np.cross(was, now), now @ was
    hat = np.cross(np.eye(3), axis[:, None, :]).swapaxes(1, 2) * -1.0
    across = np.cross(was, np.eye(3)[np.abs(was).argmin()])
    half = 2 * np.outer(across, across) / (across @ across) - np.eye(3)
    opposite = cosine < RANK - 1
    turned = np.eye(3) + hat + hat @ hat / np.where(opposite, 1.0, 1 + cosine)[:, None, None]
    return np.where(opposite[:, None, None], half, turned)
