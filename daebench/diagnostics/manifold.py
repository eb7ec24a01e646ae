"""Manifold drift: how far a trajectory is off the constraints g(q) = 0 and G(q) H_p(p, q) = 0, HLW (1.11)."""

from dataclasses import dataclass

import numpy as np

from daebench.diagnostics.drift import Drift
from daebench.diagnostics.energy import energy_drift
from daebench.diagnostics.metric import least_displacement
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.trajectory import Trajectory


@dataclass(frozen=True)
class ManifoldDrift:
    """How the constraint residuals behave over the outputs of a run.

    Parameters
    ----------
    g_max, Gv_max : float
        Largest |g| and |G H_p| over outputs and components; NaN where a state is not finite.
    g, Gv : Drift
        Drift of the largest component of |g|, and of |G H_p|, along the run.
    """

    g_max: float
    Gv_max: float
    g: Drift
    Gv: Drift


def manifold_drift(ivp: ConstrainedIvp, trajectory: Trajectory) -> ManifoldDrift:
    """Return the largest constraint residuals over the outputs of a trajectory, each with its drift.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem with its numbers.
    trajectory : Trajectory
        Outputs t, q, p, n of them; an unfinished run counts as far as it went.

    Returns
    -------
    ManifoldDrift
    """
    g = np.max(np.abs(ivp.along("g", trajectory.q)), axis=1, initial=0.0)
    Gv = np.max(np.abs(ivp.along("Gv", trajectory.p, trajectory.q)), axis=1, initial=0.0)
    scales = residual_scales(ivp, trajectory.p[0], trajectory.q[0])
    drifts = [energy_drift(trajectory.t, x, resolution=float(np.finfo(float).eps) * s) for x, s in zip((g, Gv), scales, strict=True)]
    return ManifoldDrift(float(np.max(g)), float(np.max(Gv)), *drifts)


def residual_scales(ivp: ConstrainedIvp, p: Array, q: Array) -> tuple[float, float]:
    """Return the changes of g and G H_p under a relative change of p and q by one, at one state.

    ::

        max_i sum_j |G_ij| max |q|        max_i sum_j ( |Gv_q|_ij max |q| + |Gv_p|_ij max |p| )

    Times eps, these are the residuals that the rounding of p and q alone explains. Of a long chain v = H_p is changed in the place of p.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem with its numbers.
    p, q : ndarray, shape(d,)
        The state.

    Returns
    -------
    g, Gv : float
        In the units of g and of G H_p.
    """
    if ivp.arrays:
        G, Gv_q = ivp.value("row_moduli", p, q)
        q_size, v_size = float(np.max(np.abs(q))), float(np.max(np.abs(ivp.value("H_p", p, q))))
        return float(np.max(G)) * q_size, float(np.max(Gv_q * q_size + G * v_size))
    q_size, p_size = float(np.max(np.abs(q))), float(np.max(np.abs(p)))
    state = tuple(p), tuple(q)
    G, Gv_q, Gv_p = (np.sum(np.abs(ivp.value(name, *x)), axis=1) for name, x in (("G", state[1:]), ("Gv_q", state), ("Gv_p", state)))
    return float(np.max(G, initial=0.0)) * q_size, float(np.max(Gv_q * q_size + Gv_p * p_size, initial=0.0))


def distance(ivp: ConstrainedIvp, P: Array, Q: Array, *, sweeps: int = 6) -> Array:
    """Return the distances of states to the manifold of g = 0 and G H_p = 0, in the metric of kinetic energy.

    ::

        min sqrt( dq^T M dq + dp^T M^-1 dp )   with   g(q + dq) = 0,   G H_p (p + dp, q + dq) = 0

    M is frozen at (p, q) and the unit of time is 1; for M = I this is the Euclidean distance. The nearest point is sought by
    Gauss-Newton sweeps, each the exact solution with the conditions linearised; the first is the first-order estimate, and the
    error falls by a factor of the order of distance times curvature with each.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem with its numbers.
    P, Q : ndarray, shape(n, d)
        States, one a row.
    sweeps : int
        Number of sweeps.

    Returns
    -------
    ndarray, shape(n,)
        NaN for a state that is not finite or from which the sweeps do not converge.
    """
    d = ivp.d
    M, H_pp = ivp.along("mass", P, Q), ivp.along("H_pp", P, Q)
    W = np.zeros((len(P), 2 * d, 2 * d))
    W[:, :d, :d], W[:, d:, d:] = M, H_pp
    dx = np.zeros((len(P), 2 * d))
    # The same number for all states, without a test, so that no state affects another.
    for _ in range(sweeps):
        p, q = P + dx[:, :d], Q + dx[:, d:]
        residual = np.concatenate([ivp.along("g", q), ivp.along("Gv", p, q)], axis=1)
        C = constraint_jacobian(ivp, p, q)
        dx = least_displacement(C, W, (C @ dx[:, :, None])[:, :, 0] - residual)
    dp, dq = dx[:, :d], dx[:, d:]
    squares = np.einsum("ni,nij,nj->n", dp, H_pp, dp) + np.einsum("ni,nij,nj->n", dq, M, dq)
    return np.asarray(np.sqrt(squares), dtype=float)


def constraint_jacobian(ivp: ConstrainedIvp, P: Array, Q: Array) -> Array:
    """Return the Jacobian of (g, G H_p) with respect to x = (p, q), shape(n, k + m, 2d): rows (0, G) and (Gv_p, Gv_q).

    Only the first k constraints are on positions.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem with its numbers.
    P, Q : ndarray, shape(n, d)
        States, one a row.
    """
    G = ivp.along("G", Q)[:, : ivp.holonomic]
    upper = np.concatenate([np.zeros_like(G), G], axis=2)
    lower = np.concatenate([ivp.along("Gv_p", P, Q), ivp.along("Gv_q", P, Q)], axis=2)
    return np.concatenate([upper, lower], axis=1)
