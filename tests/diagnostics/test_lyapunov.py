"""Exponents, MEGNO and verdicts, on growth whose answer is known."""

import numpy as np
import pytest

from daebench.diagnostics.lyapunov import exponents, mean_megno

INTERVAL, COUNT = 0.1, 1000
t = INTERVAL * np.arange(COUNT + 1)


def growth_of(log_delta):
    return np.diff(np.atleast_2d(log_delta), axis=1)


def noisy(rate, n, memory, size, count=COUNT, seed=0):
    """Return growth of a mean rate with correlated noise: an autoregressive process, whose correlations last 1 / (1 - memory) intervals."""
    rng = np.random.default_rng(seed)
    noise, last = np.empty((n, count)), rng.standard_normal(n) / np.sqrt(1 - memory**2)
    for k in range(count):
        last = memory * last + rng.standard_normal(n)
        noise[:, k] = last
    return INTERVAL * (rate + size * noise)


def test_growth_in_proportion_to_time_has_megno_two_and_is_regular():
    """A vector that is bounded has zero."""
    for log_delta, megno in ((np.log(0.1 + t), 2), (0.5 * np.sin(3 * t), 0)):
        found = exponents(growth_of(log_delta), INTERVAL)
        assert found.megno[0] == pytest.approx(megno, abs=0.1)
        assert (found.verdict[0], found.low[0]) == ("regular", 0)


def test_exponential_growth_has_megno_of_half_lambda_t_and_is_chaotic():
    rate = 0.7
    mean = mean_megno(growth_of(rate * t))
    np.testing.assert_allclose(mean[0, -1], rate * t[-1] / 2, rtol=0.01)
    found = exponents(growth_of(rate * t), INTERVAL)
    assert found.verdict[0] == "chaotic"
    assert found.exponent[0] == pytest.approx(rate, rel=1e-12)


def test_growth_not_known_to_the_end_has_no_verdict():
    growth = growth_of(0.7 * t)
    growth[0, -1] = np.nan
    found = exponents(growth, INTERVAL)
    assert found.verdict[0] == ""
    assert np.isnan(found.exponent[0])


def test_nineteen_of_twenty_intervals_have_the_exponent_in_them():
    found = exponents(noisy(0.5, 2000, 0.8, 0.5), INTERVAL)
    covered = np.mean((found.low <= 0.5) & (found.high >= 0.5))
    assert 0.93 < covered < 0.97


@pytest.mark.parametrize("power", [0, 1, 2], ids=lambda power: f"power {power}")
def test_powers_of_time_with_oscillations_are_never_chaotic(power):
    rng = np.random.default_rng(1)
    rate, size, phase = rng.uniform(0.5, 6, (500, 1)), rng.uniform(0, 1, (500, 1)), rng.uniform(0, 6.28, (500, 1))
    found = exponents(growth_of(power * np.log1p(t / rate) + size * np.sin(rate * t + phase)), INTERVAL)
    assert not np.any(found.verdict == "chaotic")
    if power < 2:
        assert np.mean(found.verdict == "regular") > 0.98


@pytest.mark.parametrize(
    ("folds", "chaotic", "regular"), [(10, 0.25, 0.2), (20, 0.85, 0.005), (30, 0.99, 0.0)], ids=["10 folds", "20 folds", "30 folds"]
)
def test_noisy_exponents_are_found_at_the_rates_that_are_stated(folds, chaotic, regular):
    found = exponents(noisy(folds / t[-1], 2000, 0.8, 0.3), INTERVAL)
    assert np.mean(found.verdict == "chaotic") >= chaotic
    assert np.mean(found.verdict == "regular") <= regular
