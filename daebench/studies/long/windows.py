"""Moments and block means of a long series, in memory that does not grow with it."""

from dataclasses import dataclass, field
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


BLOCK = 4096
"""Samples that are added at a time, a power of two."""

MANY = 1024
"""Blocks that are joined to half as many."""


@dataclass
class Blocks:
    """Means of a series, or of several of the same length, over blocks of equal length."""

    length: int = 1
    """Samples of a block, a power of two."""
    means: Array = field(default_factory=lambda: np.empty(0))
    """Means of the blocks so far; shape (blocks,)."""
    total: Any = 0.0
    pieces: int = 0
    """Sum of the means of the pieces of BLOCK samples that a longer block has so far, and their number; shape (n,)."""

    def add(self, values: Array) -> None:
        """Add the next samples, shape(BLOCK,) or shape(n, BLOCK)."""
        if self.length <= BLOCK:
            block_means = np.mean(values.reshape(*values.shape[:-1], -1, self.length), axis=-1)
        else:
            self.total, self.pieces = self.total + np.mean(values, axis=-1), self.pieces + 1
            if self.pieces * BLOCK < self.length:
                return
            block_means, self.total, self.pieces = np.asarray(self.total / self.pieces)[..., None], 0.0 * self.total, 0
        self.means = np.concatenate([self.means, block_means], axis=-1)
        while self.means.shape[-1] >= MANY:
            self.means, self.length = joined(self.means), 2 * self.length

    def with_(self, values: Array) -> "Blocks":
        """Return a copy with fewer than BLOCK samples more; those that fill no block are left out."""
        whole = len(values) // self.length * self.length
        more = np.mean(values[:whole].reshape(-1, self.length), axis=1)
        return Blocks(self.length, np.concatenate([self.means, more]))

    def at(self, length: int) -> Array:
        """Return the means over longer blocks, shape(k,)."""
        means = self.means
        for _ in range((length // self.length).bit_length() - 1):
            means = joined(means)
        return means

    def some(self, rows: Any) -> "Blocks":
        """Return those of some of the series, or of one, by their numbers."""
        return Blocks(self.length, self.means[rows].copy(), self.total[rows], self.pieces)


def joined(means: Array) -> Array:
    """Return the means of neighbours, two and two; the last one of an odd number is left out."""
    pairs = means[..., : means.shape[-1] // 2 * 2].reshape(*means.shape[:-1], -1, 2)
    return np.asarray(np.mean(pairs, axis=-1))


def middles(blocks: int, length: int) -> Array:
    """Return the mean number of the samples of each block, samples being counted from 1, shape(blocks,)."""
    return np.asarray(np.arange(blocks) * length + (length + 1) / 2)
