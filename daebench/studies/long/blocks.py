"""Means of a long series over blocks of equal length, a bounded number of them: when there are many, they are joined in pairs."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from daebench.runs.trajectory import Array

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
