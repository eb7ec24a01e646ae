"""Diagnostics of numbers whose answer is a closed form, a count, or that of SciPy."""

import math
from dataclasses import replace

import numpy as np
import pytest
import scipy.stats

from daebench.diagnostics.energy import energy_drift
from daebench.diagnostics.energy_verdict import energy_scales, energy_verdict, may_be_a_part
from daebench.diagnostics.ensemble_trend import ensemble_trend
from daebench.diagnostics.lyapunov import exponents, mean_megno
from daebench.diagnostics.manifold import distance
from daebench.diagnostics.order import fit_order, straight_line
from daebench.diagnostics.quantile_shift import quantile, ranks
from daebench.diagnostics.random_walk import random_walk
from daebench.diagnostics.reversibility import inversion_defect
from daebench.diagnostics.spread import _jackknife
from daebench.diagnostics.volume import volume_share
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.request import Request

T = np.linspace(0.0, 1.0, 4000)


# ---- quantiles -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [10, 37, 100])
def test_a_quantile_is_the_least_member_that_a_part_of_all_are_not_larger_than(n):
    ordered = np.arange(1.0, n + 1)
    for q in (0.1, 0.25, 0.5, 0.9, 1.0):
        assert quantile(ordered, q) == min(x for x in ordered if np.sum(ordered <= x) >= q * n - 1e-9)


def at_most(k, n, q):
    return sum(math.comb(n, j) * q**j * (1 - q) ** (n - j) for j in range(k + 1))


@pytest.mark.parametrize(("n", "q"), [(64, 0.5), (200, 0.9), (50, 0.25)])
def test_ranks_refute_a_quantile_with_a_quarter_of_the_level_on_either_side_and_no_rank_nearer_does(n, q):
    found = ranks(n, q, 0.05)
    assert 1 - at_most(found.above - 1, n, q) <= 0.05 / 4 < 1 - at_most(found.above - 2, n, q)
    assert at_most(found.below, n, q) <= 0.05 / 4 < at_most(found.below + 1, n, q)


# ---- lines, orders, standard errors --------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [3, 5, 40])
def test_a_line_has_the_slope_and_the_standard_error_of_scipy(random, n):
    x, y = np.sort(random.uniform(0, 3, n)), random.standard_normal(n)
    expected = scipy.stats.linregress(x, y)
    assert straight_line(x, y) == pytest.approx((expected.slope, expected.stderr), rel=1e-10)


def test_the_jackknife_of_a_mean_is_its_standard_error(random):
    x = random.standard_normal(30)
    without = (np.sum(x) - x) / 29
    assert _jackknife(without) == pytest.approx(np.std(x, ddof=1) / math.sqrt(30), rel=1e-12)


def test_an_order_is_that_of_the_steps_above_round_off():
    h = 2.0 ** -np.arange(2, 22)
    fit = fit_order(h, np.maximum(0.3 * h**3, 1e-13 * (1 + 0.3 * np.cos(np.arange(20)))))
    assert fit.slope == pytest.approx(3, abs=1e-9)
    assert all(not used for used, x in zip(fit.used, h, strict=True) if 0.3 * x**3 < 1e-13)


def test_two_points_have_no_order():
    assert math.isnan(fit_order([0.1, 0.05], [1e-2, 2.5e-3]).slope)


# ---- chaos ---------------------------------------------------------------------------------------------------------------


def test_of_exponential_growth_megno_is_half_of_lambda_t_and_the_exponent_is_lambda():
    rate, interval, n = 0.3, 0.25, 4000
    growth = np.full((1, n), rate * interval)
    assert mean_megno(growth)[0, -1] == pytest.approx(rate * interval * n / 2, rel=1e-3)
    found = exponents(growth, interval)
    assert found.exponent[0] == pytest.approx(rate, rel=1e-12)
    assert found.verdict[0] == "chaotic"


# ---- maps ----------------------------------------------------------------------------------------------------------------


def test_the_share_of_volume_of_a_stretch_is_its_determinant():
    X = np.eye(4)
    assert volume_share(np.diag([0.5, 0.5, 0.8, 0.8]) @ X, X) == pytest.approx(0.16, rel=1e-12)


