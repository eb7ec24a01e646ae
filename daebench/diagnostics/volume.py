"""The contraction of volume on the manifold by forces without potential: that of the motion, and that of a map.

On the manifold of n degrees of freedom the volume is (dq ^ dp)^n / n!, which Hamiltonian motion keeps (Liouville). Forces F(q, v, t) change
it at the rate of their divergence there, whatever their part that does not depend on v is::

    (log volume)' = tr( (S^T H_pp S)^-1 S^T H_pp F_p S )        the columns of S span the p with G H_pp p = 0

With H = 1/2 p^T M^-1 p + U and F = -C v that is -tr( (T^T M T)^-1 T^T C T ), where T spans the directions that G leaves free: -n c where
C = c M, and another number in each position in general. For one time the vectors leave t and p_t as they are.
"""

import numpy as np
from numpy.typing import ArrayLike

from daebench.diagnostics.nearby import field
from daebench.diagnostics.unit_rows import across
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.systems.lazily import scipy

TOLERANCE = 1e-12
"""Tolerance of SciPy's DOP853 for the motion and the divergence along it."""

State = tuple[Array, ...]


def divergence(ivp: ConstrainedIvp, p: Array, q: Array) -> float:
    """Return the rate of change of log volume at a point of the manifold of a system in time, 1/s."""
    state, d = (tuple(p), tuple(q)), ivp.d - 1
    H_pp = ivp.value("H_pp", *state)[:d, :d]
    # H_qp of the problem has the forces in it, H_pq has not: their difference is the derivative of the forces alone.
    F_p = (ivp.value("H_pq", *state).T - ivp.value("H_qp", *state))[:d, :d]
    S = across(ivp.value("G", state[1])[:, :d] @ H_pp).T
    return float(np.trace(np.linalg.solve(S.T @ H_pp @ S, S.T @ H_pp @ F_p @ S)))


def share_of_velocities(ivp: ConstrainedIvp, start: State, end: State, X: Array, carried: Array) -> float:
    """Return the volume of positions and velocities that a map has carried from one state to another over that of X, momenta first.

    Both are measured by the kinetic energy. Where constraints are on velocities, the motion may keep this volume, that of another
    density, or none.
    """

    def volume(state: State, Z: Array) -> float:
        p, q = state
        M, G, d = ivp.value("mass", p, q), ivp.value("G", q), ivp.d
        L = np.linalg.cholesky(M)
        # Rows that are orthonormal in the metric of M: of the velocities that g = 0 leaves, and of those that all constraints leave.
        positions, velocities = (across(G[:rows] @ np.linalg.inv(L).T) for rows in (ivp.holonomic, ivp.m))
        return float(np.linalg.det(np.vstack([positions @ L.T @ Z[d:], velocities @ np.linalg.solve(L, Z[:d])])))

    return abs(volume(end, carried) / volume(start, X))


def volume_left(ivp: ConstrainedIvp, t: float) -> float:
    """Return the share of volume that the exact motion from the start leaves at time t: exp of the integral of the divergence."""

    def rate(_: float, y: Array) -> Array:
        x = y[:-1]
        return np.append(field(ivp, x), divergence(ivp, x[ivp.d :], x[: ivp.d]))

    start = np.concatenate([ivp.q0, ivp.p0, [0.0]])
    end = scipy.integrate.solve_ivp(rate, (0.0, t), start, method="DOP853", rtol=TOLERANCE, atol=TOLERANCE).y[-1, -1]
    return float(np.exp(end))


def volume_share(carried: ArrayLike, X: ArrayLike) -> float:
    """Return the volume of vectors that a map has carried along over that of the vectors X, both shape(2d, 2n), momenta first.

    The volume of 2n vectors is the Pfaffian of X^T J X, whose square is its determinant.
    """
    volumes = []
    for Z in (np.asarray(carried, dtype=float), np.asarray(X, dtype=float)):
        half = Z[: len(Z) // 2].T @ Z[len(Z) // 2 :]
        volumes.append(np.linalg.det(half - half.T))
    # The determinant of a skew matrix is a square; rounding may make one that is zero negative.
    return float(np.sqrt(max(volumes[0], 0.0) / volumes[1]))
