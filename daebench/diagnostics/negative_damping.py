"""Whether a force without potential feeds energy into the motion: damping that is negative."""

import numpy as np

from daebench.diagnostics.inverse_mass import pseudo_mass, scaled
from daebench.runs.ivp import ConstrainedIvp

ROUNDING = 1e-9
"""Part of the largest entry of F below which its power is rounding."""


def negative_damping(ivp: ConstrainedIvp) -> float:
    """Return the largest power F . v of the part of F that is odd in v, at the start, for |v| = 1 on the manifold; 0 if none is positive.

    If H is even in p, the part of H_q - F that is odd in p is that of -F alone, so that no force has to be derived. A force that depends
    on position or time is no damping, and neither is a gyroscopic one; both have no part in the power. The result is 0 if H is not even in
    p, or if vectors are arrays.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem with its numbers; M and F are those at its start.
    """
    if not getattr(ivp.facts, "FORCED", False) or ivp.arrays or not ivp.facts.QUADRATIC:
        return 0.0
    n, q = ivp.moving, ivp.q0
    mass = pseudo_mass(*scaled(ivp, ivp.p0, q))
    ways = np.linalg.svd(ivp.value("G", q)[:, :n])
    free = ways[2][np.sum(ways[1] > ROUNDING * ways[1].max(initial=0.0)) :]
    F = np.empty((len(free), n))
    for k, v in enumerate(free):
        p = np.append(mass @ v, 0.0)
        forth, back = ((ivp.value("H_p", s * p, q), ivp.value("H_q", s * p, q)) for s in (1, -1))
        if np.abs(forth[0] + back[0])[:n].max() > ROUNDING * np.abs(forth[0][:n]).max():
            return 0.0
        # The odd part of H_q - F: gravity, springs and drivers are even in p and cancel.
        F[k] = (back[1] - forth[1])[:n] / 2
    power = F @ free.T
    # The symmetric part alone does work: a gyroscopic force is skew and does none.
    largest = float(np.linalg.eigvalsh((power + power.T) / 2).max(initial=0.0))
    return largest if largest > ROUNDING * np.abs(F).max(initial=0.0) else 0.0
