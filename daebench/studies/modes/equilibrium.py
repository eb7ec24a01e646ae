"""A stable position of rest of a constrained system, sought from the positions of a case."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from daebench.errors import BadInput
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.systems.lazily import scipy

ITERATIONS = 500
"""Of the descent of the potential energy on the manifold."""

POLISHED = 12
"""Steps of Newton's method after it."""

AT_REST = 1e-9
"""Force and g that may be left, in parts of the largest force of the constraints or of H_q; more is no equilibrium."""

ESCAPED = 1e6
"""Positions so many times as large as those of the case have left for infinity."""


@dataclass(frozen=True)
class Equilibrium:
    """A position of rest.

    Parameters
    ----------
    q : ndarray, shape(d,)
        Positions.
    lam : ndarray, shape(m,)
        Multipliers, with H_q + G^T lam = 0.
    residual : float
        Largest modulus of what is left of H_q + G^T lam and g.
    """

    q: Array
    lam: Array
    residual: float


def largest(x: Any) -> float:
    """Return the largest modulus, 0 of nothing, NaN if one is."""
    return float(np.max(np.abs(x), initial=0.0))


def equilibrium(ivp: ConstrainedIvp) -> Equilibrium:
    """Return a position of rest that a descent of H(0, q) on the manifold leads to from the case, polished by Newton's method."""
    zero = np.zeros(ivp.d)
    on_manifold = {"type": "eq", "fun": lambda q: ivp.value("g", q), "jac": lambda q: ivp.value("G", q)}
    with np.errstate(all="ignore"):
        minimum = scipy.optimize.minimize(  # type: ignore[call-overload]  # its stubs want to know the rank of arrays
            lambda q: float(ivp.value("H", zero, q)),
            ivp.q0,
            jac=lambda q: np.array(ivp.value("H_q", zero, q), dtype=float),
            constraints=[on_manifold],
            method="SLSQP",
            options={"maxiter": ITERATIONS, "ftol": 1e-14},
        ).x
        rest = _polished(ivp, np.asarray(minimum, dtype=float))
    speed, force = (largest(ivp.value(name, zero, rest.q)) for name in ("H_p", "H_q"))
    nearby = largest(rest.q) < ESCAPED * (1.0 + largest(ivp.q0))
    if not nearby or not rest.residual <= AT_REST * max(force, 1.0) or not speed <= AT_REST:
        raise BadInput(
            f"{ivp.problem}, case {ivp.case}, has no equilibrium at the end of the descent of its potential energy from its start; "
            "give another case, or parameters with which it has one."
        )
    return rest


def _polished(ivp: ConstrainedIvp, q: Array) -> Equilibrium:
    """Return the position that Newton's method leads to: steps of least norm, for positions of rest may be many."""
    zero = np.zeros(ivp.d)
    lam = np.linalg.lstsq(ivp.value("G", q).T, -ivp.value("H_q", zero, q), rcond=None)[0]
    for k in range(POLISHED + 1):
        G = ivp.value("G", q)
        left = np.concatenate([ivp.value("H_q", zero, q) + G.T @ lam, ivp.value("g", q)])
        if k == POLISHED or not np.all(np.isfinite(left)):
            break
        K = stiffness(ivp, q, lam)[0]
        change = np.linalg.lstsq(np.block([[K, G.T], [G, np.zeros((ivp.m, ivp.m))]]), -left, rcond=1e-12)[0]
        q, lam = q + change[: ivp.d], lam + change[ivp.d :]
    return Equilibrium(q, lam, largest(left))


def stiffness(ivp: ConstrainedIvp, q: Array, lam: Array) -> tuple[Array, Array]:
    """Return H_qq + sum lam_i g_i'' at rest, and the sum of the moduli of its terms, shape(d, d) each."""
    terms = [np.array(ivp.value("H_qq", np.zeros(ivp.d), q), dtype=float)]
    terms += [np.array(ivp.value("curvature", q, one), dtype=float) for one in np.diag(lam)]
    return np.sum(terms, axis=0), np.sum(np.abs(terms), axis=0)
