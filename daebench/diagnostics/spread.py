"""The exponent alpha with which the members of an ensemble part, s ~ t^alpha, and its standard error."""

from dataclasses import dataclass

import numpy as np

from daebench.diagnostics.order import straight_line
from daebench.runs.trajectory import Array
from daebench.systems.lazily import scipy

FEWEST = 6
"""Fewest windows from which an exponent is read."""

SHORTEST_OCTAVES = 8.0
"""Least number of last octaves of the time over which the spread is followed, if there are as many."""

GROWS = 0.25
"""Exponent that the spread has to exceed by two of its standard errors if a constant is fitted beside the power."""

LONG = 11.0
"""Smallest number of octaves that distinguish a constant from a power."""

LEAST = -0.9
"""Least constant, relative to the square of the spread in the first window."""

BENT, BENDING = 3.0, 0.02
"""Standard errors and absolute size by which the slopes over both halves of log t differ if the spread follows no single power."""


@dataclass(frozen=True)
class Spread:
    """How members part.

    Parameters
    ----------
    exponent, exponent_error : float
        Exponent alpha of s ~ t^alpha, and its standard error; NaN where it is not known.
    decades : float
        Decades of time over which it is read.
    bent : bool
        Whether the spread does not follow a single power there.
    seen : bool
        Whether members spread beyond the resolution at all.
    """

    exponent: float = float("nan")
    exponent_error: float = float("nan")
    decades: float = 0.0
    bent: bool = False
    seen: bool = True


def spread_exponent(t: Array, means: Array, resolution: float, octaves: float) -> Spread:
    """Return the exponent of the spread of members, the standard deviation s_w over members of their means over windows w.

    ::

        s_w^2 = a^2 t_w^(2 alpha) + b

    is fitted to log s_w by least squares over the last octaves of the time. The constant b is what H(x0) was rounded by, and whatever else
    of the errors does not grow. It is left out where s hardly grows, that is where alpha less two of its standard errors is at most 1/4,
    and over eleven octaves or fewer, for then it is not told from the rest.

    Windows of one member are not independent, members are. So the standard error is the jackknife's, which leaves out one member at a
    time, with the fit linearised. It is not less than that of a straight line: where members hardly differ, it is the same motion that
    makes the windows of all of them scatter.

    The beginning may follow another law. While the slopes of what the fit leaves over both halves of log t differ by more than three
    standard errors, the jackknife's again, and by more than 0.02, the first half octave is left out, down to the last eight octaves.

    Parameters
    ----------
    t : ndarray, shape(w,)
        Centres of windows, increasing.
    means : ndarray, shape(w, N)
        Means of the members over the windows.
    resolution : float
        A smaller spread counts as zero.
    octaves : float
        Octaves of the time over which the spread is followed at most.
    """
    seen = np.std(means, axis=1, ddof=1) > resolution
    if not seen.any():
        return Spread(seen=False)
    # Windows before the spread is seen hold rounding alone, whose logarithm would bend the fit.
    first = max(int(np.argmax(seen)), int(np.searchsorted(t, t[-1] * 2.0**-octaves)))
    if len(t) - first < FEWEST:
        return Spread()
    while True:
        spread = _fitted(np.log(t[first:]), means[first:])
        later = int(np.searchsorted(t, t[first] * 2.0**0.5 * (1 - 1e-9)))
        if not spread.bent or t[-1] < t[later] * 2.0**SHORTEST_OCTAVES or len(t) - later < FEWEST:
            return spread
        first = later


def _fitted(x: Array, means: Array) -> Spread:
    """Return the exponent over all windows, given log t."""
    logs, without = _log_spreads(means)
    line = np.stack([x - np.mean(x), np.ones_like(x)], axis=1)
    parameters, _, of_line = np.linalg.lstsq(line, logs)[0], *straight_line(x, logs)
    exponent, jacobian, fitted = float(parameters[0]), line, line @ parameters
    if x[-1] - x[0] > LONG * np.log(2.0) and exponent - 2 * max(of_line, _jackknife(np.linalg.pinv(line)[0] @ without)) > GROWS:
        # A constant is fitted only where the spread grows over many octaves: elsewhere it takes the place of the power.
        exponent, jacobian, fitted = _with_constant(x, logs, line, parameters)
    inverse = np.linalg.pinv(jacobian)
    error = max(_jackknife(inverse[0] @ without), of_line)
    late = x >= (x[0] + x[-1]) / 2
    bend = np.where(late, _weights(x, late), -_weights(x, ~late))
    # The influence of the logarithms on the bend, directly and by way of the fit.
    left = bend - (bend @ jacobian) @ inverse
    bent = bool(abs(bend @ (logs - fitted)) > max(BENDING, BENT * _jackknife(left @ without)))
    return Spread(exponent, error, float((x[-1] - x[0]) / np.log(10.0)), bent)


def _with_constant(x: Array, logs: Array, line: Array, parameters: Array) -> tuple[float, Array, Array]:
    """Return exponent, Jacobian and fitted values with a constant beside the power; those of the power alone where none fits."""

    def values(numbers: Array) -> Array:
        alpha, level, constant = numbers
        return np.asarray(alpha * line[:, 0] + level + 0.5 * np.log1p(constant * np.exp(-2 * alpha * (x - x[0]))))

    def residuals(numbers: Array) -> Array:
        return np.asarray(values(numbers) - logs)

    fit = scipy.optimize.least_squares(residuals, [*parameters, 0.0], bounds=([-np.inf, -np.inf, LEAST], np.inf))
    # At its bound the constant is not determined, and its derivative does not describe the error.
    if not fit.success or np.any(fit.active_mask):
        return float(parameters[0]), line, np.asarray(line @ parameters)
    return float(fit.x[0]), np.asarray(fit.jac), values(fit.x)


def _weights(x: Array, used: Array) -> Array:
    """Return the weights of values whose weighted sum is the least-squares slope over some of the x."""
    apart = np.where(used, x - np.mean(x[used]), 0.0)
    return np.asarray(apart / float(apart @ apart))


def _log_spreads(means: Array) -> tuple[Array, Array]:
    """Return the logarithms of the standard deviations over members, shape(w,), and those without one member each, shape(w, N)."""
    N, tiny = means.shape[1], np.finfo(float).tiny  # so that a spread of zero has a logarithm
    squares = (means - np.mean(means, axis=1, keepdims=True)) ** 2
    total = np.sum(squares, axis=1, keepdims=True)
    without = np.maximum(total - N / (N - 1) * squares, 0.0) / (N - 2)
    return 0.5 * np.log(total[:, 0] / (N - 1) + tiny), 0.5 * np.log(without + tiny)


def _jackknife(without: Array) -> float:
    """Return the standard error of a statistic, given its values without one member each."""
    N = len(without)
    return float(np.sqrt((N - 1) / N * np.sum((without - np.mean(without)) ** 2)))
