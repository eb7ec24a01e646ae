"""Equivalence of paired samples, on samples whose differences are known."""

import numpy as np
import pytest
from scipy.stats import ttest_1samp

from daebench import BadInput
from daebench.diagnostics import equivalence as module
from daebench.diagnostics.equivalence import equivalence

MARGIN = 0.3


@pytest.fixture(autouse=True)
def fewer_resamples(monkeypatch):
    monkeypatch.setattr(module, "RESAMPLES", 500)


def pair(rng, n, *, shift=0.0, scale=1.0, rare=0.0):
    """Return correlated normal samples, the first shifted, scaled, or with so much added to the mean by few members."""
    common = rng.standard_normal(n)
    x, y = (common * 0.8 + 0.6 * rng.standard_normal(n) for _ in range(2))
    return scale * x + shift + rare / 0.02 * (rng.random(n) < 0.02), y


KINDS = {
    "all by the margin": {"shift": MARGIN},
    "quantiles at the ends by the margin": {"scale": 1 + MARGIN / 1.2815515655},
    "the mean alone by the margin": {"rare": MARGIN},
}


def rates(n, count, margin=MARGIN, **made):
    """Return how often each verdict is given."""
    verdicts = [equivalence(*pair(np.random.default_rng(k), n, **made), margin, seed=k).verdict for k in range(count)]
    return {word: verdicts.count(word) / count for word in ("equivalent", "different", "undecided")}


@pytest.mark.parametrize("kind", KINDS)
def test_samples_that_differ_by_the_margin_are_rarely_called_equivalent_or_different(kind):
    found = rates(200, 100, **KINDS[kind])
    assert found["equivalent"] <= 0.1  # 10 of 100 where the level is 5 %: exceeded with probability 0.011 at most
    assert found["different"] <= 0.1


@pytest.mark.slow
def test_the_level_is_held_where_the_mean_alone_is_at_the_margin():
    found = rates(1000, 150, rare=MARGIN)
    assert found["equivalent"] <= 0.1  # 15 of 150 at a level of 5 %: more with probability 0.004
    assert found["different"] <= 0.1


def test_equal_samples_are_equivalent_and_far_ones_different_if_there_are_enough():
    assert rates(1500, 8)["equivalent"] == 1
    assert rates(400, 10, shift=2 * MARGIN)["different"] == 1


def test_too_few_samples_are_undecided_and_say_how_many_are_needed():
    found = equivalence(*pair(np.random.default_rng(0), 50), 2 * MARGIN)
    assert found.verdict == "undecided"
    assert found.needed is not None
    assert 50 < found.needed < 2000
    assert equivalence(*pair(np.random.default_rng(0), 2 * found.needed), 2 * MARGIN).verdict == "equivalent"


def test_the_verdict_on_the_mean_is_that_of_two_one_sided_t_tests():
    rng = np.random.default_rng(5)
    for margin in (0.05, 0.1, 0.2):
        x, y = pair(rng, 150)
        mean = equivalence(x, y, margin).differences[0]
        p = max(
            ttest_1samp(x - y, -margin, alternative="greater").pvalue,
            ttest_1samp(x - y, margin, alternative="less").pvalue,
        )
        assert mean.within(margin) == (p < 0.05)


@pytest.mark.parametrize("tail", [0.05, 0.00625], ids=["near", "far"])
def test_intervals_of_quantiles_cover_the_difference(tail):
    rng, true, hits = np.random.default_rng(2), 0.2, np.zeros(3)
    for seed in range(100):
        x, y = pair(rng, 200, shift=true)
        for k, d in enumerate(equivalence(x, y, 1.0, seed=seed).differences[1:]):
            low, high = (d.low, d.high) if tail == 0.05 else (d.far_low, d.far_high)
            hits[k] += low <= true <= high
    assert np.all(hits / 100 > 1 - 2 * tail - 0.1)


@pytest.mark.parametrize(
    ("x", "y", "margin", "level", "sentence"),
    [
        (np.zeros(8), np.zeros(8), 1.0, 0.05, "at least 32"),
        (np.full(40, np.nan), np.zeros(40), 1.0, 0.05, "finite"),
        (np.zeros(40), np.zeros(40), 0.0, 0.05, "margin"),
        (np.zeros(40), np.zeros(40), 1.0, 0.7, "between 0 and 0.5"),
    ],
    ids=["few", "not finite", "no margin", "no level"],
)
def test_what_cannot_be_tested_is_refused(x, y, margin, level, sentence):
    with pytest.raises(BadInput, match=sentence):
        equivalence(x, y, margin, level=level)
