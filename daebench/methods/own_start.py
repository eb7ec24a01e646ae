"""Where a problem starts that is given positions by name, velocities, or a start to be moved to the manifold."""

import re
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from daebench.diagnostics.consistency import projected
from daebench.diagnostics.inverse_mass import mass
from daebench.errors import BadInput, real, unknown
from daebench.runs.ivp import Array, ConstrainedIvp, Ivp
from daebench.runs.make_ivp import constrained, initial_values, require_constraints
from daebench.runs.own_start import PROJECT, OwnStart
from daebench.systems.lazily import sympy as sp

CLOSE = 1e-9
"""Part of the given numbers up to which equations for them are met."""

ITERATIONS = 50
"""Of Newton's method for momenta of a Hamiltonian that is not quadratic in them."""

SPIN = re.compile(r"spin\((.+)\)")


def started(ivp: Ivp, start: OwnStart) -> Ivp:
    """Return a problem at a start of one's own; whole vectors q0, p0 and y0 have replaced those of the case already."""
    q0, v0, project = start.get("q0"), start.get("v0"), start.get(PROJECT, False)
    if project:
        ivp = require_constraints(ivp, "which has no manifold to project onto; leave out project")
    if not (project or v0 is not None or isinstance(q0, Mapping)):
        return ivp
    placed = constrained(ivp, "which starts from y0; leave out q0 and v0")
    if isinstance(q0, Mapping):
        placed = placed.at(placed.p0, _placed(placed, q0))
    if v0 is not None:
        # Positions first: velocities are those at the place where the motion begins.
        placed = projected(placed)[0] if project else placed
        placed = placed.at(_momenta(placed, _velocities(placed, v0)), placed.q0)
    return projected(placed)[0] if project else placed


def _placed(ivp: ConstrainedIvp, given: Mapping[str, Any]) -> Array:
    """Return the positions of a mechanism with some of its points and directions at given places."""
    q, of = ivp.q0.copy(), [label.partition(" of ")[2] for label in ivp.coordinates]
    for name, values in given.items():
        (place,), (J,) = _along(ivp, q, [_expressions(ivp, "point", name, of)])
        where, columns = _vector(name, values, len(place)), [k for k, owner in enumerate(of) if owner == name]
        # A point on a guide has fewer unknowns than coordinates.
        J = J[:, columns]
        q[columns] = np.linalg.solve(J.T @ J, J.T @ (where - (place - J @ q[columns])))
        off = float(np.max(np.abs(place + J @ (q[columns] - ivp.q0[columns]) - where)))
        if off > CLOSE * (float(np.max(np.abs(where))) or 1.0):
            raise BadInput(
                f"{name} of {ivp.problem} is guided, and {where.tolist()} is {off:.3g} off its guide; choose a place on it.",
                "start-off-its-guide",
            )
    return q


def _velocities(ivp: ConstrainedIvp, given: Any) -> Array:
    """Return the velocities of a start: all numbers as they are, or those of some points and bodies with the least change of the others.

    ::

        (v - v_case)^T M (v - v_case) least,   G v = 0,   and the rows of what is given
    """
    if not isinstance(given, Mapping):
        v = initial_values("v0", given, ivp.facts)
        v[ivp.moving :] = 1.0
        return v
    now = ivp.value("H_p", ivp.p0, ivp.q0)
    rows = [ivp.value("G", ivp.q0), np.eye(ivp.d)[ivp.moving :]]
    right = [np.zeros(ivp.m), np.ones(ivp.d - ivp.moving)]
    for name, values in given.items():
        body = SPIN.fullmatch(name)
        for J, rate in _turning(ivp, body[1], name, values) if body else [_moving(ivp, name, values)]:
            rows.append(J)
            right.append(rate)
    A, b = np.concatenate(rows), np.concatenate(right)
    W = ivp.value("H_pp_and_time" if ivp.facts.EXTENDED else "H_pp", ivp.p0, ivp.q0)
    # Rows of length 1 in the metric of the kinetic energy: a residual then depends on no unit.
    size = np.sqrt(np.abs(np.einsum("ij,jk,ik->i", A, W, A)))
    A, b = (x / np.where(size > 0, size, 1.0) for x in (A.T, b))
    A = A.T
    v = now + W @ A.T @ np.linalg.lstsq(A @ W @ A.T, b - A @ now, rcond=CLOSE**2)[0]
    if not np.max(np.abs(A @ v - b)) <= CLOSE * np.max(np.abs(A) @ np.abs(v) + np.abs(b)):
        raise BadInput(
            f"the velocities {', '.join(given)} of {ivp.problem} contradict each other or the joints; give fewer, or others.",
            "given-velocities-contradict",
        )
    return np.asarray(v, dtype=float)


