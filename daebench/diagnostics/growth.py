"""The growth exponent of a secular part, from means over windows that are equally long in log t."""

from itertools import pairwise

import numpy as np

from daebench.runs.trajectory import Array

OCTAVES = 5
"""The first window ends at most so many octaves before the end of the run."""

FEWEST = 16
"""Fewest samples in a window."""

RANGE = (0.1, 10.0)
"""Exponents that are looked for."""


def growth_exponent(t: Array, error: Array, *, resolution: float = 0.0) -> tuple[float, float]:
    """Return the exponent alpha of the secular part of an error, and its standard error.

    Windows are half an octave long in t, the first one excepted, which begins at the start. The law |mean_k - mean_1| ~ t^alpha
    is fitted to their means, with weights and without taking logarithms, so that windows where the oscillation still
    hides the drift take part with the weight they deserve and the first mean need not be at t = 0::

        mean_k = a + c <t^alpha>_k        weights 1 / error_k^2,  error_k = 4 std(R) / n_k

    <t^alpha>_k is the mean of t^alpha over window k, and R the running sum of the residuals about the window's own line.

    Parameters
    ----------
    t, error : ndarray, shape(n,)
        Times, increasing, and errors, finite.
    resolution : float
        Round-off of one value of the error.

    Returns
    -------
    growth, growth_error : float
        Both NaN if there are fewer than five windows of 16 samples or no exponent between 0.1 and 10 fits.
    """
    t = t - t[0]
    windows = _windows(t)
    if len(windows) < 5:
        return float("nan"), float("nan")
    mean = np.array([np.mean(error[window]) for window in windows])
    floor = max(resolution, 4 * float(np.finfo(float).eps) * float(np.max(np.abs(error))))
    sigma = np.array([max(floor, _mean_error(t[window], error[window])) for window in windows])
    ends = np.array([[t[window][0], (t[window][0] + t[window][-1]) / 2, t[window][-1]] for window in windows]) / t[-1]
    low, high = RANGE
    for _ in range(4):
        alphas = np.linspace(low, high, 60)
        best = int(np.argmin([_misfit(alpha, ends, mean, sigma) for alpha in alphas]))
        low, high = float(alphas[max(best - 1, 0)]), float(alphas[min(best + 1, 59)])
    growth = float(alphas[best])
    if min(growth - RANGE[0], RANGE[1] - growth) < 1e-3:
        return float("nan"), float("nan")
    return growth, _standard_error(growth, ends, mean, sigma)


def _windows(t: Array) -> list[slice]:
    """Return the windows, with as many octaves as leave enough samples in each."""
    for octaves in range(OCTAVES, 0, -1):
        edges = np.searchsorted(t, t[-1] * 2.0 ** (-np.arange(2 * octaves, 0, -1) / 2))
        bounds = [0, *map(int, edges), len(t)]
        if min(np.diff(bounds)) >= FEWEST:
            return [slice(a, b) for a, b in pairwise(bounds)]
    return []


def _mean_error(t: Array, error: Array) -> float:
    """Return the error of a window's mean: of the order of the standard error for noise, a bound for an oscillation."""
    s = t - np.mean(t)
    residual = error - np.mean(error) - s * float(s @ error) / float(s @ s)
    return 4 * float(np.std(np.cumsum(residual))) / len(t)


def _design(alpha: float, ends: Array, sigma: Array) -> Array:
    """Return the weighted columns 1 and <t^alpha>, the mean over each window by Simpson's rule."""
    power = ends**alpha @ np.array([1.0, 4.0, 1.0]) / 6
    return np.column_stack([np.ones_like(power), power]) / sigma[:, None]


def _fit(alpha: float, ends: Array, mean: Array, sigma: Array) -> tuple[Array, Array]:
    A, b = _design(alpha, ends, sigma), mean / sigma
    a_c = np.asarray(np.linalg.lstsq(A, b, rcond=None)[0], dtype=float)
    return a_c, A @ a_c - b


def _misfit(alpha: float, ends: Array, mean: Array, sigma: Array) -> float:
    misfit = _fit(alpha, ends, mean, sigma)[1]
    return float(misfit @ misfit)


def _standard_error(alpha: float, ends: Array, mean: Array, sigma: Array) -> float:
    """Return the standard error of alpha from the linearised fit, enlarged where the fit is worse than its weights."""
    (_, c), misfit = _fit(alpha, ends, mean, sigma)
    step = 1e-4
    slope = (_design(alpha + step, ends, sigma)[:, 1] - _design(alpha - step, ends, sigma)[:, 1]) * c / (2 * step)
    jacobian = np.column_stack([_design(alpha, ends, sigma), slope])
    scale = np.linalg.norm(jacobian, axis=0)
    inverse = np.linalg.pinv(jacobian / scale)
    return float(np.linalg.norm(inverse[2]) / scale[2] * np.sqrt(max(1.0, float(misfit @ misfit) / (len(mean) - 3))))
