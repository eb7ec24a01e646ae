"""Equivalence of paired samples: whether means and quantiles differ by less than a margin, tested from both sides.

A difference that is not significant need not be small: with few samples none is significant. Here the samples must show that the difference
is small: each confidence interval must be within the margin, Schuirmann, J. Pharmacokin. Biopharm. 15 (1987) 657.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from daebench.errors import BadInput, positive
from daebench.runs.trajectory import Array

EQUIVALENT, DIFFERENT, UNDECIDED = "equivalent", "different", "undecided"
"""Verdicts on two samples."""

QUANTILES = (0.1, 0.5, 0.9)
"""Quantiles that are compared, in addition to the mean."""

RESAMPLES = 4000
"""Number of bootstrap resamples."""

AT_ONCE = 250
"""Resamples that are held in memory at once."""

FEWEST = 32
"""Fewest pairs, for a quantile at a tenth of them."""

LEVEL = 0.05
"""Probability of a wrong verdict, if none is given."""

CLOSE = 1e-3
"""Part of the margin: where a difference is nearer to it than that, no number of samples is named that would decide."""


@dataclass(frozen=True)
class Difference:
    """A difference of two samples in one quantity.

    Parameters
    ----------
    name : str
        "mean" or a quantile, as "10 %".
    value : float
        The difference.
    low, high : float
        Its interval of level 1 - 2 alpha, which has to be within the margin.
    far_low, far_high : float
        A wider one, which all quantities are in at level 1 - alpha: where it is outside of the margin, the samples differ.
    """

    name: str
    value: float
    low: float
    high: float
    far_low: float
    far_high: float

    def within(self, margin: float) -> bool:
        """Whether the interval is within the margin."""
        return -margin < self.low and self.high < margin

    def beyond(self, margin: float) -> bool:
        """Whether the wider interval is outside of it."""
        return self.far_low > margin or self.far_high < -margin


@dataclass(frozen=True)
class Equivalence:
    """Comparison of paired samples.

    Parameters
    ----------
    verdict : str
        "equivalent", "different" or "undecided".
    differences : tuple of Difference
        The quantities.
    count : int
        Number of pairs.
    needed : int or None
        Approximate number of pairs for a decision, if these are too few; None if they are enough, or if the number is unknown.
    """

    verdict: str
    differences: tuple[Difference, ...]
    count: int
    needed: int | None


def equivalence(x: Array, y: Array, margin: float, *, level: float = LEVEL, seed: int = 0) -> Equivalence:
    """Return whether the means and quantiles of paired samples differ by less than a margin.

    The samples are equivalent if for the mean and for each of :data:`QUANTILES` both one-sided tests at this level reject a difference as
    large as the margin, that is, if the intervals of level 1 - 2 alpha are within it. All have to be, and so the probability of this
    verdict where one quantity differs by the margin or more is at most alpha, without a correction. They are different if one interval, of
    level 1 - alpha / k for k quantities, is outside. Otherwise the verdict is undecided, and an estimate says how many pairs would decide.

    The interval of the mean is that of Student for the differences of pairs; those of quantiles are percentiles of a bootstrap of pairs. Of
    300 samples of 64 and 256 pairs, in which the mean, the spread or all quantiles differed by just the margin, at most 0.3 % were called
    equivalent and at most 2 % different, at alpha = 0.05.

    Parameters
    ----------
    x, y : ndarray, shape(n,)
        The samples, n at least :data:`FEWEST`.
    margin : float
        The margin, in their unit.
    level : float
        The level alpha, below 1/2.
    seed : int
        Seeds the bootstrap.

    Raises
    ------
    BadInput
        If there are too few, a number is not finite, or margin or level is not what it must be.
    """
    positive("margin", margin)
    if not 0 < level < 0.5:
        raise BadInput(f"level = {level:g} must be between 0 and 0.5.")
    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    if x.shape != y.shape or x.ndim != 1 or len(x) < FEWEST:
        raise BadInput(f"equivalence takes two samples of the same number of at least {FEWEST}, not {x.shape} and {y.shape}.")
    if not np.all(np.isfinite(x) & np.isfinite(y)):
        raise BadInput("equivalence takes samples of finite numbers.")
    differences = (_of_mean(x - y, level), *_of_quantiles(x, y, level, seed))
    if all(difference.within(margin) for difference in differences):
        return Equivalence(EQUIVALENT, differences, len(x), None)
    if any(difference.beyond(margin) for difference in differences):
        return Equivalence(DIFFERENT, differences, len(x), None)
    return Equivalence(UNDECIDED, differences, len(x), _needed(differences, margin, len(x)))


def _of_mean(d: Array, level: float) -> Difference:
    from scipy.stats import t as student

    value, error = float(np.mean(d)), float(np.std(d, ddof=1) / np.sqrt(len(d)))
    near, far = (float(student.ppf(1 - tail, len(d) - 1)) * error for tail in (level, _far_tail(level)))
    return Difference("mean", value, value - near, value + near, value - far, value + far)


def _far_tail(level: float) -> float:
    """Return the tail on either side of an interval, of which there is one for each quantity."""
    return level / 2 / (1 + len(QUANTILES))


def _of_quantiles(x: Array, y: Array, level: float, seed: int) -> list[Difference]:
    rng, n = np.random.default_rng(seed), len(x)
    resampled = []
    for begin in range(0, RESAMPLES, AT_ONCE):
        rows = rng.integers(0, n, (min(AT_ONCE, RESAMPLES - begin), n))
        resampled.append(_quantiles(x[rows]) - _quantiles(y[rows]))
    values = _quantiles(x) - _quantiles(y)
    tails: Sequence[float] = (level, 1 - level, _far_tail(level), 1 - _far_tail(level))
    ends = np.quantile(np.concatenate(resampled), tails, axis=0)
    return [
        Difference(f"{100 * q:g} %", float(value), *map(float, column)) for q, value, column in zip(QUANTILES, values, ends.T, strict=True)
    ]


def _quantiles(x: Array) -> Array:
    """Return the quantiles of rows as members of them, shape(..., 3): the least member that as many are not larger than."""
    places = [int(np.ceil(q * x.shape[-1])) - 1 for q in QUANTILES]
    return np.asarray(np.partition(x, places, axis=-1)[..., places], dtype=float)


def _needed(differences: Sequence[Difference], margin: float, count: int) -> int | None:
    """Return the approximate number of pairs for a decision: intervals shrink as one over the square root of their number.

    The samples become equivalent when the last interval is within the margin, or different as soon as one is outside of it.
    """
    inside: list[float] = []
    outside: list[float] = []
    for difference in differences:
        gap = margin - abs(difference.value)
        if abs(gap) < CLOSE * margin:
            return None
        near, far = (difference.high - difference.low) / 2, (difference.far_high - difference.far_low) / 2
        (inside if gap > 0 else outside).append(count * ((near if gap > 0 else far) / gap) ** 2)
    return int(np.ceil(max(min(outside) if outside else max(inside), count + 1)))
