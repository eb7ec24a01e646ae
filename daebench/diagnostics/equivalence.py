"""Equivalence of paired samples: whether means and quantiles differ by less than a margin, tested from both sides.

A difference that is not significant need not be small: with few samples none is significant. Here the samples must show that the difference
is small: each confidence interval must be within the margin, Schuirmann, J. Pharmacokin. Biopharm. 15 (1987) 657.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from daebench.diagnostics.quantile_shift import ROUNDED, fewest, quantile, shift_bounds
from daebench.errors import BadInput, positive
from daebench.runs.trajectory import Array
from daebench.systems.lazily import scipy

EQUIVALENT, DIFFERENT, UNDECIDED = "equivalent", "different", "undecided"
"""Verdicts on two samples."""

QUANTILES = (0.1, 0.5, 0.9)
"""Quantiles that are compared, in addition to the mean."""

FEWEST = 32
"""Fewest pairs; quantiles take more for an interval, see :func:`daebench.diagnostics.quantile_shift.fewest`."""

LEVEL = 0.05
"""Probability of a wrong verdict, if none is given."""

SYMMETRIC = 1e-6
"""Modulus of a skewness below which differences are symmetric."""

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
    fewest : int
        Number of pairs from which every quantile has an interval at this level; with fewer, samples are never equivalent.
    needed : int or None
        Number of pairs for a decision, if these are too few: ``fewest`` or, about, more; None if they are enough, or if it is unknown.
    """

    verdict: str
    differences: tuple[Difference, ...]
    count: int
    fewest: int
    needed: int | None

    @property
    def lacking(self) -> str:
        """Why a comparison is undecided, as a sentence with the number of pairs; "" where it is decided."""
        if self.verdict != UNDECIDED:
            return ""
        decides = f"about {self.needed} members would decide" if self.needed else "the difference is the margin within rounding"
        if self.count >= self.fewest:
            return decides
        without = " and ".join(d.name for d in self.differences if not np.isfinite(d.high))
        least = f"of {self.count} members the quantiles of {without} have no exact interval, which takes {self.fewest} members"
        return least if self.needed == self.fewest else f"{least}; {decides}"


def equivalence(x: Array, y: Array, margin: float, *, level: float = LEVEL, seed: int = 0) -> Equivalence:
    """Return whether the means and quantiles of paired samples differ by less than a margin.

    The samples are equivalent if for the mean and for each of :data:`QUANTILES` both one-sided tests at this level reject a difference as
    large as the margin, that is, if the intervals of level 1 - 2 alpha are within it. All have to be, and so the probability of this
    verdict where one quantity differs by the margin or more is at most alpha, without a correction. They are different if one interval, of
    level 1 - alpha / k for k quantities, is outside. Otherwise the verdict is undecided, and it is said how many pairs would decide.

    Intervals of quantiles are exact whatever the distributions are and however the pairs depend on each other, see
    :mod:`daebench.diagnostics.quantile_shift`. Fewer pairs than :func:`daebench.diagnostics.quantile_shift.fewest` have none - 36 for the
    10 % quantile at alpha = 0.05, and 53 at a sixth of it - and are never equivalent. A quantile may be shifted by members within a
    margin of it alone. So the sample must have some of them, about ten, and the margin must not be too small beside the spread, however
    close to each other the members of pairs are.

    The interval of the mean contains that of Student for the differences of pairs and that of Hall, J. R. Stat. Soc. B 54 (1992) 221, which
    corrects it for skewness. Neither is exact, and none can be, Bahadur & Savage, Ann. Math. Stat. 27 (1956) 1115: where a part p of the
    members makes up the mean's difference, n pairs have none of these with the probability (1 - p)^n. With p = 2 % and a margin of two
    standard deviations of the others, 28 % of samples of 64 and 6 % of 128 were called equivalent.

    In 1000 samples, one or all quantities differ by exactly the margin. The percentage that was called equivalent is below, and at most
    0.8 % were called different, at alpha = 0.05:

    ====================================================  ===  ===  ===  ===  ====
    pairs                                                  32   64  128  256  1024
    ====================================================  ===  ===  ===  ===  ====
    all quantiles, or the spread, of normal samples         0    0    0    0     0
    the mean, by 2 % of the members, 0.3 deviations         0    0    0    0   4.4
    10 % quantile alone, at a bend, independent pairs       0  0.1    0  0.2   2.0
    the same, correlated                                    0  0.3  0.3  0.6   2.7
    the same, pairs of the same ranks                       0  0.6  0.7  0.6   1.4
    10 % or 90 % quantile alone, no bend, correlated        0  0.6  2.0  1.9   3.2
    median alone, pairs of the same ranks                   0  1.6  1.0  1.1   1.8
    two values, pairs of the same ranks                     0  1.2  1.3  1.1   1.8
    10 % quantile alone, no variance, same ranks            0    0    0    0   2.2
    ====================================================  ===  ===  ===  ===  ====

    Of 60 pairs of samples of 1024 without a difference all were equivalent at a margin of half a standard deviation, with correlations of
    0, 0.64 and 0.99, at alpha and at a sixth of it; where they differed by twice the margin, all were different.

    Parameters
    ----------
    x, y : ndarray, shape(n,)
        The samples, n at least :data:`FEWEST`.
    margin : float
        The margin, in their unit.
    level : float
        The level alpha, below 1/2.
    seed : int
        Ignored: no random numbers are drawn.

    Raises
    ------
    BadInput
        If there are too few pairs, a number is not finite, or margin or level is out of range.
    """
    positive("margin", margin)
    if not 0 < level < 0.5:
        raise BadInput(f"level = {level:g} must be between 0 and 0.5.", "level-out-of-range")
    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    if x.shape != y.shape or x.ndim != 1 or len(x) < FEWEST:
        raise BadInput(
            f"equivalence takes two samples of one size of at least {FEWEST}, not {x.shape} and {y.shape}.",
            "samples-differ-in-size",
        )
    if not np.all(np.isfinite(x) & np.isfinite(y)):
        raise BadInput("equivalence takes samples of finite numbers.", "samples-not-finite")
    differences = (_of_mean(x - y, level), *(_of_quantile(x, y, q, level) for q in QUANTILES))
    least = max(fewest(q, level) for q in QUANTILES)
    if all(difference.within(margin) for difference in differences):
        return Equivalence(EQUIVALENT, differences, len(x), least, None)
    if any(difference.beyond(margin) for difference in differences):
        return Equivalence(DIFFERENT, differences, len(x), least, None)
    needed = _needed(differences, margin, x - y)
    return Equivalence(UNDECIDED, differences, len(x), least, max(least, needed or 0) if len(x) < least else needed)


