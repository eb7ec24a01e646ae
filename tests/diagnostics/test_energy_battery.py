"""The verdict on errors whose true change of the mean is known: bounds hold, drifts are real, and what can be decided is."""

from collections import Counter

import drift_battery as battery
import numpy as np
import pytest

from daebench.diagnostics.energy import energy_drift

EACH = 9
"""Series of each kind."""


@pytest.fixture(scope="module")
def judged():
    """Return series with their verdicts: every secular part under everything else, the same draw each time."""
    random = np.random.default_rng(19)
    drawn = [battery.draw(random, secular, other) for secular in battery.SECULARS for other in battery.OTHERS for _ in range(EACH)]
    drawn += [battery.draw(random, "none", other) for other in battery.OTHERS for _ in range(EACH)]
    return [(each, energy_drift(each.t, each.error)) for each in drawn]


def test_the_bound_of_what_is_bounded_holds_and_says_something(judged):
    bounded = [(each, found) for each, found in judged if found.verdict == "bounded"]
    violated = [each.name for each, found in bounded if each.change > found.change_bound]
    assert len(bounded) > 100
    assert len(violated) <= 0.01 * len(bounded), Counter(violated)
    assert all(found.change_bound < np.ptp(each.error) for each, found in bounded)


def test_there_is_no_drift_where_the_mean_does_not_change(judged):
    still = [(each, found) for each, found in judged if each.change == 0]
    false = [each.name for each, found in still if found.verdict == "drifts"]
    assert len(still) >= 2 * EACH * len(battery.OTHERS)
    assert len(false) <= 0.02 * len(still), Counter(false)


def test_what_can_be_decided_is_decided(judged):
    def is_clear(each):
        moved = each.change == 0 or each.shift >= 5 * each.deviation
        return each.oscillations >= 20 and each.beats >= 2 and "aliased" not in each.name and moved

    clear = [(each, found) for each, found in judged if is_clear(each)]
    undecided = [(each.name, found.reason) for each, found in clear if found.verdict == "undetermined"]
    assert len(clear) > 100
    assert len(undecided) <= 0.05 * len(clear), Counter(undecided)


def test_a_change_far_beyond_the_rest_is_called_a_drift(judged):
    """The bound alone would let everything be called bounded."""
    large = [found for each, found in judged if each.change >= 0.8 * np.ptp(each.error) > 0 and "none" not in each.name]
    assert len(large) > 15
    assert np.mean([found.verdict == "drifts" for found in large]) > 0.95


def test_a_single_random_walk_is_told_from_a_drift():
    random = np.random.default_rng(7)
    drawn = [battery.walk(random) for _ in range(100)]
    found = [energy_drift(each.t, each.error) for each in drawn]
    told = Counter(each.verdict for each in found)
    assert told["drifts"] <= 0.03 * len(drawn)
    violated = sum(each.verdict == "bounded" and series.change > each.change_bound for series, each in zip(drawn, found, strict=True))
    assert violated <= 2
    assert any("random walk" in each.reason for each in found)


CURVED = {
    "t^4": lambda u: u**4,
    "t^8": lambda u: u**8,
    "exp": lambda u: np.expm1(10 * u) / np.expm1(10),
    "1 - exp": lambda u: -np.expm1(-20 * u),
    "step": lambda u: 1.0 * (u > 0.6),
}


@pytest.mark.parametrize("drift", CURVED.values(), ids=CURVED)
def test_a_curved_drift_is_not_called_bounded(drift):
    """The running sum of the residuals about a line, which a slope was held against, is large for each of these."""
    u = np.linspace(0, 1, 4001)
    for periods in (5.3, 20, 200):
        assert energy_drift(100 * u, -26.6 * drift(u) + 0.1 * np.sin(2 * np.pi * periods * u)).verdict == "drifts", periods


def test_laws_are_told():
    u = np.linspace(0, 1, 4001)
    wave = 0.02 * np.sin(2 * np.pi * 40 * u)
    laws = {name: energy_drift(100 * u, drift(u) + wave).law for name, drift in CURVED.items()}
    assert laws.pop("t^8") in ("power", "exponential")
    assert laws == {"t^4": "power", "exp": "exponential", "1 - exp": "saturated", "step": "step"}
    assert energy_drift(100 * u, u + wave).law == "linear"
    saturated = energy_drift(100 * u, -26.6 * CURVED["1 - exp"](u) + wave)
    assert saturated.words.startswith("saturated at -26.6 (-26.6")
    assert saturated.level_low <= -26.6 <= saturated.level_high


@pytest.mark.parametrize(
    ("periods", "samples", "reason"),
    [(3, 2000, "fewer than 5 oscillations"), (3, 30, "too short"), (1.3, 500, "fewer than 5 oscillations")],
    ids=["three periods", "thirty samples", "one period"],
)
def test_a_reason_is_given_for_what_is_not_determined(periods, samples, reason):
    t = np.linspace(0, 1, samples)
    found = energy_drift(t, np.sin(2 * np.pi * periods * t))
    assert found.verdict == "undetermined"
    assert reason in found.reason


def test_a_slow_change_under_an_unresolved_oscillation_may_be_its_alias():
    t = np.arange(2000.0)
    found = energy_drift(t, np.sin(2 * np.pi * 0.37 * t) + t / 2000)
    assert found.verdict == "undetermined"
    assert "aliased" in found.reason


def test_kept_is_held_against_the_rounding_of_so_many_steps():
    t = np.linspace(0, 1, 1000)
    error = 9e-14 * np.sin(40 * t)
    assert energy_drift(t, error, scale=10.0, steps=100).verdict == "kept"
    assert energy_drift(t, error, scale=0.1, steps=100).verdict == "bounded"
    assert energy_drift(t, 1e-5 * t, scale=1.0, steps=100, eps=2.0**-23).verdict == "kept"


def test_what_stopped_failed():
    t = np.linspace(0, 1, 1000)
    found = energy_drift(t, np.sin(100 * t), failure="stopped")
    assert (found.verdict, found.reason) == ("failed", "stopped")


@pytest.mark.exhaustive
def test_the_bars_hold_in_a_wider_draw():
    random = np.random.default_rng(20260101)
    drawn = [
        battery.draw(random, secular, other, most=300.0) for secular in battery.SECULARS for other in battery.OTHERS for _ in range(100)
    ]
    found = [(each, energy_drift(each.t, each.error)) for each in drawn]
    bounded = [each.change <= verdict.change_bound for each, verdict in found if verdict.verdict == "bounded"]
    still = [verdict.verdict != "drifts" for each, verdict in found if each.change == 0]
    assert np.mean(bounded) >= 0.99
    assert np.mean(still) >= 0.98
