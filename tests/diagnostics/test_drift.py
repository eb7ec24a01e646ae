"""Drift and growth: of the energy under oscillations and noise, of the constraints, and errors of what is conserved."""

import numpy as np
import pytest
from scipy.signal import lfilter

from daebench.diagnostics.energy import energy_drift, energy_verdicts
from daebench.diagnostics.energy_verdict import energy_error
from daebench.diagnostics.growth import law
from daebench.diagnostics.integrals import integral_errors
from daebench.diagnostics.manifold import manifold_drift
from daebench.diagnostics.trend import trend, trends
from daebench.errors import BadInput
from daebench.runs.trajectory import Trajectory


def trajectory_of(ivp, t, p, q):
    names = {"problem": ivp.problem, "case": ivp.case, "method": "made up", "parameters": ivp.parameters, "knob": "h", "value": 0.1}
    return Trajectory(**names, t=t, q=q, p=p, steps=0, seconds=0.0)


# ---- energy --------------------------------------------------------------------------------------------------------------

EPS = 2.0**-52
T = np.linspace(0, 1e4, 100_001)
OSCILLATION = 1e-3 * np.sin(T + 0.3) * (1 + 0.2 * np.cos(2 * T))


@pytest.mark.parametrize("slope", [1e-8, -1e-8, 3e-7], ids=["up", "down", "steep"])
def test_a_linear_drift_is_seen_under_an_oscillation_a_hundred_thousand_times_larger(slope):
    drift = energy_drift(T, slope * T + OSCILLATION)
    assert drift.law == "linear"
    assert abs(drift.slope - slope) < 3 * drift.slope_error < 0.1 * abs(slope)
    assert abs(drift.exponent - 1) < 3 * drift.exponent_error


@pytest.mark.parametrize("steps", [100, 10**6], ids=str)
def test_an_error_is_kept_up_to_ten_roundings_times_the_root_of_the_steps_and_no_further(steps):
    limit = 10 * EPS * steps**0.5 * 3.0
    oscillation = np.sin(T[:20_000])
    assert energy_drift(T[:20_000], 0.9 * limit * oscillation, scale=3.0, steps=steps).verdict == "kept"
    assert energy_drift(T[:20_000], 1.1 * limit * oscillation, scale=3.0, steps=steps).verdict == "bounded"


