"""Pairs of samples whose quantiles or means differ by exactly the margin, by construction; n of them are drawn independently.

Where one quantile alone differs, the quantile functions of x and y are given, and equal elsewhere: the true difference needs no estimate.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm
from scipy.stats import t as student

Array = NDArray[np.float64]

AROUND = 0.09
"""Ranks on either side of a quantile over which it differs."""

RARE = 0.02
"""Part of the members that make up the mean's difference where no quantile differs by as much."""


@dataclass(frozen=True)
class Pairs:
    """A family of samples, and by how much they differ."""

    draw: Callable[[np.random.Generator, int], tuple[Array, Array]]
    margin: float


def ranks(rng: np.random.Generator, n: int, correlation: float) -> tuple[Array, Array]:
    """Return uniform numbers whose normal scores have a correlation; with 1 they are the same."""
    first, other = rng.standard_normal((2, n))
    u = norm.cdf(first)
    return u, u if correlation == 1 else norm.cdf(correlation * first + np.sqrt(1 - correlation**2) * other)


def normal(margin: float = 0.3, *, shift: float = 0.0, scale: float = 1.0, rare: float = 0.0, correlation: float = 0.64) -> Pairs:
    """Return normal samples, the first shifted, scaled, or with so much added to the mean by few members."""

    def draw(rng: np.random.Generator, n: int) -> tuple[Array, Array]:
        y, own = rng.standard_normal((2, n))
        x = correlation * y + np.sqrt(1 - correlation**2) * own
        return scale * x + shift + rare / RARE * (rng.random(n) < RARE), y

    return Pairs(draw, margin)


def bent(q: float, below: float, above: float, correlation: float) -> Pairs:
    """Return samples whose quantile of order q alone differs: quantile functions of two slopes beside it, the first moved up or down there.

    It is moved to the side on which members are rarer, where there is one.
    """
    at = above * AROUND / 4 if above > below else -below * AROUND / 4 if below > above else 0.999 * above * AROUND
    ends = [-below * AROUND, above * AROUND]

    def values(u: Array, middle: float) -> Array:
        levels = [ends[0] - 0.5 * q, ends[0], middle, ends[1], ends[1] + 0.5 * (1 - q)]
        return np.interp(u, [0, q - AROUND, q, q + AROUND, 1], levels)

    def draw(rng: np.random.Generator, n: int) -> tuple[Array, Array]:
        u, v = ranks(rng, n, correlation)
        return values(u, at), values(v, 0.0)

    return Pairs(draw, abs(at))


def two_values(q: float, correlation: float) -> Pairs:
    """Return samples of zeros and ones: the quantile of order q is 1 of the first, and 0 of the second, which has few zeros more."""

    def draw(rng: np.random.Generator, n: int) -> tuple[Array, Array]:
        u, v = ranks(rng, n, correlation)
        return np.where(u > q - 1e-3, 1.0, 0.0), np.where(v > q, 1.0, 0.0)

    return Pairs(draw, 1.0)


def rounded(correlation: float, grid: float = 0.25) -> Pairs:
    """Return normal samples that are rounded to a grid, the first shifted by one place of it."""

    def draw(rng: np.random.Generator, n: int) -> tuple[Array, Array]:
        x, y = (np.round(norm.ppf(u) / grid) * grid for u in ranks(rng, n, correlation))
        return x + grid, y

    return Pairs(draw, grid)


def heavy(q: float, correlation: float, freedom: float = 1.5) -> Pairs:
    """Return samples of Student's distribution without a variance: of the first, 3 % of the members from the quantile on are moved up."""
    least, most = (float(student.ppf(rank, freedom)) for rank in (q, q + 0.03))

    def draw(rng: np.random.Generator, n: int) -> tuple[Array, Array]:
        u, v = ranks(rng, n, correlation)
        x, y = student.ppf(u, freedom), student.ppf(v, freedom)
        return np.where((u >= q - 1e-6) & (u < q + 0.03), most, x), y

    return Pairs(draw, most - least)


FAMILIES = {
    "all quantiles": normal(shift=0.3),
    "all quantiles, close pairs": normal(shift=0.3, correlation=0.99),
    "the spread": normal(scale=1 + 0.3 / float(norm.ppf(0.9))),
    "the mean, by a fiftieth of the members": normal(rare=0.3),
    "10 %, sparse above, independent": bent(0.1, 0.2, 20, 0),
    "10 %, sparse above, correlated": bent(0.1, 0.2, 20, 0.8),
    "10 %, sparse above, same ranks": bent(0.1, 0.2, 20, 1),
    "10 %, sparse below, correlated": bent(0.1, 20, 0.2, 0.8),
    "10 %, sparse below, same ranks": bent(0.1, 20, 0.2, 1),
    "10 %, no bend, correlated": bent(0.1, 5, 5, 0.8),
    "50 %, sparse above, same ranks": bent(0.5, 0.2, 20, 1),
    "50 %, no bend, same ranks": bent(0.5, 5, 5, 1),
    "90 %, sparse above, same ranks": bent(0.9, 0.2, 20, 1),
    "90 %, no bend, correlated": bent(0.9, 5, 5, 0.8),
    "ties, two values, independent": two_values(0.1, 0),
    "ties, two values, same ranks": two_values(0.1, 1),
    "ties, a grid": rounded(0.9),
    "heavy tails, 10 %": heavy(0.1, 1),
    "heavy tails, 50 %": heavy(0.5, 0.8),
}
"""Samples that are neither equivalent at the margin, nor more different than it, by what differs."""
