"""The verdict on an ensemble: synthetic walks, biases and oscillations whose growth is known."""

from collections import Counter

import numpy as np
import pytest
from refusals import refused

from daebench.diagnostics.drift import LAWS
from daebench.diagnostics.random_walk import random_walk

BLOCKS, INSIDE, MEMBERS = 256, 16, 16
STEP = np.arange(1, BLOCKS * INSIDE + 1.0)
T = STEP[-1]
t = STEP.reshape(BLOCKS, INSIDE).mean(axis=1)


def blocks(series):
    """Return means over blocks of series, shape(N, steps)."""
    return series.reshape(len(series), BLOCKS, INSIDE).mean(axis=2)


def walks(random, members=MEMBERS):
    return blocks(np.cumsum(random.standard_normal((members, len(STEP))), axis=1))


def oscillations(random, apart):
    """Return oscillations of one start whose frequencies differ by a small part, and by one rounding at least."""
    rate = np.full((MEMBERS, 1), 0.37)
    while len(np.unique(rate)) < MEMBERS:
        rate = 0.37 * (1 + apart * random.standard_normal((MEMBERS, 1)))
    return blocks(np.cos(rate * STEP) - 1)


def test_walks_are_walks_with_exponent_one_half_and_without_a_slope(random):
    found = [random_walk(t, walks(random)) for _ in range(100)]
    told = Counter(each.brief for each in found)
    assert told["random walk"] >= 90
    assert told["bounded"] + sum(told[law] for law in LAWS) + told["apart"] <= 1
    exponents, errors, sizes = np.array([(each.exponent, each.exponent_error, each.slope / each.slope_error) for each in found]).T
    assert np.mean(exponents) == pytest.approx(0.5, abs=0.03)
    assert np.std(exponents) == pytest.approx(np.mean(errors), rel=0.3)
    assert np.mean(np.abs(exponents - 0.5) <= 2 * errors) >= 0.87
    assert 0.4 < np.std(sizes) < 1.3  # below one, where the error that the mean's own wandering leaves is the larger one
    assert abs(np.mean(sizes)) < 0.4


def test_biased_walks_are_linear_and_their_slope_is_the_bias(random):
    bias = 3 / np.sqrt(T)  # three standard deviations of one member at the end, twelve of the mean
    found = [random_walk(t, walks(random) + bias * t) for _ in range(40)]
    told = Counter(each.brief for each in found)
    assert told["linear"] >= 38
    assert told["linear"] + told["power"] == 40
    off = np.array([(each.slope - bias) / each.slope_error for each in found])
    assert np.mean(np.abs(off) < 2.5) >= 0.9


@pytest.mark.parametrize("rate", [2.0, 8.0, 30.0])
def test_means_that_fall_and_settle_have_saturated(rate, random):
    fall = -26.6 * (1 - np.exp(-rate * t / T)) + 0.1 * np.sin(0.7 * t)
    found = random_walk(t, fall + 1e-3 * walks(random))
    assert found.verdict == "drifts"
    assert found.law in ("saturated", "power")
    assert found.change_bound > 26


def test_a_bound_of_an_ensemble_holds(random):
    """A drift of the mean that is too small to be seen is within the bound all the same."""
    for drift in (0.0, 0.3, 1.0, 3.0) * 5:
        found = random_walk(t, drift * (t / T) ** 2 + random.standard_normal((MEMBERS, BLOCKS)))
        assert found.verdict in ("bounded", "drifts")
        assert found.change_bound > drift


MADE = {
    "a walk under a common oscillation a thousand times larger": (
        lambda r: 1e-3 * walks(r) + oscillations(r, 2e-13),
        "random walk",
        0.86,
        ("random walk", "undetermined", "bounded"),
    ),
    "walks with a quadratic drift": (lambda r: walks(r) + 6 * t**2 / T**1.5, "power", 0.8, ("power", "exponential")),
    "oscillations": (lambda r: oscillations(r, 1.0), "bounded", 0.86, ("bounded", "undetermined")),
    "noise": (lambda r: r.standard_normal((MEMBERS, BLOCKS)), "bounded", 1.0, ("bounded",)),
}


@pytest.mark.parametrize(("make", "usual", "share", "possible"), MADE.values(), ids=MADE)
def test_what_is_made_by_a_rule_has_the_verdict_of_its_rule(make, usual, share, possible, random):
    told = Counter(random_walk(t, make(random)).brief for _ in range(30))
    assert told[usual] >= 30 * share
    assert set(told) <= set(possible)


def test_one_oscillation_of_members_that_hardly_differ_is_no_walk(random):
    told = {random_walk(t, oscillations(random, 2e-13)).brief for _ in range(30)}
    assert told <= {"bounded", "undetermined"}
    assert random_walk(t, oscillations(random, 2e-13), resolution=1e-12).brief == "bounded"


