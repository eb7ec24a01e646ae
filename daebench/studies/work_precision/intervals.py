"""How sure shares and medians over starts are: exact intervals, without random numbers."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from daebench.runs.trajectory import Array
from daebench.systems.lazily import scipy

CONFIDENCE = 0.95
"""Least part of studies whose intervals contain what all starts would say."""


@dataclass(frozen=True)
class Estimate:
    """A number that is estimated from starts, and its interval."""

    value: float
    low: float
    high: float
    """The estimate and the ends of its interval."""
    starts: int
    """Number of starts."""

    def columns(self, name: str) -> dict[str, float]:
        """Return the three numbers as columns of a table."""
        return {name: self.value, f"{name}_low": self.low, f"{name}_high": self.high}


def share(wins: float, starts: int) -> Estimate:
    """Return the share of starts in which something holds, with its exact interval.

    Clopper and Pearson (1934): the shares of all starts at which so many wins, or more, and so many or fewer are not improbable. The
    percentile bootstrap over the starts has nearly the same ends where there are many of both kinds; where it holds in all of a few starts
    it leaves no doubt, and with 16 starts covers too seldom. NaN without a start::

        >>> from daebench.studies.work_precision.intervals import share
        >>> estimate = share(70, 100)
        >>> round(estimate.value, 2), round(estimate.low, 2), round(estimate.high, 2)
        (0.7, 0.6, 0.79)
    """
    if not starts:
        return Estimate(np.nan, np.nan, np.nan, 0)
    tail = (1 - CONFIDENCE) / 2
    low = float(scipy.stats.beta.ppf(tail, wins, starts - wins + 1)) if wins > 0 else 0.0
    high = float(scipy.stats.beta.ppf(1 - tail, wins + 1, starts - wins)) if wins < starts else 1.0
    return Estimate(wins / starts, low, high, starts)


@cache
def fewest_wins(part: float, starts: int) -> int:
    """Return the least number of wins whose interval, see :func:`share`, is not below a share of all starts; all of too few starts.

    ::

        >>> from daebench.studies.work_precision.intervals import fewest_wins
        >>> fewest_wins(0.95, 72), fewest_wins(0.95, 128), fewest_wins(0.95, 16)
        (72, 127, 16)
    """
    wins = starts
    while wins and share(wins - 1, starts).low >= part:
        wins -= 1
    return wins


def median(values: Array) -> Estimate:
    """Return the median of numbers, which may be infinite, with its distribution-free interval.

    The interval lies between two order statistics: how many of n numbers are below the median of all is binomial. Of fewer than six
    numbers none has this confidence, and the interval is unbounded.

    Shapes: values (n,).
    """
    n = len(values)
    if not n:
        return Estimate(np.nan, np.nan, np.nan, 0)
    ordered = np.sort(values)
    value = float(np.quantile(ordered, 0.5, method="inverted_cdf"))
    below = int(scipy.stats.binom.ppf((1 - CONFIDENCE) / 2, n, 0.5))
    if not below:
        return Estimate(value, 0.0, np.inf, n)
    return Estimate(value, float(ordered[below - 1]), float(ordered[n - below]), n)
