"""The oscillations of an error: how many there are, and whether its samples resolve them."""

import numpy as np

from daebench.runs.trajectory import Array

UNRESOLVED = 0.4
"""Neighbouring samples that correlate by less than this follow no oscillation."""

LINE = 0.2
"""Part of the variance at one frequency from which on an error is periodic, and not noise."""

PEAKED = 10.0
"""Kurtosis beyond which an error is a train of peaks; that of Gaussian noise is 3."""


def oscillations(residual: Array) -> int:
    """Return how often an error without its secular part swings about its mean.

    A swing is a passage from below the mean to a quarter of the standard deviation above it, or the same upside down where that is more:
    narrow peaks hardly move the mean.

    Parameters
    ----------
    residual : ndarray, shape(n,)
        The error less its secular part.
    """
    r = residual - np.mean(residual)
    level = 0.25 * float(np.std(r))
    return max(_passages(r, level), _passages(-r, level)) if level > 0 else 0


def _passages(r: Array, level: float) -> int:
    side = np.where(r > level, 1, np.where(r < 0, -1, 0))
    side = side[side != 0]
    return int(np.sum((side[1:] > 0) & (side[:-1] < 0)))


def aliased(residual: Array) -> bool:
    """Return whether an error is an oscillation, or a train of peaks, that its samples do not resolve.

    Neighbours among samples of a resolved oscillation are alike. Noise is not, nor an oscillation with fewer than about five samples a
    period; what tells them apart is a line in the spectrum, or peaks of single samples, neither of which noise has.

    Parameters
    ----------
    residual : ndarray, shape(n,)
        The error less its secular part, at equidistant times.
    """
    r = residual - np.mean(residual)
    squares = float(r @ r)
    if squares == 0 or float(r[1:] @ r[:-1]) > UNRESOLVED * squares:
        return False
    power = np.abs(np.fft.rfft(r * np.hanning(len(r)))) ** 2
    around = np.convolve(power, np.ones(3), "same")
    high = float(np.max(around[len(r) // 5 :]))
    return bool(high > LINE * np.sum(power) or np.mean(r**4) * len(r) ** 2 > PEAKED * squares**2)


def rough(residual: Array) -> bool:
    """Return whether an error is made of steps that know nothing of each other, as a random walk is: of an oscillation the steps are alike.

    Parameters
    ----------
    residual : ndarray, shape(n,)
        The error less its secular part.
    """
    r = residual - np.mean(residual)
    return correlation(r) > 0.9 and abs(correlation(np.diff(r))) < 0.3


def correlation(r: Array) -> float:
    """Return the correlation of neighbouring values of a series of mean zero, shape(n,); 0 where all of them are zero."""
    squares = float(r @ r)
    return float(r[1:] @ r[:-1]) / squares if squares > 0 else 0.0
