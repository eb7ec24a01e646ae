"""Lyapunov exponents and MEGNO from the growth of tangent vectors, with the verdict: chaotic, regular, or undetermined.

A vector grows as a power of time in an integrable motion, and as exp(lambda t) in a chaotic one. With its length delta, ::

    Y(t) = 2/t  integral_0^t  s d log(delta(s)),       <Y>(t) = 1/t  integral_0^t  Y(s) ds

is the mean exponential growth factor of nearby orbits: <Y> tends to 2 where delta grows in proportion to t, as on a torus of an integrable
system, to 0 where it is bounded, and grows as lambda t / 2 in chaos; Cincotta and Simo, Astron. Astrophys. Suppl. 147 (2000) 205.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daebench.runs.trajectory import Array
from daebench.systems.lazily import scipy

CHAOTIC, REGULAR, UNDETERMINED = "chaotic", "regular", "undetermined"
VERDICTS = (CHAOTIC, REGULAR, UNDETERMINED)
"""Verdicts on a start."""

QUASI_PERIODIC = 2.5
"""Largest <Y> of a motion with the verdict regular; that of a quasi-periodic motion tends to 2."""

EXPONENTIAL = 4.0
"""Smallest <Y> of a motion with the verdict chaotic; it is also larger than at half of the time."""

FEW_FOLDS = 4.0
"""Largest growth of log delta in the second half of the time of a motion with the verdict regular.

Growth as t^k has k log 2 there, and an oscillation adds its own size in the logarithm.
"""

MANY_FOLDS = 6.0
"""Smallest growth of log delta in the second half of the time of a motion with the verdict chaotic."""

BATCHES = 16
"""Number of batches of intervals; their means are treated as independent."""

TRANSIENT = 0.1
"""Fraction of the time left out of the exponent, while the vector turns into the direction of fastest growth."""

CONFIDENCE = 0.95
"""Confidence of the intervals of exponents."""

TOLD = 10.0
"""Approximate smallest lambda t at which an exponent lambda can be distinguished from zero in a time t."""

FEWEST = 2 * BATCHES
"""Smallest number of intervals from which an exponent is computed."""


@dataclass(frozen=True)
class Exponents:
    """Exponents, indicators and verdicts of n members.

    Parameters
    ----------
    exponent, low, high : ndarray, shape(n,)
        Largest Lyapunov exponent, 1/s, and an interval of :data:`CONFIDENCE`; its lower end is 0 where chaos is not found.
    megno : ndarray, shape(n,)
        Mean <Y> at the end.
    verdict : ndarray of str, shape(n,)
        One of :data:`VERDICTS`; "" where growth is not known up to the end.
    """

    exponent: Array
    low: Array
    high: Array
    megno: Array
    verdict: NDArray[np.str_]


def mean_megno(growth: Array) -> Array:
    """Return <Y> at the end of each interval, shape(n, k), from the growth in intervals of equal length.

    The integral of s d log(delta) is taken by the trapezoidal rule, that of Y by the rectangles of the map, as in Cincotta, Giordano and
    Simo, Physica D 182 (2003) 151.

    Parameters
    ----------
    growth : ndarray, shape(n, k)
        Growth of log delta in each interval.
    """
    ends = np.arange(1, growth.shape[1] + 1)
    Y = 2 / ends * np.cumsum((ends - 0.5) * growth, axis=1)
    mean: Array = np.cumsum(Y, axis=1) / ends
    return mean


def exponents(growth: Array, interval: float) -> Exponents:
    """Return the exponents, indicators and verdicts of the growth of tangent vectors.

    A start is called chaotic where <Y> is at least :data:`EXPONENTIAL` and still rises, and the second half of the time adds
    :data:`MANY_FOLDS` to log delta; regular where <Y> is at most :data:`QUASI_PERIODIC` and that half adds at most :data:`FEW_FOLDS`.
    Regular means that no exponential growth was observed in this time: an exponent below about :data:`TOLD` / t cannot be distinguished
    from zero. A start may be regular in this time and chaotic in a longer run. The interval is that of Student for the means of
    :data:`BATCHES` batches, after the first tenth.

    On starts with known answers, 96 about each of six integrable problems each after 50, 100, 200, 400 and 1000 s, 0 of 2880 were
    called chaotic and 17 undetermined. Of 95 chaotic ones of the double pendulum (lambda = 0.93/s) none was called regular after 25 s and
    11 undetermined, none after 50 s. Of 96 of the double spherical pendulum (0.46/s) 13 were called regular after 25 s, where lambda t is
    11, 1 after 50 s and none after 100 s. With noise of root mean square 0.5/s, correlated over 0.5 s, about a mean rate lambda for 100 s,
    32, 88 and 99.6 % were called chaotic where lambda t is 10, 20 and 30, and 12, 0.1 and 0 % regular.

    Parameters
    ----------
    growth : ndarray, shape(n, k)
        Growth of log delta in each of k intervals of time, k at least :data:`FEWEST`; NaN after a run has stopped.
    interval : float
        Length of one, s.
    """
    count = growth.shape[1]
    with np.errstate(invalid="ignore"):
        mean = mean_megno(growth)
        last, half = mean[:, -1], mean[:, count // 2 - 1]
        folds = np.sum(growth[:, count // 2 :], axis=1)
        chaotic = (last >= EXPONENTIAL) & (last > half) & (folds >= MANY_FOLDS)
        regular = (last <= QUASI_PERIODIC) & (folds <= FEW_FOLDS)
        # Batches of equal length at the end; what does not fill one is added to the transient at the beginning.
        size = int((1 - TRANSIENT) * count) // BATCHES
        batches = growth[:, count - size * BATCHES :].reshape(len(growth), BATCHES, size).mean(axis=2) / interval
        exponent = batches.mean(axis=1)
        reach = float(scipy.stats.t.ppf(0.5 + CONFIDENCE / 2, BATCHES - 1)) * batches.std(axis=1, ddof=1) / np.sqrt(BATCHES)
        # The largest exponent of a Hamiltonian motion is never negative: it is 0 at least along the flow.
        low, high = np.maximum(exponent - reach, 0.0), np.maximum(exponent + reach, 0.0)
    known = np.isfinite(last)
    verdict = np.select([~known, chaotic, regular], ["", CHAOTIC, REGULAR], UNDETERMINED)
    return Exponents(exponent, np.where(chaotic | ~known, low, 0.0), high, last, verdict)
