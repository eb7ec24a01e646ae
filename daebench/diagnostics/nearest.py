"""The nearest states that meet conditions, in the metric of kinetic energy, for many states at once."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from daebench.diagnostics.metric import least_displacement
from daebench.runs.trajectory import Array

Conditions = Callable[[Array, NDArray[np.intp]], tuple[Array, Array]]
"""Residuals, shape(k, c), and their Jacobians, shape(k, c, l), of states x, shape(k, l), in some of the rows."""

MET = 1e-10
"""Largest relative residual of conditions that a converged iteration has met."""

ITERATIONS = 100
"""Most sweeps of a projection."""

EPS = float(np.finfo(float).eps)


def nearest(conditions: Conditions, x0: Array, W: Array, least: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return the x nearest to each x0 in the metric W^-1 that meets conditions, by Newton's iteration to round-off.

    ::

        minimise (x - x0)^T W^-1 (x - x0)  subject to  c(x) = 0:   dx = W C^T (C W C^T)^+ (C dx - c(x0 + dx)),   C = c_x(x0 + dx)

    Each state is iterated until its own increment is at round-off, so that states do not affect each other.

    Parameters
    ----------
    conditions : callable
        Residuals c and Jacobians C of states in some of the rows: ``conditions(x, rows)``.
    x0 : ndarray, shape(n, l)
        States.
    W : ndarray, shape(n, l, l)
        Inverse of the metric.
    least : ndarray, shape(n,)
        Size against which increments are measured at least; else it is the largest coordinate of x0 or of x.

    Returns
    -------
    x : ndarray, shape(n, l)
        Where the iterations ended.
    increment : ndarray, shape(n,)
        Largest modulus of the last increment.
    met : ndarray of bool, shape(n,)
        Whether the iteration converged and the conditions are met.
    """
    dx, met = np.zeros_like(x0), np.zeros(len(x0), dtype=bool)
    previous = np.full(len(x0), np.inf)
    floor = np.maximum(least, np.max(np.abs(x0), axis=1))
    rows = np.arange(len(x0))
    for _ in range(ITERATIONS):
        residual, C = conditions(x0[rows] + dx[rows], rows)
        new = least_displacement(C, W[rows], (C @ dx[rows][:, :, None])[:, :, 0] - residual)
        increment = np.max(np.abs(new - dx[rows]), axis=1)
        size = np.maximum(floor[rows], np.max(np.abs(x0[rows] + new), axis=1))
        # As in Newton's iteration of the schemes: where conditions are nearly redundant, increments stop shrinking above 4 eps.
        stalled = (increment >= previous[rows]) & (increment <= 1e4 * EPS * size)
        small = np.all(np.abs(residual) <= MET * size[:, None] * np.sum(np.abs(C), axis=2), axis=1)
        met[rows] = ((increment <= 4 * EPS * size) | stalled) & small
        dx[rows], previous[rows] = new, increment
        # States that have converged are left out, so that each has the same bits alone and among others.
        rows = rows[~met[rows] & np.isfinite(increment)]
        if not len(rows):
            break
    return x0 + dx, previous, met
