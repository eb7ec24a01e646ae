"""How mass is spread over a body: its moments of order 0, 1 and 2, and the mass matrix that follows from them.

::

    J = integral of (x, 1) (x, 1)^T dm = (E + mass c c^T, mass c; mass c^T, mass)      E: Euler tensor about the centre c
    T = 1/2 sum_kl (B^+ J B^+^T)_kl e_k' . e_l'      B: homogeneous references of the frame's columns

The mass matrix is constant, and it is positive definite where the body has a moment along each of its directions. In space the tensor of
inertia I gives E = tr(I)/2 - I; in the plane only tr(E), the polar moment, plays a part. A body that has a point in common with
the ground needs moments about that point alone: a flat disk on an axle of some length has them all.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import sympy as sp

from daebench.errors import InvalidProblem
from daebench.joints.bodies import AnyBody, Body, PointMass
from daebench.joints.exact import CLOSE, Array, Values, exact, number, numbers, simplified, vector
from daebench.joints.frames import Column, Frame, independent_rows

Terms = dict[tuple[int, int], sp.Expr]
"""Entries of a matrix that are not 0, by row and column."""

Square = tuple[sp.Expr, sp.Expr]
"""A moment of inertia and an expression f of the unknowns: the kinetic energy inertia/2 (df/dt)^2."""


def moments(name: str, body: AnyBody, corners: dict[str, sp.Matrix], values: Values) -> sp.Matrix:
    """Return J of a body at the reference position, shape(3, 3) in the plane and shape(4, 4) in space.

    ``corners`` has the places of named points.
    """
    mass = exact(body.mass)
    if not number(mass, values) > 0:
        raise InvalidProblem(f"{name} has mass {mass}; give it a positive one, or replace it by a Distance.", "mass-not-positive")
    if isinstance(body, Body):
        return _of_body(name, body, mass, corners, values)
    count = 1 if isinstance(body, PointMass) else body.corners
    V = sp.Matrix.hstack(*(sp.Matrix([*corners[corner], 1]) for corner in body.names[:count]))
    # Moments of a uniform simplex: one formula for a point, a rod and a triangle.
    return mass / (count * (count + 1)) * V * (sp.eye(count) + sp.ones(count, count)) * V.T


def spread_about_centre(J: sp.Matrix) -> sp.Expr:
    """Return tr(E), in the plane the moment of inertia about the centre, in space 3/2 of the mean one."""
    return simplified(J[:-1, :-1].trace() - J[:-1, -1].dot(J[:-1, -1]) / J[-1, -1])


def spread_about(J: sp.Matrix, place: sp.Matrix) -> sp.Expr:
    """Return tr(E) about a place."""
    return simplified(spread_about_centre(J) + J[-1, -1] * sum(x**2 for x in J[:-1, -1] / J[-1, -1] - place))


def square_terms(squares: Sequence[Square], index: Mapping[sp.Symbol, int]) -> Terms:
    """Return the entries that kinetic energies inertia/2 (df/dt)^2 add to M."""
    terms: Terms = {}
    for inertia, f in squares:
        slopes = {index[x]: f.diff(x) for x in f.free_symbols if x in index}
        for i, one in slopes.items():
            for j, other in slopes.items():
                terms[i, j] = terms.get((i, j), sp.S.Zero) + inertia * one * other
    return terms


def _of_body(name: str, body: Body, mass: sp.Expr, corners: dict[str, sp.Matrix], values: Values) -> sp.Matrix:
    centre = corners[body.centre] if isinstance(body.centre, str) else vector(f"centre of {name}", body.centre)
    E = euler_tensor(name, body.inertia, len(centre))
    _require_real(name, E, values)
    return sp.Matrix(sp.BlockMatrix([[E + mass * centre * centre.T, mass * centre], [mass * centre.T, sp.Matrix([[mass]])]]))


def euler_tensor(name: str, inertia: Any, dimension: int) -> sp.Matrix:
    """Return E, the integral of x x^T over the mass about the centre, of moments of inertia about it."""
    if dimension == 2:
        if hasattr(inertia, "__len__") and not isinstance(inertia, str):
            raise InvalidProblem(
                f"inertia of {name} is {inertia!r}; in the plane it is one moment about the centre.", "inertia-malformed-in-plane"
            )
        return exact(inertia) / 2 * sp.eye(2)
    entries = list(inertia) if hasattr(inertia, "__len__") and not isinstance(inertia, str) else []
    rows = [list(row) for row in entries if hasattr(row, "__len__") and not isinstance(row, str)]
    if len(rows) == 3 and all(len(row) == 3 for row in rows):
        tensor = sp.Matrix(3, 3, [exact(x) for row in rows for x in row])
    else:
        tensor = sp.diag(*map(exact, entries)) if not rows else sp.zeros(0, 0)
    if tensor.shape != (3, 3) or tensor != tensor.T:
        raise InvalidProblem(
            f"inertia of {name} is {inertia!r}; give the three moments about the axes, or a symmetric tensor, 3 by 3.",
            "inertia-malformed-in-space",
        )
    return tensor.trace() / 2 * sp.eye(3) - tensor


def _require_real(name: str, E: sp.Matrix, values: Values) -> None:
    """Refuse a tensor that no mass has: one that is negative in some direction."""
    least, largest, along = _least_moment(E, values)
    if least < -CLOSE * abs(largest):
        what = "is negative" if len(along) == 2 else f"along {_written(along)}, half of I2 + I3 - I1, is {least:.3g}"
        raise InvalidProblem(
            f"no body has the inertia of {name}: the moment of its mass {what}; check its moments of inertia.", "inertia-impossible"
        )


def require_moments(name: str, body: Body, values: Values) -> None:
    """Refuse a body that lacks a moment of its mass about its centre."""
    plane = not hasattr(body.inertia, "__len__") or isinstance(body.inertia, str)
    least, largest, along = _least_moment(euler_tensor(name, body.inertia, 2 if plane else 3), values)
    if least > CLOSE * abs(largest):
        return
    if plane:
        raise InvalidProblem(
            f"the moment of inertia of {name} is 0; give it a positive one, or make it a PointMass.", "body-without-inertia"
        )
    raise InvalidProblem(
        f"the Euler tensor of {name} is singular: the moment of its mass along {_written(along)}, half of I2 + I3 - I1, is 0; give it "
        "some width there, or make it a Rod of two points or a Plate of three.",
        "body-without-width",
    )


def _least_moment(E: sp.Matrix, values: Values) -> tuple[float, float, Array]:
    """Return the least and the largest eigenvalue of a tensor, and the direction of the least."""
    sizes, directions = np.linalg.eigh(numbers(E, values))
    along = directions[:, 0]
    # The sign of an eigenvector is arbitrary: with its largest entry positive, messages do not differ between machines.
    return float(sizes[0]), float(sizes[-1]), along * np.sign(along[np.abs(along).argmax()])


def _written(along: Array) -> str:
    return f"({', '.join(f'{x:.3g}' for x in along + 0.0)})"  # + 0.0 turns -0 into 0


def mass_terms(name: str, J: sp.Matrix, frame: Frame, index: Mapping[sp.Symbol, int]) -> Terms:
    """Return the entries that a body adds to M, by row and column."""
    C = by_columns(frame)
    spread = (C * J * C.T).applyfunc(sp.cancel)
    unit = np.append(np.full(frame.basis.rows - 1, 1 / frame.size), 1.0)
    # In units of the body's size: moments of order 0, 1 and 2 cannot be compared otherwise.
    lost = unit[:, None] * numbers(frame.basis * spread * frame.basis.T - J, frame.values) * unit
    if np.abs(lost).max() > CLOSE * np.abs(unit[:, None] * numbers(J, frame.values) * unit).max():
        raise InvalidProblem(f"{name} has mass away from its points; give it more points or directions.", "mass-away-from-points")
    return _assembled(spread, frame.columns, index)


def by_columns(frame: Frame) -> sp.Matrix:
    """Return B^+, by which a place (x, 1) at the reference position is a combination of the frame's columns."""
    rows = independent_rows(frame.basis, frame.values)
    C = sp.zeros(len(frame.columns), frame.basis.rows)
    inverse = frame.basis.extract(rows, list(range(len(frame.columns)))).inv()
    for k, row in enumerate(rows):
        C[:, row] = inverse[:, k]
    return C


def _assembled(spread: sp.Matrix, columns: tuple[Column, ...], index: Mapping[sp.Symbol, int]) -> Terms:
    """Return the entries of sum_kl spread_kl (de_k/dq)^T (de_l/dq)."""
    used = sorted({x for column in columns for x in column.now.free_symbols if x in index}, key=lambda x: index[x])
    if not used:
        return {}
    parts = [column.now.jacobian(used) for column in columns]
    M = sp.zeros(len(used), len(used))
    for k, left in enumerate(parts):
        for j, right in enumerate(parts):
            if spread[k, j] != 0:
                M += spread[k, j] * left.T * right
    entries = {(index[x], index[y]): sp.cancel(M[i, j]) for i, x in enumerate(used) for j, y in enumerate(used)}
    return {place: entry for place, entry in entries.items() if entry != 0}
