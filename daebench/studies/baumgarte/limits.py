"""Where a Runge-Kutta method is stable on g'' + 2 alpha g' + beta^2 g = 0, by the roots of s^2 + 2 alpha s + beta^2.

A method with coefficients A and b multiplies the part of g that goes as exp(s t) by R(z), z = h s, in each step, HLW VI.4::

    R(z) = det(I - z A + z e b^T) / det(I - z A)

so that g does not grow where |R| <= 1 at both roots. Methods whose stages are found by fixed-point iteration solve their equations only
where |z| times the spectral radius of A is less than 1, and in a limited number of iterations only where it is less than a number below 1.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from daebench.schemes.kernels.language import ROUNDINGS
from daebench.schemes.kernels.newton import ITERATIONS
from daebench.schemes.kernels.tableaux import gauss

Array = NDArray[np.float64]

RK4 = np.array([[0, 0, 0, 0], [0.5, 0, 0, 0], [0, 0.5, 0, 0], [0, 0, 1, 0]]), np.array([1, 2, 2, 1]) / 6
"""A and b of the classical method, HLW II.1.1."""

FIRST = 1e-5
"""Part of the speed by which the first guess of a stage is off, about: chosen to fit limits measured on four problems. A hundred times as
much or as little moves a limit by 5 %."""

SLOWEST = float((ROUNDINGS * np.finfo(float).eps / FIRST) ** (1 / ITERATIONS))
"""Factor of the iteration with which it is at round-off after as many iterations as it may take: 0.8."""

MOST = 64.0
"""Largest alpha h that is looked at."""

DIGITS = 1e-6
"""Relative width of the interval that a limit is found in."""


def coefficients(scheme: str) -> tuple[Array, Array]:
    """Return A, shape(s, s), and b, shape(s,), of a scheme that may be run on a form of the system."""
    if scheme == "rk4":
        return RK4
    tableau = gauss(1 if scheme == "midpoint" else int(scheme.removeprefix("gauss")))
    return np.array(tableau.A, dtype=float), np.array(tableau.b, dtype=float)


def explicit(scheme: str) -> bool:
    """Return whether stages follow one from the other, so that nothing is iterated."""
    A, _ = coefficients(scheme)
    return not np.triu(A).any()


def roots(alpha: Array, beta: Array) -> NDArray[np.complex128]:
    """Return both roots of s^2 + 2 alpha s + beta^2, shape(2, ...)."""
    half = np.sqrt(np.asarray(alpha**2 - beta**2, dtype=complex))
    return np.stack([-alpha + half, -alpha - half])


def amplification(scheme: str, z: NDArray[np.complex128]) -> Array:
    """Return |R(z)|, of the shape of z."""
    A, b = coefficients(scheme)
    identity, one = np.eye(len(b)), np.ones(len(b))
    below = identity - z[..., None, None] * A
    above = below + z[..., None, None] * np.outer(one, b)
    return np.asarray(np.abs(np.linalg.det(above) / np.linalg.det(below)))


def growth(scheme: str, alpha_h: Array, beta_h: Array) -> Array:
    """Return the factor that g grows by in a step at most, of the shape of alpha h and beta h: the larger |R|."""
    return np.asarray(amplification(scheme, roots(np.asarray(alpha_h, dtype=float), np.asarray(beta_h, dtype=float))).max(axis=0))


def contraction(scheme: str, alpha_h: Array, beta_h: Array) -> Array:
    """Return the factor of the iteration for the stages, of the same shape; 0 where nothing is iterated.

    It is the mean over as many iterations as there may be, as the matrix h C of (beta g, g') and A say: a double root takes more of them.
    Above :data:`SLOWEST` the iteration does not come to its end, and above 1 it diverges.
    """
    A, _ = coefficients(scheme)
    alpha_h, beta_h = np.asarray(alpha_h, dtype=float), np.asarray(beta_h, dtype=float)
    if explicit(scheme):
        return np.zeros(np.broadcast_shapes(alpha_h.shape, beta_h.shape))
    zero = 0.0 * beta_h
    hC = np.moveaxis(np.array([[zero, beta_h], [-beta_h, -2 * alpha_h]]), (0, 1), (-2, -1))
    matrix = np.einsum("...ij,kl->...ikjl", hC, A).reshape(*hC.shape[:-2], 2 * len(A), 2 * len(A))
    power = np.linalg.matrix_power(matrix, ITERATIONS)
    return np.asarray(np.linalg.norm(power, ord=2, axis=(-2, -1)) ** (1 / ITERATIONS))


def usable(scheme: str, alpha_h: Array, beta_h: Array) -> NDArray[np.bool_]:
    """Return where g does not grow and the stages can be found."""
    return np.asarray((growth(scheme, alpha_h, beta_h) <= 1 + DIGITS) & (contraction(scheme, alpha_h, beta_h) < SLOWEST))


def limit(scheme: str, ratio: float = 1.0, passes: Callable[[float], bool] | None = None, *, digits: float = DIGITS) -> float:
    """Return the largest alpha h on the ray beta = ratio alpha up to which all is well; infinite where that is so up to :data:`MOST`."""
    fine = passes or (lambda x: bool(usable(scheme, np.array(x), np.array(ratio * x))))
    low, high = 0.0, 0.1
    while fine(high):
        low, high = high, 1.25 * high
        if high > MOST:
            return float("inf")
    while high - low > digits * high:
        middle = (low + high) / 2
        low, high = (middle, high) if fine(middle) else (low, middle)
    return low