def _momenta(ivp: ConstrainedIvp, v: Array) -> Array:
    """Return the momenta p with H_p(p, q) = v: M v, and the magnetic part where there is one."""
    if ivp.arrays:
        raise BadInput(f"v0 is for vectors of few numbers, and {ivp.problem} has {ivp.d} positions in arrays; give p0.", "v0-of-arrays")
    p, q = np.zeros(ivp.d), ivp.q0
    for _ in range(1 if ivp.facts.QUADRATIC else ITERATIONS):
        p = p + mass(ivp, p, q) @ (v - ivp.value("H_p", p, q))
    if not np.max(np.abs(ivp.value("H_p", p, q) - v)) <= CLOSE * np.max(np.abs(v), initial=0.0):
        raise BadInput(f"no momenta of {ivp.problem} have these velocities v0; give p0.", "no-momenta-of-v0")
    return np.asarray(p, dtype=float)


def _moving(ivp: ConstrainedIvp, name: str, values: Any) -> tuple[Array, Array]:
    """Return the rows and the right sides of the velocity of a point or direction."""
    (place,), (J,) = _along(ivp, ivp.q0, [_expressions(ivp, "point", name, ())])
    return J, _vector(name, values, len(place))


def _turning(ivp: ConstrainedIvp, body: str, name: str, values: Any) -> list[tuple[Array, Array]]:
    """Return those of the angular velocity of a body: of its directions, each of which turns with it."""
    directions, rows = _along(ivp, ivp.q0, _expressions(ivp, "body", body, ()))
    plane = len(directions[0]) == 2
    omega = _vector(name, values, 1 if plane else 3)
    rates = [omega[0] * np.array([-x[1], x[0]]) if plane else np.cross(omega, x) for x in directions]
    return list(zip(rows, rates, strict=True))


def _expressions(ivp: ConstrainedIvp, kind: str, name: str, free: Iterable[str]) -> Any:
    """Return the place of a point or direction, or the directions of a body; ``free`` are names with own unknowns, if asked for."""
    parts = getattr(ivp.source.define(), "parts", None)
    if parts is None:
        raise BadInput(
            f"{ivp.problem} is not a mechanism with points by name; give numbers in the order of its positions, not {name}.",
            "start-by-name-of-no-points",
        )
    known = parts.places if kind == "point" else parts.turning
    free = dict.fromkeys(free)
    if free and name in known and name not in free:
        raise BadInput(f"{name} of {ivp.problem} depends on other points; place some of {', '.join(free)}.", "start-point-dependent")
    if name not in known:
        raise unknown(f"{kind} of {ivp.problem}", name, free or known)
    return known[name]


def _along(ivp: ConstrainedIvp, q: Array, expressions: Any) -> tuple[list[Array], list[Array]]:
    """Return vectors that are linear in the positions, and their derivatives by these, shape(k, d)."""
    declared: Any = ivp.source.define()
    at = {x: ivp.parameters[str(x)] for x in declared.parameters} | dict(zip(declared.q, q, strict=False))
    vectors = [sp.Matrix(x) for x in expressions]
    slopes = [np.array(x.jacobian(list(declared.q)).subs(at), dtype=float) for x in vectors]
    time = np.zeros((1, ivp.d - ivp.moving))
    return [np.array(x.subs(at), dtype=float).ravel() for x in vectors], [np.hstack([J, time.repeat(len(J), 0)]) for J in slopes]


def _vector(name: str, values: Any, length: int) -> Array:
    """Return given numbers of a point, a direction or a spin."""
    entries = list(values) if np.iterable(values) and not isinstance(values, str) else [values]
    if len(entries) != length:
        raise BadInput(f"{name} has {len(entries)} {'number' if len(entries) == 1 else 'numbers'}; give {length}.", "start-vector-length")
    return np.array([real(name, x) for x in entries])