def _of_mean(d: Array, level: float) -> Difference:
    return Difference("mean", float(np.mean(d)), *_mean_bounds(d, level), *_mean_bounds(d, _far_tail(level)))


def _mean_bounds(d: Array, tail: float) -> tuple[float, float]:
    """Return the farther ends of two intervals of a mean: that of Student and that of Hall, which corrects it for skewness."""
    n, value, deviation, rounding = len(d), float(np.mean(d)), float(np.std(d)), ROUNDED * float(np.max(np.abs(d)))
    skewness = float(np.mean(((d - value) / deviation) ** 3)) if deviation > rounding else 0.0
    # n - 1 here and no correction in ``deviation``: together they are the standard error of the mean with the unbiased variance.
    error, beyond = deviation / (n - 1) ** 0.5, float(scipy.stats.t.ppf(1 - tail, n - 1))
    ends = [beyond, -beyond, *(_unskewed(t, skewness, n) for t in (beyond, -beyond) if abs(skewness) > SYMMETRIC)]
    # The farther ends of both intervals: neither is exact, and a wider interval can only delay a verdict.
    return value - max(ends) * error - rounding, value - min(ends) * error + rounding


def _unskewed(t: float, skewness: float, n: int) -> float:
    """Return the number of standard errors that Student's t becomes by Hall's cubic transformation."""
    a = skewness / 3
    return float(n**0.5 / a * (np.cbrt(1 + 3 * a * (t / n**0.5 - skewness / (6 * n))) - 1))


def _of_quantile(x: Array, y: Array, q: float, level: float) -> Difference:
    value = quantile(np.sort(x), q) - quantile(np.sort(y), q)
    return Difference(f"{100 * q:g} %", value, *shift_bounds(x, y, q, level), *shift_bounds(x, y, q, _far_tail(level)))


def _far_tail(level: float) -> float:
    """Return the tail on either side of an interval, of which there is one for each quantity."""
    # Bonferroni: one interval outside of the margin decides, so that the levels of all of them add up.
    return level / 2 / (1 + len(QUANTILES))


def _needed(differences: Sequence[Difference], margin: float, d: Array) -> int | None:
    """Return the approximate number of pairs for a decision, given the differences d of these pairs.

    The samples become equivalent when the last interval is within the margin, or different as soon as one is outside of it. An interval of
    half width w shrinks to the gap g between the difference and the margin in as many pairs as ::

        n (w / g)^2                        for the mean
        n (w / g)^2 (s + g) / (s + w)      for a quantile,

    where s is the mean distance of the differences of pairs from that of the quantiles. The sign test has to see the part of pairs within g
    of the quantile, which is proportional to g, against the part on two sides of it, which is proportional to s.
    """
    # The number of pairs grows as the inverse square of the gap, which is unknown within rounding.
    if any(abs(margin - abs(difference.value)) < CLOSE * margin for difference in differences):
        return None
    inside: list[float] = [0.0]
    outside: list[float] = []
    for difference in differences:
        apart = None if difference.name == "mean" else float(np.mean(np.abs(d - difference.value)))
        numbers = [len(d) * _factor(width, gap, apart) for width, gap in _to_shrink(difference, margin) if np.isfinite(width)]
        (inside if abs(difference.value) < margin else outside).extend(numbers)
    return int(np.ceil(max(min(outside) if outside else max(inside), len(d) + 1)))


def _to_shrink(difference: Difference, margin: float) -> Iterator[tuple[float, float]]:
    """Yield the width of the interval on each relevant side of the difference, and the distance of the margin on that side."""
    value = difference.value
    if abs(value) < margin:
        yield difference.high - value, margin - value
        yield value - difference.low, margin + value
    else:
        yield (value - difference.far_low if value > 0 else difference.far_high - value), abs(value) - margin


def _factor(width: float, gap: float, apart: float | None) -> float:
    """Return by which factor more pairs are needed for a width to become the gap, see :func:`_needed`."""
    return (width / gap) ** 2 * (1 if apart is None else (apart + gap) / (apart + width))