def test_members_that_drift_each_its_own_way_drift_apart(random):
    draws = random.standard_normal((MEMBERS, 1))
    found = random_walk(t, (draws - draws.mean()) * t)
    assert (found.brief, found.exponent) == ("apart", pytest.approx(1, abs=0.01))


def test_what_is_below_the_resolution_is_no_spread(random):
    found = random_walk(t, 1e-3 * walks(random), resolution=1.0)
    assert (found.brief, np.isnan(found.exponent)) == ("kept", True)


def test_the_unit_of_the_error_does_not_matter(random):
    error = walks(random)
    one, other = random_walk(t, error), random_walk(t, 2.0**-400 * error)
    assert (one.exponent, one.exponent_error, one.brief) == (other.exponent, other.exponent_error, other.brief)
    assert other.slope == 2.0**-400 * one.slope


def test_too_few_times_and_infinite_errors_tell_nothing(random):
    error = walks(random)
    assert random_walk(t[:63], error[:, :63]).brief == "undetermined"
    error[3, 5] = np.inf
    assert random_walk(t, error).brief == "undetermined"


@pytest.mark.parametrize("power", [1, 2])
@pytest.mark.parametrize("rate", [1.0, 0.02], ids=["fast", "slow"])
def test_an_oscillation_of_all_members_that_swells_drifts(power, rate, random):
    common = T**0.5 * (t / T) ** power * np.sin(rate * t)
    found = random_walk(t, walks(random) + 20 * common)
    assert found.brief == "growing scatter"
    alike = random_walk(t, common + 1e-9 * random.standard_normal((MEMBERS, BLOCKS)))
    assert alike.brief == "growing scatter"


def test_a_spread_in_the_last_windows_alone_tells_nothing(random):
    draws = random.standard_normal((MEMBERS, 1))
    ends = 1e-10 * (draws - draws.mean()) * (t / T) ** 8
    last = np.std(ends[:, -1], ddof=1)
    found = random_walk(t, ends, resolution=last / 4.7)
    assert (found.brief, np.isnan(found.exponent)) == ("undetermined", True)
    assert random_walk(t, ends, resolution=2 * last).brief in ("bounded", "kept")


def test_members_that_are_the_same_run_too_few_of_them_and_odd_shapes_are_refused(random):
    error = walks(random)
    for times, errors, code in ((t, error[:15], "too-few-walks"), (t[:-1], error, "ensemble-shapes-differ")):
        with refused(code):
            random_walk(times, errors)
    error[7] = error[3]
    with refused("members-with-equal-errors", says=("1", "16")):
        random_walk(t, error)
    assert random_walk(t, np.zeros((MEMBERS, BLOCKS))).brief == "kept"


@pytest.mark.parametrize("law", ["walk", "late", "noise"])
def test_a_spread_within_four_roundings_of_a_state_is_never_a_reason_to_leave_the_verdict_open(law, random):
    """The members' oscillation is common and large; where they part by a few roundings, its mean decides."""
    for roundings in (0.3, 1.0, 2.0, 4.0) * 3:
        own = {
            "walk": walks(random),
            "late": random.standard_normal((MEMBERS, 1)) * (t / T) ** 8,
            "noise": random.standard_normal((MEMBERS, BLOCKS)),
        }[law]
        own *= roundings / np.max(np.std(own, axis=0, ddof=1))
        found = random_walk(t, own + 1e8 * oscillations(random, 2e-13), resolution=1.0, rounding=1.0)
        assert found.verdict in ("bounded", "random walk")


def test_a_spread_beyond_four_roundings_is_a_walk_or_open_as_before(random):
    told = Counter()
    for _ in range(20):
        own = walks(random)
        own *= 100 / np.max(np.std(own, axis=0, ddof=1))
        one, other = (random_walk(t, own + 1e8 * oscillations(random, 2e-13), resolution=1.0, rounding=size) for size in (0.0, 1.0))
        told[other.brief] += 1
        assert one.brief == other.brief
    assert told["random walk"] >= 14


def test_errors_within_four_roundings_are_kept_unless_they_drift(random):
    errors = 0.5 * random.standard_normal((MEMBERS, BLOCKS)).cumsum(axis=1) / BLOCKS**0.5
    assert random_walk(t, errors, rounding=1.0).verdict in ("kept", "random walk")
    few = np.abs(np.sin(3 * t / T)) * (1 + 1e-3 * random.standard_normal((MEMBERS, 1)))
    assert random_walk(t, few).verdict == "undetermined"
    assert random_walk(t, few, rounding=1.0).verdict == "kept"
    assert random_walk(t, few + 2 * t / T, rounding=1.0).verdict == "drifts"