def test_a_flight_twice_forward_is_no_inverse_of_itself():
    p, q = np.array([0.3, -0.2]), np.array([1.0, 0.5])

    def flight(p, q):
        return np.asarray(p), np.asarray(q) + 0.1 * np.asarray(p)

    assert inversion_defect(flight, flight, p, q) == pytest.approx(0.2 * np.linalg.norm(p))


def test_the_distance_from_the_manifold_of_a_pendulum_is_that_of_momentum_and_position():
    ivp = initial_value_problem("planar_pendulum", "rotating")
    q, p = np.array([[0.0, -1.0]] * 2), np.array([[1.0, 0.0], [1.0, 1e-4]])
    assert distance(ivp, p, q) == pytest.approx([0.0, 1e-4 / math.sqrt(2)], rel=1e-3, abs=1e-12)


# ---- drifts --------------------------------------------------------------------------------------------------------------


def test_neither_noise_nor_a_random_walk_of_one_run_is_called_a_drift(random):
    for _ in range(30):
        assert energy_drift(T, np.sin(2000 * T) + random.standard_normal(len(T))).verdict != "drifts"
        assert energy_drift(T, np.cumsum(random.standard_normal(len(T)))).law not in ("linear", "power")


def test_one_oscillation_is_not_known_to_be_bounded_and_twenty_are():
    assert "fewer than" in energy_drift(T, np.sin(2 * np.pi * 3 * T)).reason
    assert energy_drift(T, np.sin(2 * np.pi * 20 * T)).verdict == "bounded"


def test_the_interval_of_an_exponent_holds_it_most_times(random):
    found = [energy_drift(T, 5 * T**2 + random.standard_normal(len(T))) for _ in range(20)]
    assert {drift.law for drift in found} == {"power"}
    assert sum(drift.exponent_low <= 2 <= drift.exponent_high for drift in found) >= 16


def test_a_common_drift_within_the_scatter_of_members_is_seen_in_their_mean(random):
    error = random.standard_normal((256, 1)) * T + 0.6 * T + 0.1 * random.standard_normal((256, len(T)))
    assert ensemble_trend(T, error, 1e-15).drifts
    assert not ensemble_trend(T, error - 0.6 * T, 1e-15).drifts


def test_members_that_go_each_its_own_way_part_faster_than_a_random_walk(random):
    t = np.linspace(0.0, 1.0, 4096)
    ways = random.standard_normal((64, 1)) * t + 1e-3 * random.standard_normal((64, len(t)))
    walks = np.cumsum(random.standard_normal((64, len(t))), axis=1)
    assert (random_walk(t, ways).law, random_walk(t, walks).verdict) == ("apart", "random walk")


# ---- energies of runs ----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def turning():
    ivp = initial_value_problem("planar_pendulum", "rotating")
    return ivp, FixedStep("rattle", compiled=False).solve(ivp, Request(value=0.02, steps=400))


def test_the_scale_of_an_energy_error_is_the_mean_kinetic_energy(turning):
    ivp, run = turning
    scales = energy_scales(ivp, run)
    assert scales.kinetic == pytest.approx(np.mean(np.sum(run.p**2, axis=1)) / 2, rel=1e-12)
    assert scales.most == pytest.approx(max(np.max(np.sum(run.p**2, axis=1)) / 2, np.max(np.abs(run.q[:, 1]))), rel=1e-12)


def test_the_energy_of_a_run_that_stopped_failed_and_that_of_a_whole_one_did_not(turning):
    ivp, run = turning
    assert energy_verdict(ivp, run).verdict != "failed"
    assert energy_verdict(ivp, replace(run, failure="the step has no solution")).verdict == "failed"


@pytest.mark.parametrize(("swings", "part"), [(0.4, True), (0.9, True), (3.5, False)], ids=str)
def test_a_motion_of_less_than_two_swings_may_be_a_part_of_one(swings, part):
    states = np.cos(2 * np.pi * swings * T)[:, None, None]
    assert may_be_a_part(states, np.array([1e-3])).tolist() == [part]
