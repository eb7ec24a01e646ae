"""Verdicts and laws of errors made by known rules: no mean that moves is bounded, and the intervals of laws hold the truth as promised."""

from collections import Counter

import drift_battery as battery
import numpy as np
import pytest
from scipy.stats import binom

from daebench.diagnostics.drift import between
from daebench.diagnostics.energy import energy_drift
from daebench.diagnostics.trend import ONE_WAY

LEVEL = 0.95
"""Promised coverage of the intervals."""


def oscillation(random, kind, u, periods):
    """Return what has no trend, of amplitude about 1."""
    turns = 2 * np.pi * (periods * u + random.random())
    if kind == "two tones":
        return np.sin(turns) + 0.3 * np.sin(2 * turns + 1)
    if kind == "noise":
        return battery.coloured(random, len(u), 0.7)
    if kind == "modulated":
        return np.sin(turns) * (1 + 0.4 * np.sin(turns / 7.3 + 1)) + 0.1 * np.sin(turns / 7.3)
    return 1 / (1 + (np.sin(turns / 2) / 0.15) ** 2)


KINDS = ("two tones", "noise", "modulated", "peaks")


def few_enough(misses, of, level=1 - LEVEL):
    """Return whether so many misses are no more than a promised rate explains but once in a thousand."""
    return misses <= binom.ppf(0.999, of, level)


def drawn(random, secular, kind, *, ratio=(1.0, 100.0), periods=(6, 60), samples=(200, 2500)):
    """Return times, an error of a secular part s(u) so many times the oscillation, and where the secular part begins."""
    n = int(np.exp(random.uniform(*np.log(samples))))
    u = np.linspace(0, 1, n)
    rest = oscillation(random, kind, u, random.uniform(*periods))
    size = np.exp(random.uniform(*np.log(ratio)))
    return 37.0 * u, size * secular(u) + rest - rest[0], size, -rest[0]


@pytest.mark.sampled(by=lambda case: case in ("long-noise", "short-peaks"))
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("periods", "samples"), [((6, 60), (200, 2500)), ((3, 12), (60, 500))], ids=["long", "short"])
def test_intervals_of_exponents_hold_the_true_one(kind, periods, samples):
    """The truth is the exponent that the series is made with: 1/2, 1, 2 or 3."""
    random, misses, told, linear = np.random.default_rng(41), [], 0, []
    for alpha in (0.5, 1.0, 2.0, 3.0):
        for _ in range(6):
            t, error, *_ = drawn(random, lambda u, alpha=alpha: u**alpha, kind, periods=periods, samples=samples)
            drift = energy_drift(t, error)
            if drift.verdict != "drifts" or np.isnan(drift.exponent):
                continue
            told += 1
            assert drift.exponent_low <= drift.exponent <= drift.exponent_high
            if not drift.exponent_low <= alpha <= drift.exponent_high:
                misses.append((alpha, drift.words))
            linear.append(drift.law == "linear" and alpha != 1)
    assert told >= 8
    assert few_enough(len(misses), told), misses
    assert not any(linear)


@pytest.mark.sampled(left_out=("5.0", "150.0"))
@pytest.mark.parametrize("rate", [5.0, 20.0, 150.0])
def test_intervals_of_limits_hold_the_true_one(rate):
    """The limit is that of s (1 - exp(-k t)), counted from where the oscillation is on average."""
    random, misses, told = np.random.default_rng(43), [], 0
    for kind in KINDS[:3]:
        for _ in range(8):
            t, error, size, start = drawn(random, lambda u: -np.expm1(-rate * u), kind, ratio=(10.0, 100.0))
            drift = energy_drift(t, error)
            if drift.law != "saturated":
                continue
            told += 1
            if not drift.level_low <= size + start <= drift.level_high:
                misses.append((size + start, drift.words))
    assert told >= 15
    assert few_enough(len(misses), told), misses


def test_the_limit_is_not_the_last_mean():
    """At the end of the time a change at rate 3 has five hundredths to go."""
    u = np.linspace(0, 1, 4001)
    drift = energy_drift(u, -np.expm1(-3 * u) + 1e-3 * np.sin(2 * np.pi * 50 * u))
    assert drift.law == "saturated"
    assert drift.level == pytest.approx(1.0, abs=2e-3)
    assert drift.level_low <= 1 <= drift.level_high
    assert drift.level_high < 1.02


