"""Equivalence of paired samples, on samples whose differences are known by construction."""

from collections import Counter

import numpy as np
import pytest
from refusals import refused
from scipy.stats import binom, ttest_1samp
from shifted_pairs import FAMILIES, bent, normal

from daebench.diagnostics import equivalence as module
from daebench.diagnostics.equivalence import equivalence

LEVEL = 0.05

OF_A_SEARCH = LEVEL / 6
"""Level of one test of a search over six step sizes."""


def told(pairs, n, count, *, margin=None, level=LEVEL):
    """Return how often each verdict is given."""
    samples = (pairs.draw(np.random.default_rng([n, k]), n) for k in range(count))
    return Counter(equivalence(x, y, margin or pairs.margin, level=level).verdict for x, y in samples)


def most(count, level=LEVEL):
    """Return the number of wrong verdicts that a test at its level exceeds with a probability of 1e-4 at most."""
    return int(binom.isf(1e-4, count, level))


@pytest.mark.sampled(by=lambda case: case in [*FAMILIES][::4])
@pytest.mark.parametrize("family", FAMILIES.values(), ids=FAMILIES)
def test_samples_that_differ_by_the_margin_are_rarely_called_equivalent_or_different(family):
    found = told(family, 64, 12)
    assert found["equivalent"] <= most(12)
    assert found["different"] <= most(12)
    assert told(family, 32, 2)["equivalent"] == 0  # an interval takes 36


@pytest.mark.exhaustive
@pytest.mark.parametrize("n", [32, 64, 128, 256, 1024])
@pytest.mark.parametrize("family", FAMILIES.values(), ids=FAMILIES)
def test_the_level_is_held_in_all_families(family, n):
    found = told(family, n, 200)
    assert found["equivalent"] <= most(200)
    assert found["different"] <= most(200)


@pytest.mark.exhaustive
@pytest.mark.parametrize("n", [53, 128])
def test_the_level_of_a_search_is_held(n):
    family = bent(0.1, 5, 5, 0.8)
    assert told(family, n, 600, level=OF_A_SEARCH)["equivalent"] <= most(600, OF_A_SEARCH)


@pytest.mark.sampled(by=lambda case: case in ("a test-0.64", "one of six-0"))
@pytest.mark.parametrize("correlation", [0, 0.64, 0.99])
@pytest.mark.parametrize("level", [LEVEL, OF_A_SEARCH], ids=["a test", "one of six"])
def test_1024_equal_samples_are_equivalent_within_half_a_deviation_and_twice_the_margin_is_seen(correlation, level):
    """Nine in ten and 95 in 100 are asked for: 10 of 10 where it is nine in ten have a probability of a third, 8 of 10 one of 0.07."""
    assert told(normal(0.5, correlation=correlation), 1024, 10, level=level)["equivalent"] >= 9
    assert told(normal(0.5, shift=1.0, correlation=correlation), 1024, 10, level=level)["different"] >= 9


@pytest.mark.exhaustive
@pytest.mark.parametrize("correlation", [0, 0.64])
def test_the_power_of_1024_members(correlation):
    assert told(normal(0.5, correlation=correlation), 1024, 100)["equivalent"] >= 95
    assert told(normal(0.5, shift=1.0, correlation=correlation), 1024, 100)["different"] >= 98


@pytest.mark.parametrize("count", [35, 36, 52, 53])
@pytest.mark.parametrize(("level", "fewest"), [(LEVEL, 36), (OF_A_SEARCH, 53)], ids=["a test", "one of six"])
def test_without_an_exact_interval_the_verdict_is_undecided_and_names_the_number(count, level, fewest):
    x = np.random.default_rng(count).standard_normal(count)
    found = equivalence(x, x, 1e6, level=level)
    enough = count >= fewest
    known = ("equivalent", None, True) if enough else ("undecided", fewest, False)
    assert (found.fewest, found.verdict, found.needed, not found.lacking) == (fewest, *known)
    assert [d.name for d in found.differences if not np.isfinite(d.high)] == ([] if enough else ["10 %", "90 %"])
    assert all(part in found.lacking for part in ([] if enough else [f"{count} members", f"{fewest} members"]))


def test_where_more_than_the_fewest_are_needed_both_numbers_are_named():
    found = equivalence(*normal().draw(np.random.default_rng(0), 32), 0.6)
    assert found.needed > 36
    assert all(f"{number} members" in found.lacking for number in (36, found.needed))


@pytest.mark.parametrize("correlation", [0, 0.8, 0.9999])
def test_the_number_that_is_named_decides_whether_pairs_are_close_or_not(correlation):
    """A quarter of it decides less often than not, and twice as many nearly always."""
    pairs = normal(0.6, correlation=correlation)
    found = equivalence(*pairs.draw(np.random.default_rng(1), 64), 0.6)
    assert found.verdict == "undecided"
    assert told(pairs, 2 * found.needed, 10)["equivalent"] >= 8
    assert told(pairs, max(36, found.needed // 4), 10)["equivalent"] <= 7


def test_the_difference_that_is_the_margin_within_rounding_names_no_number():
    y = np.arange(64.0)
    found = equivalence(y + 3, y, 3.0)
    assert (found.verdict, found.needed, "rounding" in found.lacking) == ("undecided", None, True)


def test_the_interval_of_the_mean_is_that_of_student_or_wider():
    rng = np.random.default_rng(5)
    for margin in (0.05, 0.1, 0.2):
        x, y = normal().draw(rng, 150)
        mean = equivalence(x, y, margin).differences[0]
        p = max(
            ttest_1samp(x - y, -margin, alternative="greater").pvalue,
            ttest_1samp(x - y, margin, alternative="less").pvalue,
        )
        assert mean.within(margin) == (p < LEVEL)
    skew = np.exp(rng.standard_normal(100))
    ends = ttest_1samp(skew, 0).confidence_interval(1 - 2 * LEVEL)
    mean = equivalence(skew, np.zeros(100), 1.0).differences[0]
    assert mean.low == pytest.approx(ends.low, rel=1e-12)
    assert mean.high > 1.03 * ends.high


def test_the_mean_of_a_skew_distribution_is_below_its_bound_about_as_often_as_the_level_says():
    """Student's bound on the mean of a fiftieth of the members misses it in 8 of 100 samples of 1024; this is one of 400 samples."""
    wrong = 0
    for k in range(400):
        rng = np.random.default_rng(k)
        d = 0.85 * rng.standard_normal(1024) + 15 * (rng.random(1024) < 0.02)
        wrong += module._of_mean(d, LEVEL).high < 0.3
    assert wrong <= most(400, 0.055)


@pytest.mark.parametrize(
    ("x", "margin", "level", "code"),
    [
        (np.zeros(8), 1.0, 0.05, "samples-differ-in-size"),
        (np.full(40, np.nan), 1.0, 0.05, "samples-not-finite"),
        (np.zeros(40), 0.0, 0.05, "not-positive"),
        (np.zeros(40), 1.0, 0.7, "level-out-of-range"),
    ],
    ids=["few", "not finite", "no margin", "no level"],
)
def test_what_cannot_be_tested_is_refused(x, margin, level, code):
    with refused(code):
        equivalence(x, np.zeros(len(x)), margin, level=level)
