"""The Poisson defect of a map, exact to round-off where the map computes in complex numbers."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from daebench.diagnostics.derivative import Derivative, derivative
from daebench.runs.trajectory import Array

Map = Callable[[NDArray[Any]], Sequence[Any] | NDArray[Any]]
"""A map y -> y of vectors of shape(n,), real or complex, that leaves its argument unchanged."""

Structure = Callable[[NDArray[np.float64]], ArrayLike]
"""The structure matrix y -> B(y), shape(n, n), skew-symmetric."""


def poisson_defect(flow: Map, y: ArrayLike, B: Structure) -> float:
    """Return the largest entry, in modulus, by which a map misses the definition of a Poisson map, HLW (4.2).

    ::

        Phi'(y) B(y) Phi'(y)^T - B(Phi(y))        Phi'(y) e_k = Im Phi(y + i s e_k) / s,  s = 1e-30

    Zero to round-off, which is eps times the largest entry of |Phi'| |B| |Phi'|^T, for a Poisson map.

    Parameters
    ----------
    flow : callable
        The map Phi, best analytic in its argument and computed in complex numbers, with iterations inside it that converge in the
        imaginary part too; for other maps Phi' is computed by differences, and a warning states their accuracy.
    y : array_like, shape(n,)
        The point.
    B : callable
        Structure matrix B(y), shape(n, n).

    Returns
    -------
    float
        NaN if the map gives one.

    Examples
    --------
    >>> def canonical(y):
    ...     return [[0.0, -1.0], [1.0, 0.0]]
    >>> poisson_defect(lambda y: [y[0], y[1] + 0.1 * y[0]], [1.0, 0.0], canonical) < 1e-15
    True
    >>> round(poisson_defect(lambda y: [0.9 * y[0], y[1]], [1.0, 0.0], canonical), 12)
    0.1
    """
    y0 = np.asarray(y, dtype=float)
    return structure_change(derivative(flow, y0, np.eye(len(y0))), y0, B)


def structure_change(jacobian: Derivative, y: Array, B: Structure) -> float:
    """Return the same for a map whose derivative along the unit vectors at y is known."""
    carried = jacobian.value @ np.asarray(B(y), dtype=float) @ jacobian.value.T
    return float(np.max(np.abs(carried - np.asarray(B(jacobian.image), dtype=float))))