def several_errors(random, m=60, n=700):
    """Return times and errors that are kept, bounded, drift, wander, spread, are aliased, and are not finite."""
    t = np.linspace(0, 10, n)
    frequency, phase = np.geomspace(0.2, 300, m)[:, None], random.uniform(0, 6, (m, 1))
    errors = np.sin(frequency * t + phase) * random.uniform(0.01, 1, (m, 1)) + random.uniform(-1, 1, (m, 1)) ** 5 * (t / 10) ** 2
    errors[::7] = np.cumsum(random.standard_normal((len(errors[::7]), n)), axis=1)
    errors[3::7] *= np.exp(t / 2)
    errors[5] *= 1e-16
    errors[6, n // 2] = np.nan
    return t, errors


@pytest.mark.parametrize("n", [20, 700])
def test_errors_judged_together_have_the_verdicts_that_each_has_alone(random, n):
    t, errors = several_errors(random, n=n)
    scale = np.ones(len(errors))
    verdicts = energy_verdicts(t, errors, resolution=0.1 * EPS * scale, scale=scale, steps=n)
    alone = [energy_drift(t, error, resolution=0.1 * EPS, scale=1.0, steps=n).verdict for error in errors]
    assert verdicts.tolist() == alone
    assert {"kept", "failed", "undetermined"} <= set(alone)
    assert n < 100 or {"bounded", "drifts"} <= set(alone)


def test_what_is_told_of_an_error_does_not_depend_on_those_beside_it(random):
    t, errors = several_errors(random)
    errors = np.nan_to_num(errors / np.nanmax(np.abs(errors), axis=1, keepdims=True))
    together = trends(t, errors, np.full(len(errors), 1e-15))
    assert [repr(together.one(i)) for i in range(len(errors))] == [repr(trend(t, error, 1e-15)) for error in errors]


@pytest.mark.parametrize("periods", [5.3, 20.0, 46.0, 340.0, 391.0, 1000.5])
@pytest.mark.parametrize("phase", [0.0, 1.0, 2.5, 4.0])
def test_an_oscillation_is_bounded_whatever_its_period_and_phase(periods, phase):
    t = np.linspace(0, 500, 12_001)
    error = np.cos(2 * np.pi * periods * t / 500 + phase) - np.cos(phase)
    drift = energy_drift(t, error)
    assert drift.verdict == "bounded"
    assert abs(drift.slope) < 2 * drift.slope_error
    assert np.isnan(drift.exponent)
    assert np.isnan(drift.exponent_error)


@pytest.mark.parametrize(
    ("n", "memory", "least", "most", "bounded"),
    [(1000, 0.0, 0.8, 1.25, 0.97), (4000, 0.95, 0.7, 1.4, 0.95)],
    ids=["white", "autocorrelated"],
)
def test_the_standard_error_of_the_slope_is_that_of_the_textbook(random, n, memory, least, most, bounded):
    t = 0.05 * np.arange(n)
    drifts = [energy_drift(t, lfilter([1], [1, -memory], random.normal(size=n))) for _ in range(200)]
    scatter = np.std([drift.slope for drift in drifts])
    assert least < np.mean([drift.slope_error for drift in drifts]) / scatter < most
    assert np.mean([drift.verdict == "bounded" for drift in drifts]) > bounded


def test_what_settles_at_once_is_still_a_change_of_the_mean():
    found = energy_drift(T, 1e-3 * (1 - np.exp(-T)))
    assert (found.verdict, found.law) == ("drifts", "saturated")
    assert found.level == pytest.approx(1e-3, rel=1e-6)
    assert found.level_low <= found.level <= found.level_high
    assert energy_drift(T, 0 * T).verdict == "kept"
    assert energy_drift(T, 1e-3 + 0 * T).verdict == "bounded"


@pytest.mark.parametrize("error", [1e-6 * T * np.sin(T), 1e-9 * np.exp(T / 300)], ids=["amplitude", "explosion"])
def test_what_spreads_without_a_significant_slope_is_not_called_bounded(error):
    assert energy_drift(T, error).verdict == "drifts"


def test_a_drift_within_the_resolution_is_bounded():
    error = 1e-19 * T
    assert energy_drift(T, error).law == "linear"
    assert energy_drift(T, error, resolution=2e-15).verdict == "kept"


@pytest.mark.parametrize(("roundings", "verdict"), [(0.5, "bounded"), (4.0, "drifts")])
def test_a_change_that_rounding_explains_is_no_drift_under_an_oscillation(roundings, verdict):
    steps = len(T) - 1
    rounding = 10 * EPS * steps**0.5
    error = 1e-8 * OSCILLATION + roundings * rounding * T / T[-1]
    assert energy_drift(T, error, scale=1.0, steps=steps).verdict == verdict
    assert energy_drift(T, error).verdict == "drifts"


@pytest.mark.parametrize(
    ("t", "error"),
    [(T[:10], T[:10]), (T[:100], np.full(100, np.nan)), (T[:100], np.where(np.arange(100) == 50, np.inf, 0))],
    ids=["short", "NaN", "inf"],
)
def test_what_cannot_be_judged_is_undetermined_or_failed(t, error):
    drift = energy_drift(t, error)
    assert drift.verdict == ("failed" if len(t) == 100 else "undetermined")
    assert drift.reason
    assert np.all(np.isnan([drift.slope, drift.slope_error, drift.exponent, drift.exponent_error]))


@pytest.mark.parametrize(("t", "error"), [(T[:100], T[:99]), (T[99::-1], T[:100])], ids=["shapes", "backwards"])
def test_a_series_that_makes_no_sense_is_refused(t, error):
    with pytest.raises(BadInput):
        energy_drift(t, error)


# ---- constraints and conserved quantities --------------------------------------------------------------------------------


def test_manifold_drift_gives_maxima_and_slopes(pendulum):
    t = np.linspace(0, 100, 2001)
    angle = 0.5 * t
    around = np.stack([np.cos(angle), np.sin(angle), 0 * t], axis=1)
    ahead = np.stack([-np.sin(angle), np.cos(angle), 0 * t], axis=1)
    # |q|^2 - 1 grows as 1e-6 t, and q.p oscillates
    q, p = around * np.sqrt(1 + 1e-6 * t)[:, None], 0.5 * ahead + 1e-4 * np.sin(7 * t)[:, None] * around
    found = manifold_drift(pendulum, trajectory_of(pendulum, t, p, q))
    assert found.g_max == pytest.approx(1e-4, rel=1e-9)
    assert found.g.law == "linear"
    assert found.g.slope == pytest.approx(1e-6, rel=1e-9)
    assert found.Gv_max == pytest.approx(2e-4, rel=1e-3)
    assert found.Gv.verdict == "bounded"


def test_errors_of_conserved_quantities_are_differences_from_their_start(pendulum):
    t = np.linspace(0, 1, 5)
    p, q = np.tile(pendulum.p0, (5, 1)), np.tile(pendulum.q0, (5, 1))
    q[:, 2] += t
    p[:, 1] += 2 * t
    trajectory = trajectory_of(pendulum, t, p, q)
    np.testing.assert_allclose(energy_error(pendulum, trajectory), t + 2 * t**2 + 2 * t * pendulum.p0[1], atol=1e-13)
    errors = integral_errors(pendulum, trajectory)
    assert list(errors) == ["L3"]
    np.testing.assert_allclose(errors["L3"], 2 * t * pendulum.q0[0], atol=1e-13)


def test_the_drift_of_a_run_that_blows_up_does_not_overflow():
    t = np.linspace(0, 1000, 4001)
    small, large = (energy_drift(t, size * (t + 10 * np.sin(t))) for size in (1.0, 2.0**1000))
    assert large.slope == small.slope * 2.0**1000
    assert (large.exponent, large.law) == (small.exponent, small.law) == (pytest.approx(1.0, abs=0.1), "linear")
    burst = np.where(t > 990, 1e300, 0.0)
    assert energy_drift(t, burst).verdict == energy_drift(t, burst / 1e300).verdict


FIRST = np.linspace(0, 32, 3201)
BEGUN = {
    "a jump, then a line": 1.0 * (FIRST >= 1) + 0.05 * FIRST,
    "a ramp, then a root": np.minimum(FIRST, 1) + 0.02 * np.sqrt(FIRST),
    "rest, then a line": np.where(FIRST < 1, 0, FIRST),
}


LATER = [1.0, 0.5, 1.0]
"""Exponents from t = 1 on."""

WIDTHS = [0.3, 0.3, 0.015]
"""Least widths of intervals; of the last the beginning is as small as its part of the time is."""


@pytest.mark.parametrize(("error", "later", "width"), [*zip(BEGUN.values(), LATER, WIDTHS, strict=True)], ids=BEGUN)
def test_what_no_power_of_t_is_has_no_narrow_interval_of_an_exponent(error, later, width):
    """From t = 1 on each is a power of t to many digits; with what is before, none is: the interval then has the later exponent, too."""
    told = law(FIRST, error)
    assert told.name != "power" or told.exponent_high - told.exponent_low > width
    assert told.name != "power" or told.exponent_low - 1e-5 <= later <= told.exponent_high + 1e-5
    line = law(FIRST, 2 + FIRST)
    assert line.exponent_high - line.exponent_low < 1e-3
    assert line.exponent_low <= 1 <= line.exponent_high
