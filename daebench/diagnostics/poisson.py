"""The Poisson defect of a map, exact to round-off by complex step."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from daebench.diagnostics.symplecticity import STEP

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
        The map Phi, analytic in its argument and computed in complex numbers; iterations inside it must converge in the
        imaginary part too.
    y : array_like, shape(n,)
        The point.
    B : callable
        Structure matrix B(y), shape(n, n).

    Returns
    -------
    float
        NaN if the map gives one.
    """
    y0 = np.asarray(y, dtype=float)
    images = np.array([np.asarray(flow(y0 + 1j * STEP * e)) for e in np.eye(len(y0))])
    derivative = np.imag(images).T / STEP
    carried = derivative @ np.asarray(B(y0), dtype=float) @ derivative.T
    return float(np.max(np.abs(carried - np.asarray(B(np.real(images[0])), dtype=float))))
