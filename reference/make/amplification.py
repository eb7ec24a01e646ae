"""Growth of perturbations along a motion, and thus of the rounding of a start."""

from dataclasses import dataclass
from typing import Any

import mpmath as mp
import numpy as np

from daebench.reference.keep.record import EPS
from daebench.reference.make.certify import Certified
from daebench.reference.make.independent_computations import Computations, sizes
from daebench.reference.make.stages import Rows
from daebench.runs.ivp import Array

BESIDE = mp.mpf("1e-20")
"""Relative distance of the neighbours: far above quadruple rounding, and in the linear range up to amplifications of 1e16."""

RESOLVED = 1e-11
"""Fraction of the largest growth above which the growth in another direction is not lost in rounding."""

LOST = 0.01
"""A motion is lost once an error is this fraction of it. No run can follow once the rounding of a single state has grown as much."""


@dataclass(frozen=True)
class Growth:
    """Largest growth of a perturbation at each time, shape(n,): from the start, from any earlier time, from the last.

    ::

        A(t, s) = max |S^-1 dx(t)| / |S^-1 dx(s)|      S = diag(max |q|, max |p|), or max |y|

    Perturbations of a constrained problem are along the manifold; those of a Poisson system are arbitrary.
    """

    start: Array
    worst: Array
    step: Array


def amplification(computations: Computations, certified: Certified) -> Growth:
    """Return the growth of perturbations, from neighbours in quadruple precision, one for each direction.

    The rounding of an intermediate state grows from there. If the motion converges again, this is more than the growth from the start.
    """
    n, largest, state = len(certified.t), sizes(certified.states), computations.definition.ivp.state
    first = certified.states.parts
    S = np.concatenate([np.full(len(first[part][0]), largest[part]) for part in state.columns])
    Q = np.linalg.qr(computations.mathematics.directions / S[:, None])[0]
    base, columns = computations.own(), []
    for k, direction in enumerate((S[:, None] * Q).T):
        beside = computations.own([BESIDE * mp.mpf(float(x)) for x in direction], stage=f"beside-{k + 1}")
        columns.append(_apart(base.rows[:n], beside.rows) / S)
    return growth(np.stack(columns, axis=2))


def growth(C: Array) -> Growth:
    """Return the growth from columns of a tangent map, shape(n, size, directions), orthonormal at the start.

    Directions that have shrunk to below 1e-11 of the largest are not resolved by C and are left out.
    """
    back = np.linalg.pinv(C, rcond=RESOLVED)
    start = np.linalg.norm(C, ord=2, axis=(1, 2))
    worst = [max(start[k], np.linalg.norm(C[k] @ back[: k + 1], ord=2, axis=(1, 2)).max()) for k in range(len(C))]
    step = np.linalg.norm(C[1:] @ back[:-1], ord=2, axis=(1, 2))
    return Growth(start, np.array(worst), np.concatenate([[1.0], step]))


def _apart(base: Rows, beside: Rows) -> Array:
    """Return the distance of two motions in units of the perturbation, shape(n, size)."""
    return np.array([[float((y - x) / BESIDE) for x, y in zip(*rows, strict=True)] for rows in zip(base, beside, strict=False)])


def double_horizon(t: Any, worst: Array) -> float | None:
    """Return the first time at which the rounding of a state in double precision is a hundredth of the motion, or None."""
    lost = np.flatnonzero(worst * EPS > LOST)
    return float(t[lost[0]]) if lost.size else None
