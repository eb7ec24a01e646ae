"""A stable position of rest of a constrained system, sought from the positions of a case."""

from dataclasses import dataclass, replace
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
"""Force and g that may be left, in parts of the forces at the case and of its size; more is no equilibrium."""

ON = 1e-3
"""Part of the change of g over a length within which the end of a descent is on the manifold."""

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
        Largest modulus of what is left of H_q + G^T lam, in parts of H_q at the case, and of g, in parts of its change over a length q0.
    """

    q: Array
    lam: Array
    residual: float


def largest(x: Any) -> float:
    """Return the largest modulus, 0 of nothing, NaN if one is."""
    return float(np.max(np.abs(x), initial=0.0))


@dataclass(frozen=True)
class _Units:
    """Units of length, of force and of each constraint, of the size of those at the case: what is sought then depends on no unit."""

    length: float
    force: float
    rows: Array

    @classmethod
    def of(cls, ivp: ConstrainedIvp) -> "_Units":
        length = largest(ivp.q0) or 1.0
        slopes = np.max(np.abs(ivp.value("G", ivp.q0)), axis=1, initial=0.0)
        force, *others = (largest(ivp.value("H_q", 0 * ivp.q0, ivp.q0 + s * length)) for s in (0.0, 0.5, -0.5))
        # That at the case, unless it is one of rounding there: stiff springs pull far more strongly half a length away.
        away = max((other for other in others if np.isfinite(other)), default=0.0)
        return cls(length, (force if force > AT_REST * away else away) or 1.0, length * np.where(slopes > 0, slopes, 1.0))


def equilibrium(ivp: ConstrainedIvp) -> Equilibrium:
    """Return a position of rest that a descent of H(0, q) on the manifold leads to from the case, polished by Newton's method."""
    zero, of = np.zeros(ivp.d), _Units.of(ivp)
    with np.errstate(all="ignore"):
        # Two ways down: in units of the size of the motion, without which small masses seem to be at rest, and in those of the problem,
        # which lead to the minimum where springs of very different stiffness pull.
        ends = [_descended(ivp, units) for units in (_Units(1.0, 1.0, np.ones(ivp.m)), of)]
        on = [q for q in ends if largest(ivp.value("g", q) / of.rows) < ON] or ends
        lowest = min(on, key=lambda q: float(ivp.value("H", zero, q)))
        # With the lengths of the place itself: the case may be far from it, as where its positions do not go with a parameter.
        rest = _polished(ivp, lowest, replace(_Units.of(ivp.at(ivp.p0, lowest)), force=of.force))
    speed, inverse = (largest(ivp.value(name, zero, rest.q)) for name in ("H_p", "H_pp"))
    nearby = largest(rest.q) < ESCAPED * of.length
    if not nearby or not rest.residual <= AT_REST or not speed <= AT_REST * np.sqrt(inverse * of.force * of.length):
        raise BadInput(
            f"{ivp.problem}, case {ivp.case}, has no equilibrium at the end of the descent of its potential energy from its start; "
            "give another case, or parameters with which it has one.",
            "no-equilibrium",
        )
    return rest


def _descended(ivp: ConstrainedIvp, of: _Units) -> Array:
    """Return where a descent of H(0, q) on the manifold, in these units, ends."""
    zero, work = np.zeros(ivp.d), of.force * of.length
    on_manifold = {
        "type": "eq",
        "fun": lambda x: ivp.value("g", of.length * x) / of.rows,
        "jac": lambda x: ivp.value("G", of.length * x) * (of.length / of.rows)[:, None],
    }
    descent = scipy.optimize.minimize(  # type: ignore[call-overload]  # its stubs want to know the rank of arrays
        lambda x: float(ivp.value("H", zero, of.length * x)) / work,
        ivp.q0 / of.length,
        jac=lambda x: np.array(ivp.value("H_q", zero, of.length * x), dtype=float) / of.force,
        constraints=[on_manifold],
        method="SLSQP",
        options={"maxiter": ITERATIONS, "ftol": 1e-14},
    )
    return of.length * np.asarray(descent.x, dtype=float)


def _polished(ivp: ConstrainedIvp, q: Array, of: _Units) -> Equilibrium:
    """Return the position that Newton's method leads to: steps of least norm, for positions of rest may be many."""
    zero, work = np.zeros(ivp.d), of.force * of.length
    lam = np.linalg.lstsq(ivp.value("G", q).T * of.length / of.rows, -ivp.value("H_q", zero, q) / of.force, rcond=None)[0]
    for k in range(POLISHED + 1):
        G = ivp.value("G", q) * (of.length / of.rows)[:, None]
        left = np.concatenate([ivp.value("H_q", zero, q) / of.force + G.T @ lam, ivp.value("g", q) / of.rows])
        if k == POLISHED or not np.all(np.isfinite(left)):
            break
        K = stiffness(ivp, q, lam * work / of.rows)[0] * (of.length / of.force)
        change = np.linalg.lstsq(np.block([[K, G.T], [G, np.zeros((ivp.m, ivp.m))]]), -left, rcond=1e-12)[0]
        q, lam = q + of.length * change[: ivp.d], lam + change[ivp.d :]
    return Equilibrium(q, lam * work / of.rows, largest(left))


def stiffness(ivp: ConstrainedIvp, q: Array, lam: Array) -> tuple[Array, Array]:
    """Return H_qq + sum lam_i g_i'' at rest, and the sum of the moduli of its terms, shape(d, d) each."""
    terms = [np.array(ivp.value("H_qq", np.zeros(ivp.d), q), dtype=float)]
    terms += [np.array(ivp.value("curvature", q, one), dtype=float) for one in np.diag(lam)]
    return np.sum(terms, axis=0), np.sum(np.abs(terms), axis=0)
