"""Whether a force without potential feeds energy into the motion: damping that is negative."""

import numpy as np

from daebench.runs.ivp import ConstrainedIvp

ROUNDING = 1e-9
"""Part of the largest entry of F below which its power is rounding."""


def negative_damping(ivp: ConstrainedIvp) -> float:
    """Return the largest power F . v of what changes its sign with v, at the start, for |v| = 1 along the manifold; 0 if none is positive.

    Of H_q - F, what changes its sign with p is -F alone where H is even in p: no force has to be derived. A force by position or time is
    no damping, nor is one that turns, and neither has any part in it. Where H is not even in p, or vectors are arrays, it is not looked
    at, and 0.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem with its numbers; M and F are those at its start.
    """
    if not getattr(ivp.facts, "FORCED", False) or ivp.arrays or not ivp.facts.QUADRATIC:
        return 0.0
    n, q = len(ivp.q0) - 1, ivp.q0
    mass = np.linalg.inv(ivp.value("H_pp", ivp.p0, q)[:n, :n])
    ways = np.linalg.svd(ivp.value("G", q)[:, :n])
    free = ways[2][np.sum(ways[1] > ROUNDING * ways[1].max()) :]
    F = np.empty((len(free), n))
    for k, v in enumerate(free):
        p = np.append(mass @ v, 0.0)
        there, back = ((ivp.value("H_p", s * p, q), ivp.value("H_q", s * p, q)) for s in (1, -1))
        if np.abs(there[0] + back[0])[:n].max() > ROUNDING * np.abs(there[0][:n]).max():
            return 0.0
        F[k] = (back[1] - there[1])[:n] / 2
    power = F @ free.T
    largest = float(np.linalg.eigvalsh((power + power.T) / 2).max(initial=0.0))
    return largest if largest > ROUNDING * np.abs(F).max(initial=0.0) else 0.0
