"""Exact bounds on the shift of a quantile between paired samples: no distribution and no dependence of the pairs is assumed.

Let u and v be the quantiles of order q of x and of y. If u >= v + d, then for the number t = u

::

    P(x < t) <= q <= P(y + d <= t),        P(x < t < y + d) <= P(y + d <= t <= x).

So three counts of a sample can refute at t that the shift u - v is d or more: too many x below t, too few y + d up to t, both by the
binomial distribution of order q, or too many pairs on whose x and y + d the number t lies one way round and not the other, by the sign
test. The levels of the three add up to that of the whole. The t in question is unknown, but it is one number, whatever the sample; where
every number t is refuted, it is too, and so u - v < d at that level. The bound is the least such d.

Of independent samples, the sign test is the usual comparison of two distributions at the quantile. Of pairs that are close to each other it
uses that they are: a pair then counts only if its two members are on two sides of t.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from daebench.runs.trajectory import Array
from daebench.systems.lazily import scipy

HALVINGS = 16
"""The bound is sought by halving, within 1/65536 of the distance between the difference of the sample and the bound by ranks alone."""

ROUNDED = 4 * float(np.finfo(float).eps)
"""Rounding of a difference, relative to the largest number of the samples."""


@dataclass(frozen=True)
class Ranks:
    """Ranks that refute a number as a quantile, in a sample of n numbers.

    Parameters
    ----------
    above : int
        Fewest numbers below t that refute P(x < t) <= q.
    below : int
        Most numbers up to t that refute P(x <= t) >= q.
    left : float
        What is left of the level for the sign test.
    """

    above: int
    below: int
    left: float


def fewest(q: float, level: float) -> int:
    """Return the smallest sample in which the shift of the quantile of order q has a bound at a level.

    All numbers have to be on the quantile's longer side with a probability of half of the level at most: max(q, 1 - q)^n <= level / 2.
    """
    # Less a rounding, so that an integer quotient is not raised to the next number.
    return int(np.ceil(np.log(level / 2) / np.log(max(q, 1 - q)) * (1 - ROUNDED)))


@lru_cache(maxsize=64)
def ranks(count: int, q: float, level: float) -> Ranks | None:
    """Return the ranks that refute a quantile at a level; each takes a quarter of the level, or half if a quarter is impossible.

    None is returned if half of the level is not enough for one of them.
    """
    if count < fewest(q, level):
        return None
    up_to = scipy.stats.binom.cdf(np.arange(count), count, q)
    from_next = scipy.stats.binom.sf(np.arange(count), count, q)
    # A quarter for each rank test leaves half of the level to the sign test; few pairs need more to have ranks at all.
    share = [level / 4 if level / 4 >= least else level / 2 for least in (from_next[-1], up_to[0])]
    above = int(np.argmax(from_next <= share[0])) + 1
    below = int(np.searchsorted(up_to, share[1], side="right")) - 1
    return Ranks(above, below, max(0.0, level - float(from_next[above - 1]) - float(up_to[below])))


@lru_cache(maxsize=64)
def _fewest_one_way(count: int, left: float) -> NDArray[np.int64]:
    """Return the least number of m pairs that lie one way round if the sign test refutes, for m from 0 to the number of all pairs."""
    return np.asarray(scipy.stats.binom.isf(left, np.arange(count + 1), 0.5) + 1, dtype=np.int64)


def quantile(ordered: Array, q: float) -> float:
    """Return the quantile of order q of an ordered sample: its least member that is not smaller than a part q of the sample."""
    return float(ordered[max(0, int(np.ceil(q * len(ordered) * (1 - ROUNDED))) - 1)])


def shift_bounds(x: Array, y: Array, q: float, level: float) -> tuple[float, float]:
    """Return a lower and an upper bound on the quantile of x less that of y, each wrong with at most the probability ``level``.

    They are infinite where there are fewer pairs than :func:`fewest`.
    """
    return -_upper(y, x, q, level), _upper(x, y, q, level)


def _upper(x: Array, y: Array, q: float, level: float) -> float:
    limits = ranks(len(x), q, level)
    if limits is None:
        return float("inf")
    ordered_x, ordered_y = np.sort(x), np.sort(y)
    last, first = float(ordered_x[limits.above - 1]), float(ordered_y[limits.below])
    # The difference of the sample is never refuted, and the bound by ranks alone always is.
    possible, refuted = quantile(ordered_x, q) - quantile(ordered_y, q), last - first
    for _ in range(HALVINGS):
        shift = possible + (refuted - possible) / 2
        if _refuted(x, y + shift, first + shift, last, limits.left):
            refuted = shift
        else:
            possible = shift
    return refuted + ROUNDED * float(max(np.max(np.abs(x)), np.max(np.abs(y))))


def _refuted(x: Array, moved: Array, first: float, last: float, left: float) -> bool:
    """Return whether the sign test refutes every number t from first to last; ranks refute the others.

    Members are enough for t: between two neighbours, the counts are at most as unclear as at the later one.
    """
    members = np.concatenate([x, moved])
    t = np.sort(members[(members >= first) & (members <= last)])
    if not len(t):
        return True
    x_later = x >= moved
    both = _below(x[x_later], t, "left") + _below(moved[~x_later], t, "right")
    one_way, other_way = _below(x, t, "left") - both, _below(moved, t, "right") - both
    return bool(np.all(one_way >= _fewest_one_way(len(x), left)[one_way + other_way]))


def _below(numbers: Array, t: Array, side: Literal["left", "right"]) -> NDArray[np.int64]:
    """Return the count of numbers below each of the increasing t, or, with "right", of numbers not above it."""
    near = np.sort(numbers[(numbers >= t[0]) & (numbers <= t[-1])])
    return np.asarray(np.count_nonzero(numbers < t[0]) + np.searchsorted(near, t, side=side))
