"""The exponent of a spread and its standard error: synthetic walks, fractional ones and drifts, drawn from their exact covariance."""

from itertools import pairwise

import numpy as np
import pytest

from daebench.diagnostics.random_walk import random_walk
from daebench.diagnostics.spread import spread_exponent
from daebench.studies.long.windows import EDGES

MEMBERS, OCTAVES = 256, 14


def windows(octaves):
    """Return the centres of windows of quarter octaves, and the matrix that takes values at a few points to means over windows."""
    edges = EDGES[: int(np.searchsorted(EDGES, 2**octaves, side="right"))]
    points = [np.unique(np.round(np.linspace(a, b - 1, min(b - a, 9)))) for a, b in pairwise(edges)]
    rows = np.repeat(np.arange(len(points)), [len(x) for x in points])
    s = np.concatenate(points)
    mean = np.zeros((len(points), len(s)))
    mean[rows, np.arange(len(s))] = 1 / np.bincount(rows)[rows]
    return s, mean


def motion(hurst, octaves=16, constant=0.0, drift=0.0):
    """Return centres, and a factor of the covariance of window means, of fractional Brownian motion, a constant and a slope of its own."""
    s, mean = windows(octaves)
    x, y = s[:, None], s[None]
    walk = (x ** (2 * hurst) + y ** (2 * hurst) - np.abs(x - y) ** (2 * hurst)) / 2 + constant + drift**2 * x * y
    covariance = mean @ walk @ mean.T
    return mean @ s, np.linalg.cholesky(covariance + 1e-13 * np.diag(np.diag(covariance)))


def spreads(random, count, hurst, members=MEMBERS, **more):
    t, factor = motion(hurst, **more)
    draws = (factor @ random.standard_normal((len(t), members)) for _ in range(count))
    return [spread_exponent(t, means, 0.0, OCTAVES) for means in draws]


def numbers(found):
    return np.array([each.exponent for each in found]), np.array([each.exponent_error for each in found])


@pytest.mark.sampled(left_out=("0.3", "0.7"))
@pytest.mark.parametrize("hurst", [0.3, 0.5, 0.7, 0.9])
def test_two_standard_errors_hold_the_exponent_nineteen_times_in_twenty(hurst, random):
    found = spreads(random, 150, hurst)
    exponents, errors = numbers(found)
    assert np.mean(exponents) == pytest.approx(hurst, abs=4 * np.mean(errors) / np.sqrt(150))
    assert np.std(exponents) == pytest.approx(np.mean(errors), rel=0.25)
    assert np.mean(np.abs(exponents - hurst) < 2 * errors) >= 0.89
    assert np.mean([each.bent for each in found]) <= 0.02


def test_a_thousand_members_tell_the_exponent_to_half_a_hundredth_over_four_decades(random):
    found = spreads(random, 40, 0.5, members=1024)
    exponents, errors = numbers(found)
    assert np.median(errors) < 0.005
    assert np.median([each.decades for each in found]) > 4
    assert np.mean(np.abs(exponents - 0.5) < 2 * errors) >= 0.85


@pytest.mark.parametrize("more", [{"constant": 30.0}, {"members": 16}], ids=["a first energy that is rounded", "sixteen members"])
def test_errors_are_honest_with_a_constant_that_all_have_and_of_few_members(more, random):
    exponents, errors = numbers(spreads(random, 150, 0.5, **more))
    assert np.mean(np.abs(exponents - 0.5) < 2 * errors) >= 0.87


def test_a_walk_that_becomes_a_drift_follows_no_single_power(random):
    found = spreads(random, 30, 0.5, members=1024, drift=0.005)
    assert np.mean([each.bent for each in found]) > 0.9
    assert np.mean([each.decades for each in found]) < 3


@pytest.mark.sampled(left_out=("1024-0.15-0.65",))
@pytest.mark.parametrize(("members", "least", "most"), [(256, 0.85, 1.0), (1024, 0.15, 0.65)])
def test_a_drift_that_adds_a_third_to_the_spread_passes_as_a_walk_as_often_as_is_said(members, least, most, random):
    found = spreads(random, 40, 0.5, members=members, drift=np.sqrt((4 / 3) ** 2 - 1) / 2**8)
    walks = [each for each in found if not each.bent and 0.25 < each.exponent < 0.75]
    assert least <= len(walks) / 40 <= most
    assert 0.515 < np.mean(numbers(walks)[0]) < 0.545


def verdicts(random, count, **more):
    """Return the verdicts on ensembles, with blocks that are equally long and windows that are not."""
    octaves = 12
    s, mean = windows(octaves)
    found = []
    for _ in range(count):
        walk = np.cumsum(random.standard_normal((64, 2**octaves)), axis=1)
        error = walk + more.get("apart", 0.0) * random.standard_normal((64, 1)) * np.arange(1, 2**octaves + 1)
        error += more.get("common", 0.0) * np.arange(1, 2**octaves + 1)
        blocks = error.reshape(64, 256, -1).mean(axis=2)
        t = (np.arange(256) + 0.5) * 2**octaves / 256
        found.append(random_walk(t, blocks, windows=(mean @ s, error[:, s.astype(int) - 1] @ mean.T)).brief)
    return found


def test_walks_and_drifts_are_told_apart_and_hardly_ever_confused(random):
    walks = verdicts(random, 30)
    assert walks.count("random walk") >= 28
    assert not {"apart", "linear", "bounded", "power"} & set(walks)
    assert verdicts(random, 10, apart=10.0).count("apart") == 10
    assert verdicts(random, 10, common=0.3).count("linear") >= 9


def test_what_does_not_part_has_no_exponent_and_few_windows_have_none():
    t = np.arange(1.0, 40.0)
    alike = spread_exponent(t, np.zeros((39, 20)), 0.0, OCTAVES)
    assert (alike.seen, np.isnan(alike.exponent)) == (False, True)
    few = spread_exponent(t[:5], np.outer(t[:5], np.arange(20.0)), 0.0, OCTAVES)
    assert (few.seen, np.isnan(few.exponent)) == (True, True)
