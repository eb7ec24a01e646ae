"""Bounds on the shift of a quantile: by exact sums of binomial terms, by hand on few numbers, and how often they are wrong."""

from fractions import Fraction
from math import comb

import numpy as np
import pytest
from scipy.stats import binom
from shifted_pairs import bent, two_values

from daebench.diagnostics.quantile_shift import fewest, quantile, ranks, shift_bounds

LEVELS = {"of a test": 0.05, "of one of six": 0.05 / 6, "small": 1e-4}


@pytest.mark.parametrize("level", LEVELS.values(), ids=LEVELS)
@pytest.mark.parametrize("q", [0.1, 0.25, 0.5, 0.9])
def test_the_fewest_members_are_the_first_of_which_both_ends_of_a_quantile_have_an_interval(q, level):
    """At half of the level each: that all are above the quantile, or that all are below it, is to be improbable enough."""
    n = fewest(q, level)
    for count, enough in ((n, True), (n - 1, False)):
        assert (max(binom.pmf(0, count, q), binom.pmf(count, count, q)) <= level / 2) == enough
        assert (ranks(count, q, level) is not None) == enough


@pytest.mark.parametrize("n", [36, 53, 64, 200])
@pytest.mark.parametrize("q", [Fraction(1, 10), Fraction(1, 2), Fraction(9, 10)], ids=["10 %", "50 %", "90 %"])
def test_the_levels_of_the_ranks_and_of_the_sign_test_add_up_to_the_whole(q, n):
    limits = ranks(n, float(q), 0.05)
    terms = [comb(n, k) * q**k * (1 - q) ** (n - k) for k in range(n + 1)]
    from_above, up_to_below = sum(terms[limits.above :]), sum(terms[: limits.below + 1])
    assert float(from_above + up_to_below) + limits.left == pytest.approx(0.05, abs=1e-12)
    for tail, more in ((from_above, terms[limits.above - 1]), (up_to_below, terms[limits.below + 1])):
        assert tail <= Fraction(1, 80) < tail + more or Fraction(1, 80) < tail <= Fraction(1, 40)


def test_by_hand_of_seven_pairs_the_ranks_alone_bound_the_median_by_the_ends():
    """At 1/128 each, all of seven numbers on one side refute a median, and nothing is left of 1/64 for the sign test."""
    x, y = np.array([1.0, 2, 3, 4, 5, 6, 7]), np.array([11.0, 12, 13, 14, 15, 16, 17])
    assert ranks(7, 0.5, 1 / 64).above == 7
    assert ranks(7, 0.5, 1 / 64).below == 0
    low, high = shift_bounds(x, y, 0.5, 1 / 64)
    assert (low, high) == pytest.approx((1 - 17, 7 - 11), abs=1e-12)


def test_pairs_that_are_close_to_each_other_have_closer_bounds_than_their_ranks_alone():
    y = np.random.default_rng(3).standard_normal(1024)
    x, limits = y + 0.01, ranks(1024, 0.5, 0.05)
    low, high = shift_bounds(x, y, 0.5, 0.05)
    by_ranks = np.sort(x)[limits.above - 1] - np.sort(y)[limits.below]
    assert -0.03 < low < 0.01 < high < 0.05
    assert by_ranks > 0.15


def test_bounds_move_with_the_sample_and_change_sides_with_it():
    rng = np.random.default_rng(4)
    x, y = rng.standard_normal((2, 100))
    low, high = shift_bounds(x, y, 0.5, 0.05)
    assert shift_bounds(x + 8, y, 0.5, 0.05) == pytest.approx((low + 8, high + 8), abs=1e-9)
    assert shift_bounds(y, x, 0.5, 0.05) == (-high, -low)
    assert shift_bounds(-x, -y, 0.1, 0.05) == pytest.approx(tuple(-b for b in shift_bounds(x, y, 0.9, 0.05))[::-1], abs=1e-4)
    assert shift_bounds(np.zeros(100), np.zeros(100), 0.5, 0.05) == (0, 0)


def test_fewer_members_than_the_fewest_have_no_bound():
    assert shift_bounds(np.arange(35.0), np.arange(35.0), 0.1, 0.05) == (-np.inf, np.inf)
    assert np.all(np.isfinite(shift_bounds(np.arange(36.0), np.arange(36.0), 0.1, 0.05)))


def test_a_quantile_is_the_least_member_that_a_part_is_not_larger_than():
    for n in (10, 30, 70, 110):  # 0.1 * 70 is more than 7 in floating point
        assert quantile(np.arange(n), 0.1) == n // 10 - 1
    assert quantile(np.arange(11), 0.1) == 1


CASES = {"no bend": bent(0.1, 5, 5, 0.8), "sparse below": bent(0.1, 20, 0.2, 1), "two values": two_values(0.1, 1)}


@pytest.mark.sampled(by=lambda case: case.startswith("53"))
@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
@pytest.mark.parametrize("n", [53, 128])
def test_each_bound_is_wrong_at_most_as_often_as_its_level(case, n):
    true = case.margin * (-1 if case is CASES["sparse below"] else 1)
    bounds = np.array([shift_bounds(*case.draw(np.random.default_rng([n, k]), n), 0.1, 0.1) for k in range(150)])
    most = binom.isf(1e-4, 150, 0.1)
    assert np.count_nonzero(bounds[:, 0] > true) <= most
    assert np.count_nonzero(bounds[:, 1] < true) <= most
