"""Sizes by which the errors of all runs on a problem are divided: largest values along the run of RATTLE."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from daebench.diagnostics.manifold import residual_scales
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.trajectory import Trajectory

TINY = 1e-6
"""Relative change of a state for the slopes of integrals: a size needs only a few digits."""


@dataclass(frozen=True)
class Sizes:
    """Sizes along a run.

    Parameters
    ----------
    energy : float
        Largest kinetic energy p.v / 2, in the unit of H; 1 if nothing moves.
    g, Gv : float
        Largest :func:`daebench.diagnostics.manifold.residual_scales`.
    integrals : mapping of str to float
        The size of each other first integral: its change under a change of p and q by a relative unit.
    """

    energy: float
    g: float
    Gv: float
    integrals: dict[str, float]


def sizes(ivp: ConstrainedIvp, run: Trajectory) -> Sizes:
    """Return the sizes along a run."""
    T = np.einsum("ij,ij->i", run.p, ivp.along("H_p", run.p, run.q)) / 2
    residuals = np.max([residual_scales(ivp, p, q) for p, q in zip(run.p, run.q, strict=True)], axis=0)
    return Sizes(float(np.max(T)) or 1.0, float(residuals[0]), float(residuals[1]), integral_sizes(ivp, run.p, run.q))


def integral_sizes(ivp: ConstrainedIvp, P: Array, Q: Array) -> dict[str, float]:
    """Return sum_j |I_q_j| max |q| + sum_j |I_p_j| max |p| of each first integral I, the largest over states of shape(n, d), by name.

    It is not |I|, because the terms of an integral that is zero are rounded, too.
    """
    if not ivp.integrals:
        return {}
    here, total = ivp.along("integrals", P, Q), np.zeros((len(P), len(ivp.integrals)))
    for j in range(ivp.d):
        for there in (moved(P, j), Q), (P, moved(Q, j)):
            total += np.abs(ivp.along("integrals", *there) - here) / TINY
    return {name: float(size) or 1.0 for name, size in zip(ivp.integrals, np.max(total, axis=0), strict=True)}


def moved(states: Array, j: int) -> Any:
    """Return states of shape(n, d) with column j moved by ``TINY`` times the largest number in each."""
    return states + TINY * np.max(np.abs(states), axis=1)[:, None] * np.eye(states.shape[1])[j]
