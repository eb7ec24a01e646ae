"""The projection of the steps of an ODE solver: onto g = 0, then onto G H_p = 0, with the projection of an error estimate.

::

    q1 = q + dq,     g(q1) = 0,                dq^T M dq least,        M = M(q)
    v1 = v + dv,     G(q1) v1 = 0,             dv^T M dv least,        M = M(q1)

with p = M v: where the problem is given by H(p, q) the unknowns are momenta, and dp^T M^-1 dp is least. Errors are projected onto the
tangents of both conditions at q1, those of positions and of velocities apart.
"""

from daebench.schemes.kernels.constrain import momentum_correction
from daebench.schemes.kernels.language import EXTENDED, G, dot, g, norm, rate_of_time, rows, solve
from daebench.schemes.kernels.newton import both, linear, newton
from daebench.schemes.kernels.spaces import LENGTH, Jacobian, Report, Rows, Update, Vector

Projected = tuple[Vector, Vector, Vector, Vector, Report]


def update_nearest(dq: Vector, data: tuple[Vector, Vector]) -> Update:
    """One update of the increment to the position of g = 0 that is nearest in the metric of M at the free one.

    The condition is linearised at q + dq, and the shortest increment that meets it is taken: its direction converges to the normal
    at the end.
    """
    p, q0 = data
    q = q0 + dq
    value, G1 = g(q), G(q)
    normals = rows(G1, p, q0)
    nu, pivot = solve(G1 @ normals.T, G1 @ dq - value)
    nearer = normals.T @ nu
    return nearer, norm(nearer - dq), max(LENGTH, norm(q)), norm(value), pivot


def nearest(p: Vector, q: Vector) -> tuple[Vector, Report]:
    """Return the increment dq to the nearest position, and a report."""
    return newton(update_nearest, 0 * q, (p, q))


if EXTENDED:

    def full(v: Vector, q: Vector) -> Vector:
        """Return the velocity (v, 1) of the unknowns (v, p_t)."""
        e = rate_of_time(q)
        return v + (1 - dot(e, v)) * e

    def at_rest(v: Vector, q: Vector) -> Vector:
        """Return the change (v, 0) of a velocity, given that of the unknowns (v, p_t)."""
        e = rate_of_time(q)
        return v - dot(e, v) * e

else:

    def full(v: Vector, q: Vector) -> Vector:
        """Return the velocity: the unknown itself."""
        return v

    def at_rest(v: Vector, q: Vector) -> Vector:
        """Return the change of the velocity: that of the unknown itself."""
        return v


def tangent(x: Vector, G1: Jacobian, normals: Rows) -> tuple[Vector, Report]:
    """Return the shortest change, in the metric of M, that makes x tangent, G x = 0; and a report."""
    value = G1 @ x
    nu, pivot = solve(G1 @ normals.T, value)
    return -(normals.T @ nu), linear(pivot, norm(value))


def of_velocities(v: Vector, q: Vector, error_v: Vector, error_q: Vector) -> Projected:
    """Return dv, dq, the projected errors of v and q, and a report."""
    dq, report = nearest(v, q)
    q1 = q + dq
    G1, normals = G(q1), rows(G(q1), v, q1)
    dv, settled = tangent(full(v, q1), G1, normals)
    off_v, _ = tangent(at_rest(error_v, q1), G1, normals)
    off_q, _ = tangent(error_q, G1, normals)
    return dv, dq, error_v + off_v, error_q + off_q, both(report, settled)


def of_momenta(p: Vector, q: Vector, error_p: Vector, error_q: Vector) -> Projected:
    """Return dp, dq, the projected errors of p and q, and a report."""
    dq, report = nearest(p, q)
    q1 = q + dq
    n, _, settled = momentum_correction(p, q1)
    G1, normals = G(q1), rows(G(q1), p - n, q1)
    mu, _ = solve(G1 @ normals.T, normals @ error_p)
    off_q, _ = tangent(error_q, G1, normals)
    return -n, dq, error_p - G1.T @ mu, error_q + off_q, both(report, settled)
