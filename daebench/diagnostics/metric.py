"""Smallest displacements under linear conditions, in the metric of kinetic energy, for many states at once."""

import numpy as np

from daebench.runs.trajectory import Array

REDUNDANT = 1e-12
"""Relative size below which what a condition adds to those before it is redundant."""

CONTRADICTION = 0.5
"""Largest relative residual: off their manifold, redundant constraints contradict each other a little."""


def least_displacement(C: Array, W: Array, b: Array) -> Array:
    """Return the dx that minimises dx^T W^-1 dx subject to C dx = b.

    ::

        dx = W C^T (C W C^T)^+ b

    The pseudo-inverse leaves redundant conditions alone; they are scaled to equal size before it is taken. Conditions that contradict each
    other are satisfied in the sense of least squares.

    Parameters
    ----------
    C : ndarray, shape(n, k, l)
        Conditions, for each of n states.
    W : ndarray, shape(n, l, l)
        Inverse of the metric.
    b : ndarray, shape(n, k)
        Right sides.

    Returns
    -------
    ndarray, shape(n, l)
        NaN for a state where anything is not finite, or where not even half of b can be met because C has lost rank.
    """
    with np.errstate(all="ignore"):
        WC = W @ np.swapaxes(C, 1, 2)
        normal = C @ WC
        # Scaled to ones on the diagonal, so that the threshold for redundancy depends on no unit.
        size = np.sqrt(np.abs(np.diagonal(normal, axis1=1, axis2=2)))
        size = np.where(size > 0, size, 1.0)
        normal = normal / (size[:, :, None] * size[:, None, :])
        broken = ~np.all(np.isfinite(normal), axis=(1, 2)) | ~np.all(np.isfinite(b), axis=1)
        # One matrix with a NaN would make the decomposition of all of them fail.
        normal[broken] = np.eye(normal.shape[1])
        mu = (np.linalg.pinv(normal, rcond=REDUNDANT, hermitian=True) @ (b / size)[:, :, None])[:, :, 0] / size
        dx = (WC @ mu[:, :, None])[:, :, 0]
        residual = np.linalg.norm(((C @ dx[:, :, None])[:, :, 0] - b) / size, axis=1)
        broken |= ~(residual <= CONTRADICTION * np.linalg.norm(b / size, axis=1))
    dx[broken] = np.nan
    return np.asarray(dx, dtype=float)
