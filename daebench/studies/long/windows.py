"""Moments of a long series over windows that are equally long in the logarithm of its number, in memory that does not grow with it."""

from itertools import pairwise
from typing import Any

import numpy as np

from daebench.runs.trajectory import Array

PER_OCTAVE = 4
"""Windows between one number and twice that."""

EDGES = np.unique(np.ceil(2.0 ** (np.arange(PER_OCTAVE * 53 + 1) / PER_OCTAVE)).astype(np.int64))
"""Number of the first sample of each window, samples being counted from 1; the next is where a window ends."""

COUNT, MEAN, SQUARES, LEAST, MOST = range(5)
"""Columns of a table of windows: samples, mean, sum of squares about the mean, smallest and largest value."""


class Windows:
    """Moments of the windows of a series, or of several of the same length; what is added first is sample 1.

    Moments are merged by the formulas of Chan, Golub and LeVeque, which do not cancel.

    Shapes: table (windows, 5).
    """

    def __init__(self, table: Array | None = None) -> None:
        self.table: Array = np.empty((0, 5)) if table is None else table

    @property
    def samples(self) -> int:
        """Samples of each series added so far."""
        return int(np.max(np.sum(self.table[..., COUNT], axis=-1), initial=0.0))

    def add(self, values: Array) -> None:
        """Add the next samples, shape(k,) or shape(n, k).

        The sums are rounded as the pieces fall that are added: the same pieces give the same bits.
        """
        before = self.samples
        starts = np.searchsorted(EDGES, [before + 1, before + values.shape[-1]], side="right") - 1
        ends = EDGES[starts[0] : starts[1] + 2] - 1 - before
        bounds = np.clip(ends, 0, values.shape[-1])
        for window, (a, b) in enumerate(pairwise(map(int, bounds)), start=int(starts[0])):
            self._merge(window, values[..., a:b])

    def _merge(self, window: int, values: Array) -> None:
        mean = np.mean(values, axis=-1)
        squares = np.sum((values - mean[..., None]) ** 2, axis=-1)
        count = np.full(mean.shape, float(values.shape[-1]))
        moments = np.stack([count, mean, squares, np.min(values, axis=-1), np.max(values, axis=-1)], axis=-1)
        if window == self.table.shape[-2]:
            self.table = np.concatenate([self.table, moments[..., None, :]], axis=-2)
        else:
            self.table[..., window, :] = merged(self.table[..., window, :], moments)

    def with_(self, values: Array) -> "Windows":
        """Return a copy with more samples."""
        more = Windows(self.table.copy())
        if values.shape[-1]:
            more.add(values)
        return more

    def some(self, rows: Any) -> "Windows":
        """Return those of some of the series, or of one, by their numbers."""
        return Windows(self.table[rows].copy())


def merged(a: Array, b: Array) -> Array:
    """Return the moments of two samples together, shape(..., 5)."""
    (n_a, mean_a, squares_a, least_a, most_a), (n_b, mean_b, squares_b, least_b, most_b) = np.moveaxis(a, -1, 0), np.moveaxis(b, -1, 0)
    n, apart = n_a + n_b, mean_b - mean_a
    squares = squares_a + squares_b + apart * apart * (n_a * n_b / n)
    return np.stack([n, mean_a + apart * (n_b / n), squares, np.minimum(least_a, least_b), np.maximum(most_a, most_b)], axis=-1)


def mean_square(table: Array) -> Array:
    """Return the mean square of each window, shape(windows,)."""
    return np.asarray(table[:, MEAN] ** 2 + table[:, SQUARES] / table[:, COUNT])


def centres(table: Array) -> Array:
    """Return the mean number of the samples of each window, shape(windows,)."""
    return np.asarray(EDGES[: len(table)] + (table[:, COUNT] - 1) / 2)
