"""Moments of a long series over windows that are equally long in the logarithm of its number, in memory that does not grow with it."""

from itertools import pairwise

import numpy as np

from daebench.runs.trajectory import Array

PER_OCTAVE = 4
"""Windows between one number and twice that."""

EDGES = np.unique(np.ceil(2.0 ** (np.arange(PER_OCTAVE * 53 + 1) / PER_OCTAVE)).astype(np.int64))
"""Number of the first sample of each window, samples being counted from 1; the next is where a window ends."""

COUNT, MEAN, SQUARES, LEAST, MOST = range(5)
"""Columns of a table of windows: samples, mean, sum of squares about the mean, smallest and largest value."""


class Windows:
    """Moments of the windows of a series; what is added first is sample 1.

    Moments are merged by the formulas of Chan, Golub and LeVeque, which do not cancel.

    Parameters
    ----------
    table : ndarray, shape(windows, 5), optional
        Moments so far.
    """

    def __init__(self, table: Array | None = None) -> None:
        self.table: Array = np.empty((0, 5)) if table is None else table

    @property
    def samples(self) -> int:
        """Samples added so far."""
        return int(np.sum(self.table[:, COUNT]))

    def add(self, values: Array) -> None:
        """Add the next samples, shape(n,).

        The sums are rounded as the pieces fall that are added: the same pieces give the same bits.
        """
        before = self.samples
        starts = np.searchsorted(EDGES, [before + 1, before + len(values)], side="right") - 1
        ends = EDGES[starts[0] : starts[1] + 2] - 1 - before
        bounds = np.clip(ends, 0, len(values))
        for window, (a, b) in enumerate(pairwise(map(int, bounds)), start=int(starts[0])):
            self._merge(window, values[a:b])

    def _merge(self, window: int, values: Array) -> None:
        mean = np.mean(values)
        moments = np.array([len(values), mean, np.sum((values - mean) ** 2), np.min(values), np.max(values)])
        if window == len(self.table):
            self.table = np.vstack([self.table, moments])
        else:
            self.table[window] = merged(self.table[window], moments)

    def with_(self, values: Array) -> "Windows":
        """Return a copy with more samples."""
        more = Windows(self.table.copy())
        if len(values):
            more.add(values)
        return more


def merged(a: Array, b: Array) -> Array:
    """Return the moments of two samples together, shape(5,)."""
    n, apart = a[COUNT] + b[COUNT], b[MEAN] - a[MEAN]
    squares = a[SQUARES] + b[SQUARES] + apart**2 * (a[COUNT] * b[COUNT] / n)
    return np.array([n, a[MEAN] + apart * (b[COUNT] / n), squares, min(a[LEAST], b[LEAST]), max(a[MOST], b[MOST])])


def mean_square(table: Array) -> Array:
    """Return the mean square of each window, shape(windows,)."""
    return np.asarray(table[:, MEAN] ** 2 + table[:, SQUARES] / table[:, COUNT])


def centres(table: Array) -> Array:
    """Return the mean number of the samples of each window, shape(windows,)."""
    return np.asarray(EDGES[: len(table)] + (table[:, COUNT] - 1) / 2)
