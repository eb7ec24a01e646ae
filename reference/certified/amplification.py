"""How far apart a motion carries what began close together: the price of a rounded start."""

from typing import Any

import mpmath as mp
import numpy as np
from numpy.typing import NDArray

from daebench.diagnostics.symplecticity import tangent_basis
from daebench.reference.certified.certify import Certified
from daebench.reference.certified.motions import Motions, sizes
from daebench.reference.certified.stages import Rows

Array = NDArray[np.float64]

BESIDE = mp.mpf("1e-24")
"""Relative distance of the neighbours: far above quadruple rounding, and linear up to amplifications of 1e17."""

ROUNDING = 2.0**-53
"""Relative rounding of a start in double precision."""

LOST = 0.01
"""A run cannot follow any more once the rounding of its start alone has become this part of the motion."""


def amplification(motions: Motions, certified: Certified) -> Array:
    """Return the largest growth of a perturbation along the manifold, shape(n,), 1 at the start.

    ::

        A(t) = max |S^-1 dx(t)| / |S^-1 dx(0)|      S = diag(max |q|, max |p|)

    It is taken from neighbours in quadruple precision, one for each direction of an orthonormal basis of the tangent space.

    Parameters
    ----------
    motions : Motions
        The motion, and the way to its neighbours.
    certified : Certified
        Its certified part.
    """
    scene, n = motions.definition.scene, len(certified.t)
    largest = sizes(certified.states)
    S = np.repeat([largest["q"], largest["p"]], scene.d)
    tangent = np.array([np.concatenate([x[scene.d :], x[: scene.d]]) for x in tangent_basis(scene, scene.p0, scene.q0).T]).T
    Q = np.linalg.qr(tangent / S[:, None])[0]
    base = motions.own()
    columns = []
    for k, direction in enumerate((S[:, None] * Q).T):
        beside = motions.own([BESIDE * mp.mpf(float(x)) for x in direction], stage=f"beside-{k + 1}")
        columns.append(np.hstack([_apart(base.q[:n], beside.q), _apart(base.p[:n], beside.p)]) / S)
    return np.asarray(np.linalg.norm(np.stack(columns, axis=2), ord=2, axis=(1, 2)))


def _apart(base: Rows, beside: Rows) -> Array:
    """Return the distance of two motions in units of the perturbation, shape(n, d)."""
    return np.array([[float((y - x) / BESIDE) for x, y in zip(*rows, strict=True)] for rows in zip(base, beside, strict=False)])


def double_horizon(t: Any, growth: Array) -> float | None:
    """Return the first time at which the rounding of a start in double precision is a hundredth of the motion, or None."""
    lost = np.flatnonzero(growth * ROUNDING > LOST)
    return float(t[lost[0]]) if lost.size else None
