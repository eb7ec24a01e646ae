"""The oscillations of errors: how many there are, and whether their samples resolve them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.runs.trajectory import Array

UNRESOLVED = 0.4
"""Neighbouring samples that correlate by less than this follow no oscillation."""

LINE = 0.2
"""Fraction of the variance at one frequency above which an error is periodic, and not noise."""

PEAKED = 10.0
"""Kurtosis above which an error is a train of peaks; Gaussian noise has 3."""


def centred(series: Array) -> Array:
    """Return series less their means, shape(..., n)."""
    return np.asarray(series - np.mean(series, axis=-1, keepdims=True))


def products(a: Array, b: Array) -> Any:
    """Return the sums of products of series along their samples, shape(...), each to the bit as if it were alone."""
    return np.einsum("...n,...n->...", a, b)


def oscillations(residual: Array) -> NDArray[np.int64]:
    """Return the number of swings of each error, without its secular part, about its mean, shape(m,).

    A swing is a passage from below the mean to a quarter of the standard deviation above it, or the same upside down where that is more:
    narrow peaks hardly move the mean.

    Parameters
    ----------
    residual : ndarray, shape(m, n)
        The errors less their secular parts, a row each.
    """
    r = centred(residual)
    # A band about the mean, so that noise near it does not count as swings.
    level = 0.25 * np.sqrt(products(r, r) / r.shape[-1])
    return np.where(level > 0, np.maximum(_passages(r > level[:, None], r < 0), _passages(r < -level[:, None], r > 0)), 0)


def _passages(above: NDArray[np.bool_], below: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the number of passages of each row from below to above, whatever is between."""
    either = above | below
    side = above[either]
    ends = np.cumsum(np.count_nonzero(either, axis=1))
    up = np.flatnonzero(side[1:] & ~side[:-1]) + 1
    row = np.searchsorted(ends, up, side="right")
    within = np.searchsorted(ends, up - 1, side="right") == row  # the last sample of a row and the first of the next are no neighbours
    return np.bincount(row[within], minlength=len(ends))


def aliased(residual: Array) -> NDArray[np.bool_]:
    """Return which errors are oscillations, or trains of peaks, that their samples do not resolve, shape(m,).

    Neighbours among samples of a resolved oscillation are alike. Noise is not, nor an oscillation with fewer than about five samples a
    period; what tells them apart is a line in the spectrum, or peaks of single samples, neither of which noise has.

    Parameters
    ----------
    residual : ndarray, shape(m, n)
        The errors less their secular parts, at equidistant times, a row each.
    """
    r = centred(residual)
    squares = products(r, r)
    unlike = (squares > 0) & (products(r[:, 1:], r[:, :-1]) <= UNRESOLVED * squares)
    unlike[unlike] = _lined(r[unlike], squares[unlike])
    return np.asarray(unlike)


def _lined(r: Array, squares: Array) -> NDArray[np.bool_]:
    """Return which series of mean zero have a line at a high frequency in their spectrum, or peaks."""
    n = r.shape[-1]
    power = np.abs(np.fft.rfft(r * np.hanning(n))) ** 2
    # A line spreads over three frequencies under the Hann window.
    around = np.pad(power, ((0, 0), (1, 1)))
    # Only above 2/5 of the highest frequency: fewer than five samples a period.
    high = np.max((around[:, :-2] + power + around[:, 2:])[:, n // 5 :], axis=1)
    return np.asarray((high > LINE * np.sum(power, axis=1)) | (np.mean(r**4, axis=1) * n**2 > PEAKED * squares**2))


def rough(residual: Array) -> NDArray[np.bool_]:
    """Return which errors are sums of independent steps, as a random walk is: neighbouring steps of an oscillation are alike.

    Parameters
    ----------
    residual : ndarray, shape(m, n)
        The errors less their secular parts, a row each.
    """
    r = centred(residual)
    return np.asarray((correlation(r) > 0.9) & (np.abs(correlation(np.diff(r))) < 0.3))


def correlation(r: Array) -> Array:
    """Return the correlation of neighbouring values of series of mean zero, shape(..., n); 0 where all of them are zero."""
    squares = products(r, r)
    return np.asarray(np.divide(products(r[..., 1:], r[..., :-1]), squares, out=np.zeros_like(squares), where=squares > 0))
