"""The defects of reversibility and of inversion: the error left after a map is undone by reversing momenta and mapping again."""

import numpy as np
from numpy.typing import ArrayLike

from daebench.diagnostics.symplecticity import Flow


def reversibility_defect(flow: Flow, p: ArrayLike, q: ArrayLike) -> float:
    """Return the Euclidean norm of rho Phi rho Phi(x) - x with rho(p, q) = (-p, q), HLW Section V.1.

    Parameters
    ----------
    flow : callable
        The map Phi, ``flow(p, q) -> (p, q)``.
    p, q : array_like, shape(d,)
        The point x.

    Returns
    -------
    float
        Zero to round-off for a rho-reversible map; NaN if the map gives one.

    Examples
    --------
    >>> def drift(p, q):
    ...     return p, q + 0.1 * p
    >>> reversibility_defect(drift, [1.0], [0.0])
    0.0
    """
    p0, q0 = np.array(p, dtype=float), np.array(q, dtype=float)
    # Copies, because code from outside may change its arguments.
    p1, q1 = flow(p0.copy(), q0.copy())
    p2, q2 = flow(-np.asarray(p1), np.array(q1))
    return float(np.linalg.norm(np.concatenate([-np.asarray(p2) - p0, np.asarray(q2) - q0])))


def inversion_defect(forward: Flow, backward: Flow, p: ArrayLike, q: ArrayLike) -> float:
    """Return the Euclidean norm of Phi_{-h} Phi_h(x) - x, which is zero for a symmetric map, HLW Def. V.1.4.

    Parameters
    ----------
    forward, backward : callable
        The maps Phi_h and Phi_{-h}, ``(p, q) -> (p, q)``.
    p, q : array_like, shape(d,)
        The point x.
    """
    p0, q0 = np.array(p, dtype=float), np.array(q, dtype=float)
    p2, q2 = backward(*(np.real(part) for part in forward(p0.copy(), q0.copy())))
    return float(np.linalg.norm(np.concatenate([np.real(p2) - p0, np.real(q2) - q0])))
