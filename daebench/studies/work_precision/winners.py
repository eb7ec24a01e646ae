"""Which method is the cheapest for an accuracy, counted over many starts, with exact intervals without random numbers."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.runs.trajectory import Array
from daebench.studies.work_precision.starts import Curves
from daebench.studies.work_precision.study import interpolated
from daebench.systems.lazily import pandas as pd
from daebench.systems.lazily import scipy

LEVELS = (1e-3, 1e-6, 1e-9)
"""Accuracies for which methods are ranked."""

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

        >>> from daebench.studies.work_precision.winners import share
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

        >>> from daebench.studies.work_precision.winners import fewest_wins
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
    # Costs may be infinite, and between a finite and an infinite one there is nothing to interpolate.
    value = float(np.quantile(ordered, 0.5, method="inverted_cdf"))
    below = int(scipy.stats.binom.ppf((1 - CONFIDENCE) / 2, n, 0.5))
    if not below:
        return Estimate(value, 0.0, np.inf, n)
    return Estimate(value, float(ordered[below - 1]), float(ordered[n - below]), n)


@dataclass(frozen=True)
class Level:
    """Costs of an accuracy by all methods."""

    level: float
    """The accuracy."""
    prices: dict[str, Array]
    """What it costs by a method from each of its starts, the first of all, s: by interpolation in this start's curve, infinite where it is
    not reached; shape (n,).
    """
    known: NDArray[np.bool_]
    """Starts whose reference is that good; the others are not compared; shape (n,)."""

    def of(self, *methods: str) -> tuple[Array, ...]:
        """Return the costs of some methods from the starts that all of them have, which are compared and which one of them reaches."""
        n = min(len(self.prices[method]) for method in methods)
        prices = np.array([self.prices[method][:n] for method in methods])
        return tuple(prices[:, self.known[:n] & np.isfinite(prices).any(axis=0)])

    def before(self, method: str, other: str) -> tuple[Estimate, Estimate]:
        """Return in which share of starts a method is cheaper than another, ties by halves, and by which factor in the median."""
        first, second = self.of(method, other)
        with np.errstate(divide="ignore"):
            factors = second / first
        return share(float(np.sum(first < second) + np.sum(first == second) / 2), len(first)), median(factors)

    @property
    def ranked(self) -> list[str]:
        """Methods by the median cost of their own starts, without those that do not reach the accuracy from half of these."""
        medians = {name: self.median(name).value for name in self.prices}
        return sorted((name for name, price in medians.items() if np.isfinite(price)), key=medians.__getitem__)

    def median(self, method: str) -> Estimate:
        """Return the median cost of a method from its own starts, s."""
        prices = self.prices[method]
        return median(prices[self.known[: len(prices)]])


def level_of(curves: Sequence[Curves], level: float) -> Level:
    """Return the costs of an accuracy by all methods."""
    prices = {some.method: interpolated(some.errors, some.seconds, level)[0] for some in curves}
    longest = max(curves, key=lambda some: some.starts)
    return Level(level, prices, longest.bound <= level)


def winners(curves: Sequence[Curves], levels: Sequence[float] = LEVELS) -> "pd.DataFrame":
    """Return for each accuracy the methods, the cheapest first, and in how many starts each is before the next."""
    rows: list[dict[str, Any]] = []
    scatter = {some.method: some.scatter for some in curves}
    for level in levels:
        at = level_of(curves, level)
        names = at.ranked
        shared = dict(zip(names, at.of(*names), strict=True)) if names else {}
        least = np.min(list(shared.values()), axis=0) if shared else np.empty(0)
        for name, following in pairwise([*names, ""]):
            row = {"level": level, "method": name, **at.median(name).columns("price")}
            row |= share(float(np.sum(shared[name] == least)), len(least)).columns("cheapest")
            row |= {"of": len(least), "next": following, "left_out": int(np.sum(~at.known))}
            if following:
                before, ratio = at.before(name, following)
                row |= {**before.columns("before"), "starts": before.starts, **ratio.columns("ratio")}
                row["scatter"] = max(scatter[name], scatter[following])
            rows.append(row)
    columns = ["level", "method", "price", "cheapest", "of", "next", "before", "starts", "ratio", "scatter", "left_out"]
    table = pd.DataFrame(rows)
    return table.reindex(columns=[*columns, *(name for name in table.columns if name not in columns)])


def sentences(table: "pd.DataFrame") -> list[str]:
    """Return which method is the cheapest for each accuracy, in how many starts, and by how much, as sentences.

    Where this compares fewer starts than others do, the first of these is said too. A factor that the times scatter by decides nothing,
    which is said.
    """
    said = []
    for level, rows in table.groupby("level", sort=False):
        compared = rows[rows["starts"] > 0]
        at = f"{level:.0e}".replace("e-0", "e-")
        if compared.empty:
            said.append(f"{at}: {rows['method'].iloc[0]}; no other method reaches it from more than half of the starts")
            continue
        first, most = compared.iloc[0], compared.iloc[int(compared["starts"].argmax())]
        said += [f"{at}: {_before(row)}" for row in (first, most)[: 1 + (first["starts"] < most["starts"])]]
        if first["left_out"]:
            said.append(f"{at}: {first['left_out']} starts are not compared, because their references are not accurate enough")
    return said


def _before(row: "pd.Series[Any]") -> str:
    """Return how a method is before the next, in words."""
    shares = [f"{100 * row[name]:.3g}" for name in ("before", "before_low", "before_high")]
    words = f"{row['method']} before {row['next']} in {shares[0]} % of {row['starts']:.0f} starts [{shares[1]} to {shares[2]}]"
    words += f", which costs {row['ratio']:.3g} times as much [{row['ratio_low']:.3g} to {row['ratio_high']:.3g}]"
    within = 1 / (1 + row["scatter"]) <= row["ratio"] <= 1 + row["scatter"]
    return f"{words}: undecided, because times scatter by {100 * row['scatter']:.2g} %" if within else words