def test_no_word_of_a_law_has_a_number_without_its_interval():
    u = np.linspace(0, 1, 1001)
    wave = 0.02 * np.sin(2 * np.pi * 40 * u)
    words = [energy_drift(u, part + wave).words for part in (u, u**2.5, -np.expm1(-12 * u))]
    assert [text.split()[0] for text in words] == ["linear", "t^2.5", "saturated"]
    assert all(" to " in text and text.endswith(")") for text in words)
    ends = [between(*each) for each in ((1.0, 2.0), (26.6001, 26.6009), (0.5, float("inf")))]
    assert ends == ["1 to 2", "26.6 to 26.601", "0.5 to inf"]


# ---- no mean that moves is bounded ---------------------------------------------------------------------------------------


def wandering(random, n, periods, memory, part):
    """Return an oscillation over noise that remembers part of the time, and a line: means that move, and scatter as they do."""
    u = np.linspace(0, 1, n)
    noise = battery.coloured(random, n, float(np.exp(-1 / (memory * n))))
    return u, 4 * np.sin(2 * np.pi * periods * u) + noise + part * u


@pytest.mark.sampled(by=lambda case: case.startswith("0.5"))
@pytest.mark.parametrize("part", [0.5, 0.7, 1.0], ids=lambda part: f"{part} of the oscillation")
def test_no_mean_that_moves_half_the_oscillation_is_bounded(part):
    """Scatter with a memory hides the drift from its own significance; the range of the oscillation is 8 and that of the noise about 5."""
    random, told = np.random.default_rng(47), Counter()
    for _ in range(25):
        memory, periods = np.exp(random.uniform(np.log(0.005), np.log(0.05))), random.uniform(20, 200)
        told[energy_drift(*wandering(random, 2000, periods, memory, part * 13)).verdict] += 1
    assert told["bounded"] == 0, told
    assert told["kept"] == told["failed"] == 0


def test_a_mean_that_goes_one_way_says_so():
    random = np.random.default_rng(53)
    reasons = Counter(energy_drift(*wandering(random, 2000, random.uniform(20, 200), 0.02, 4.0)).reason for _ in range(40))
    assert reasons[ONE_WAY] >= 2


def test_what_has_no_drift_is_bounded_and_not_undetermined():
    """Rates over noise with a memory of a hundredth of the time and less, and over two tones: the price of the rule about means."""
    random, told = np.random.default_rng(59), Counter()
    for k in range(120):
        memory = np.exp(random.uniform(np.log(1e-3), np.log(0.01)))
        t, error = wandering(random, 2000, random.uniform(20, 200), memory, 0.0)
        told[energy_drift(t, error if k % 2 else oscillation(random, "two tones", t, random.uniform(6, 100))).verdict] += 1
    assert told["drifts"] == 0
    assert told["bounded"] >= 114, told


SECULAR = {
    "line": lambda u: u,
    "square": lambda u: u**2,
    "root": lambda u: u**0.5,
    "exponential": lambda u: np.expm1(6 * u) / np.expm1(6),
    "saturating": lambda u: -np.expm1(-8 * u) / -np.expm1(-8),
}


@pytest.mark.sampled(left_out=("square", "root", "exponential"))
@pytest.mark.parametrize("secular", SECULAR.values(), ids=SECULAR)
def test_false_verdicts_over_ratios_of_drift_to_oscillation(secular):
    """From a ten thousandth to ten times the oscillation: where the mean moves half of it none is bounded, and no bound is violated."""
    random = np.random.default_rng(61)
    for ratio in np.geomspace(1e-4, 10, 11):
        for kind in KINDS:
            t, error, size, _ = drawn(random, secular, kind, ratio=(ratio, 1.001 * ratio), samples=(500, 2500))
            drift = energy_drift(t, error)
            assert drift.verdict in ("bounded", "drifts", "undetermined")
            if drift.verdict == "bounded":
                assert size <= 0.5 * np.ptp(error)
                assert size <= drift.change_bound
