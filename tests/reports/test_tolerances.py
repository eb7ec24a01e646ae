"""The report on tolerances: fits of powers, ends of runs in words, work limits, and claims that tampered numbers refute."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from pages import standalone
from published import CVPENDULUM
from reported import page_of, require_figures, require_refused, rows_of, stems_of

from daebench.errors import RunFailed
from daebench.methods.solvers.error_test import TREATMENTS
from daebench.methods.solvers.ida import DEFAULT_TREATMENTS, Ida
from daebench.pages.report import build
from daebench.pages.report.claims import ClaimRefuted
from daebench.reference.keep import store
from daebench.reports import tolerances
from daebench.reports.tolerances import Numbers, check, draw, tables
from daebench.reports.tolerances import exact as _tolerances_exact
from daebench.reports.tolerances import projection as _tolerances_projection
from daebench.reports.tolerances import runs as _tolerances_runs
from daebench.reports.tolerances.accuracy import luck, to_ask, typical
from daebench.reports.tolerances.cost import check_cost, check_estimate, last_decade, slopes
from daebench.reports.tolerances.drift import EXPONENTS, T_LONG, TOL, fit_power, windows
from daebench.reports.tolerances.exact import ROUNDINGS, Exact, exact, refined
from daebench.reports.tolerances.projection import EXAMPLE_TOLERANCES, FIXED, PLAIN, PRINTED, PROJECTED, compared, example
from daebench.reports.tolerances.runs import FAST, FORMULATIONS, IVPS, REACHED, STARTS, TOLERANCES, difference, end, motion, reason, series
from daebench.reports.tolerances.treatments import sentences, shown
from daebench.runs.request import Request, WorkLimit

WHERE = "ida:index2 on planar_pendulum, case horizontal, stopped at t = 3 of 10 (tol = 1e-05)"
SENTENCES = {
    "reached": (None, REACHED, ""),
    "error-test": (
        f"{WHERE}: the local error test failed too often, or with the smallest step; use a larger tol.",
        "error test",
        "the local error test failed too often, or with the smallest step",
    ),
    "newton": (
        f"{WHERE}: Newton's iteration failed too often, or with the smallest step; use a larger tol.",
        "Newton",
        "Newton's iteration failed too often, or with the smallest step",
    ),
    "collapse": (
        f"{WHERE}: the step size has collapsed to 1.0e-16; use a larger tol.",
        "step size",
        "the step size has collapsed to 1.0e-16",
    ),
    "patience": (
        f"{WHERE}: 400000 calls of the residual were not enough; use a larger tol.",
        "patience",
        "400000 calls of the residual were not enough",
    ),
    "other": (f"{WHERE}: SUNDIALS refuses to go on (what: a (b)); see.", "other", "SUNDIALS refuses to go on (what: a (b))"),
}


@pytest.mark.parametrize(("failure", "kind", "words"), SENTENCES.values(), ids=list(SENTENCES))
def test_a_run_s_end_is_read_off_its_sentence(failure, kind, words):
    assert end(failure) == kind
    assert reason(failure) == words


def test_windows_are_half_an_octave_long_and_give_the_largest_value_of_each():
    t = np.arange(801) / 8
    middles, largest = windows(t, t**2)
    assert np.allclose(middles[1:] / middles[:-1], math.sqrt(2), rtol=1e-12)
    ends = 100.0 * 2.0 ** (-np.arange(10, -1, -1) / 2)
    assert np.array_equal(largest, (np.floor(ends * 8) / 8) ** 2)


@pytest.mark.parametrize("power", [0.0, 1.0, 2.0, 3.0], ids=str)
def test_a_power_under_an_oscillation_is_found(power):
    t = np.arange(801) / 8
    law = fit_power(*windows(t, 3e-9 * t**power * np.abs(np.sin(7 * t))), floor=1e-14)
    assert abs(law.exponent - power) < max(0.06, 4 * law.error)
    assert law.windows == 11
    assert 2e-9 < law.factor < 4e-9


def test_round_off_and_saturation_take_no_part_in_a_fit():
    t = 100 * 2.0 ** (-np.arange(10, -1, -1) / 2)
    pure = 1e-9 * t**3
    spoilt = np.where(pure < 1e-6, 1e-8, np.where(pure > 2e-5, 0.3, pure))
    law = fit_power(t, spoilt, floor=1e-9, ceiling=0.1)
    assert law.windows == int(np.sum((pure >= 1e-6) & (pure <= 2e-5)))
    assert math.isnan(law.exponent)
    pure[-1] = 5e-8
    law = fit_power(t, np.where(t > 40, 0.3, 1e-9 * t**3), floor=1e-14, ceiling=0.1)
    assert abs(law.exponent - 3) < 1e-9


def test_what_follows_saturation_is_not_used_even_where_it_is_small_again():
    t = 100 * 2.0 ** (-np.arange(10, -1, -1) / 2)
    value = 1e-9 * t**2
    value[6], value[-1] = 0.5, 1e-12
    assert fit_power(t, value, floor=1e-16, ceiling=0.1).windows == 6


def test_a_run_that_is_given_up_says_so(plain_functions, get_ivp):
    request = Request(value=1e-6, t_end=0.5, points=5, work_limit=WorkLimit(30, 1000, 100))
    run = Ida("index2").solve(get_ivp("planar"), request)
    assert end(run.failure) == "patience"
    assert 0 < run.t[-1] < 0.5


@pytest.fixture
def tiny(plain_functions, get_ivp, monkeypatch):
    """Have the planar pendulum run to t = 0.5 against a reference solution of which one number is off by 1e-3."""
    ivp = get_ivp("planar")
    t = np.linspace(0.0, 0.5, 5)
    q = Ida("index1").solve(ivp, Request(value=1e-12, t_end=0.5, points=5)).q
    q[2, 1] += 1e-3
    reference = Exact(t, q, 1e-15, 1.0, 0 * q)
    for work_limit in ("WORK_LIMIT", "SHORT_WORK_LIMIT"):
        monkeypatch.setattr(_tolerances_runs, work_limit, WorkLimit(300, 1000, 100))
    monkeypatch.setattr(_tolerances_runs, "motion", lambda name, start: (ivp, reference))


def test_a_series_has_errors_estimates_and_ends(tiny):
    rows = pd.DataFrame(series("planar_pendulum-rotating", 0, "index2", (1e-4, 1e-5, 1e-8), ("derivative", "none")))
    assert list(rows["cure"]) == ["derivative"] * 3 + ["none"] * 3
    assert list(rows["default"]) == [True] * 3 + [False] * 3
    good = rows[:3]
    assert abs(good["error"].iloc[2] - 1e-3) < 1e-6
    assert math.isnan(good["estimate"].iloc[2])
    assert good["estimate"].iloc[0] < 1e-3
    failed = rows["end"] != REACHED
    assert np.array_equal(failed, rows["error"].isna())
    assert np.array_equal(failed, rows["reason"] != "")


def test_a_difference_needs_two_complete_runs():
    one = SimpleNamespace(failure=None, q=np.zeros((3, 2)))
    other = SimpleNamespace(failure=None, q=np.array([[0, 0], [0, -2.0], [1, 0]]))
    assert difference(one, other) == 2.0
    assert math.isnan(difference(one, SimpleNamespace(failure="stopped", q=other.q)))


def test_a_reference_that_is_too_short_is_refused(get_ivp, monkeypatch):
    short = SimpleNamespace(name="planar_pendulum-rotating", horizon=100.0, double_horizon=7.5)
    monkeypatch.setattr(store, "find", lambda problem, case: short)
    with pytest.raises(RunFailed, match=r"can be used only up to t = 7\.5, and 10 is needed"):
        exact(get_ivp("planar"), 10.0)


def test_errors_know_the_bound_of_their_reference_and_the_rounding(get_ivp, monkeypatch):
    bound = {"q": np.array([[0, 1e-18], [3e-17, 0], [1.0, 1.0]])}
    long = SimpleNamespace(name="x", horizon=2.0, double_horizon=math.inf, t=np.array([0.0, 1.0, 2.0]), q=np.full((3, 2), 2.0), bound=bound)
    long.p = 0 * long.q
    long.amplification = np.array([1.0, 5.0, 9.0])
    monkeypatch.setattr(store, "find", lambda problem, case: long)
    found = exact(get_ivp("planar"), 1.0)
    assert found.floor == 3e-17 + np.finfo(float).eps
    assert (len(found.t), found.amplification) == (2, 5.0)


@pytest.mark.parametrize("name", ["planar_pendulum-horizontal", FAST])
def test_a_refined_motion_is_within_its_bound_of_the_certified_one(name):
    ivp, certified = motion(name, 0)
    found = refined(ivp, certified.t)
    off = np.max(np.abs(found.q - certified.q))
    assert off <= found.floor + certified.floor
    assert found.floor < 1e-13
    assert found.floor > ROUNDINGS * np.finfo(float).eps * 0.9


def test_a_motion_that_is_not_resolved_has_a_bound_that_says_so(monkeypatch):
    monkeypatch.setattr(_tolerances_exact, "HALVINGS", (1, 2, 4))
    ivp, certified = motion(FAST, 0)
    found = refined(ivp, certified.t)
    assert 1e-9 < np.max(np.abs(found.q - certified.q)) < found.floor


def test_starts_are_neighbours_on_the_manifold_and_have_a_motion_of_their_own():
    (ivp, certified), (beside, other) = motion(FAST, 0), motion(FAST, 1)
    assert 1e-4 < np.max(np.abs(beside.q0 - ivp.q0)) < 0.05
    assert np.max(np.abs(other.q[0] - beside.q0)) == 0
    assert np.max(np.abs(beside.value("g", tuple(beside.q0)))) < 1e-15
    assert np.max(np.abs(other.q - certified.q)) > 1e-2


def test_methods_are_compared_for_the_same_time(monkeypatch):
    monkeypatch.setattr(_tolerances_projection, "TOLERANCES", (1e-4,))
    timed = _tolerances_projection.fastest
    monkeypatch.setattr(_tolerances_projection, "fastest", lambda *what: replace(timed(*what), seconds=5e-4))
    rows = pd.DataFrame(compared(FAST, 0, motion(FAST, 0)[1], {FIXED[0]: 1e-7, FIXED[1]: 2e-6})).set_index("method")
    assert list(rows.index) == [PLAIN, PROJECTED, *FIXED]
    assert rows["error"][FIXED[1]] < 1e-6 < rows["error"][PROJECTED] < 2
    assert [rows["steps"][method] for method in FIXED] == pytest.approx([5000, 250], rel=0.2)
    assert rows["turning"][PROJECTED] == pytest.approx(rows["speed"][PROJECTED], rel=1e-6)


def test_the_example_of_sundials_has_a_line_a_tolerance_and_method(monkeypatch):
    monkeypatch.setattr(_tolerances_projection, "EXAMPLE_TOLERANCES", EXAMPLE_TOLERANCES[1:2])
    rows = pd.DataFrame(example()).set_index("method")
    assert rows["error"][PROJECTED] == pytest.approx(rows["printed_error"][PROJECTED], rel=0.3)
    assert rows["g"][PROJECTED] < 1e-15 < rows["g"][PLAIN]


@pytest.mark.parametrize(("tol", "projected", "printed"), CVPENDULUM, ids=[" ".join(row[:2]) for row in CVPENDULUM])
def test_what_sundials_prints_is_what_the_report_says_that_it_prints(tol, projected, printed):
    numbers = printed.replace("|", " ").split()
    error, g, steps = PRINTED[float(tol), PROJECTED if projected == "YES" else PLAIN]
    assert (max(float(numbers[0]), float(numbers[1])), float(numbers[4]), int(numbers[5])) == (error, g, steps)


def test_what_to_ask_for_is_the_loosest_from_which_all_tighter_ones_do():
    rows = pd.DataFrame({"tol": [1e-3, 1e-4, 1e-5, 1e-6], "error": [1e-7, 1.0, 1e-7, 1e-8]})
    assert to_ask(rows, 1e-6) == 1e-5
    assert to_ask(rows, 1.0) == 1e-3
    assert math.isnan(to_ask(rows, 1e-9))
    rows.loc[3, "error"] = math.nan
    assert math.isnan(to_ask(rows, 1e-6))


POWERS = {"index3": 0.7, "index2": 0.9, "index1": 0.85, "ggl": 0.9}
FACTORS = {"index3": 30.0, "index2": 2.0, "index1": 20.0, "ggl": 3.0}
CURE_FACTORS = {
    "index3": {"atol": 1, "derivative": None, "none": None, "suppress": 0.5},
    "index2": {"atol": 2, "derivative": 1, "none": None, "suppress": 1},
    "ggl": {"atol": 1.5, "derivative": 1, "none": None, "suppress": 1},
    "index1": {"atol": 1, "derivative": 2, "none": 1, "suppress": 2},
}
LUCK = (1.0, 1.2, 0.9)
"""Errors from three starts, in parts of those from the first."""


def made_row(name, start, formulation, treatment, tol):
    factor = CURE_FACTORS[formulation][treatment]
    if treatment == "suppress" and formulation != "index1" and tol < 1e-8:
        factor = None
    error = math.nan if factor is None else LUCK[start] * factor * FACTORS[formulation] * tol ** POWERS[formulation]
    failed = factor is None
    return {
        "scene": name,
        "start": start,
        "formulation": formulation,
        "cure": treatment,
        "default": treatment == DEFAULT_TREATMENTS[formulation],
        "tol": tol,
        "error": error,
        "estimate": math.nan if tol == TOLERANCES[-1] else 0.9 * error,
        "floor": 1e-16,
        "amplification": 10.0,
        "g": 1e-6 if formulation == "index1" else tol,
        "Gv": tol,
        "steps": 100,
        "residuals": round(100 * tol**-0.2 * FACTORS[formulation]),
        "jacobians": 10,
        "t_reached": 0.0 if failed else 10.0,
        "end": "Newton" if failed else REACHED,
        "reason": SENTENCES["newton"][2] if failed else "",
    }


def law_row(formulation, tol, quantity):
    power = EXPONENTS[formulation].get(quantity, 0.2)
    return {"formulation": formulation, "tol": tol, "quantity": quantity, "exponent": power, "error": 0.1, "factor": 1e-9, "windows": 11}


def projected_rows(name):
    """Return made up rows of CVODE and RATTLE: projection harms on the fast pendulum, and helps elsewhere."""
    harm = 3.0 if name == FAST else 0.1
    for start in range(2):
        for tol in (1e-4, 1e-6, 1e-8, 1e-10, 1e-12):
            error = 50 * tol**0.9
            errors = {PLAIN: error, PROJECTED: harm * error, FIXED[0]: 1e-5, FIXED[1]: 1e-13 if tol > 1e-12 else 1e-16}
            for method, value in errors.items():
                off = {"speed": -value, "turning": -value * (0.1 if method == PLAIN else 1.0)}
                of = {"scene": name, "start": start, "tol": tol, "method": method, "error": value}
                yield of | {"seconds": 1e-3 * tol**-0.1, "steps": 100, "floor": 1e-15} | off


def example_rows():
    """Return made up rows of SUNDIALS' example beside what is printed."""
    for (tol, method), (error, g, steps) in PRINTED.items():
        printed = {"printed_error": error, "printed_g": g, "printed_steps": steps}
        ours = error if method == PROJECTED else error / 200
        yield {"tol": tol, "method": method} | printed | {"error": ours, "g": g if tol < 1e-5 else 0.5, "steps": steps}


@pytest.fixture(scope="module")
def numbers():
    """Return numbers made up so that all that the page says is true."""
    keys = [
        (name, start, f, treatment, tol)
        for name in IVPS
        for start in range(len(LUCK))
        for f in FORMULATIONS
        for treatment in (TREATMENTS if start == 0 else (DEFAULT_TREATMENTS[f],))
        for tol in TOLERANCES
    ]
    t = np.arange(801) / 8
    drift = [
        pd.DataFrame({"formulation": f, "tol": TOL, "t": t, "g": 1e-9, "energy": 1e-9 * t, "error": 1e-9 * t**2}) for f in FORMULATIONS
    ]
    laws = [
        law_row(f, tol, x) for f in FORMULATIONS for tol in ((TOL, 1e-8) if f == "index1" else (TOL,)) for x in ("g", "energy", "error")
    ]
    runs, projected = pd.DataFrame([made_row(*key) for key in keys]), [row for name in IVPS for row in projected_rows(name)]
    frames = runs, pd.concat(drift, ignore_index=True), pd.DataFrame(laws), pd.DataFrame(projected), pd.DataFrame(example_rows())
    return Numbers(*frames)


def default_rows(numbers):
    return numbers.runs[numbers.runs["default"]]


def test_the_story_passes_on_numbers_of_which_it_is_true(numbers):
    found = check(numbers)
    assert found.headline.done == found.headline.runs == len(LUCK) * len(IVPS) * len(FORMULATIONS) * len(TOLERANCES)
    assert found.headline.starts == len(LUCK)
    assert found.treatments.at_start == len(TOLERANCES)
    assert found.treatments.gain["index2"] == pytest.approx(2, rel=1e-12)
    assert found.treatments.gain["index1"] == pytest.approx(0.5, rel=1e-12)
    assert found.tight.best == pytest.approx(2e-12**0.9 * 2 / 2**0.9, rel=1e-9)
    assert found.treatments.suppressed.lost == {"index3": (30, 60), "index2": (30, 60), "ggl": (30, 60)}
    assert found.treatments.suppressed.gain == pytest.approx({"index3": 2, "index2": 2, "ggl": 1.5}, rel=1e-12)
    assert (found.treatments.stopped, found.treatments.ours) == (5 * 12 * 4 + 90, 0)
    assert (found.projected.better, found.projected.starts) == (1.0, 2)
    assert found.projected.helped.to_numpy() == pytest.approx(0.1, rel=1e-12)
    assert found.projected.worse.to_numpy() == pytest.approx(3, rel=1e-12)
    assert (found.example.unlike, found.example.off) == pytest.approx((200, 0))


def test_bands_are_deciles_over_starts_and_a_run_that_ended_early_is_the_worst():
    errors = [1e-3, math.nan, 3e-3, 2e-3]
    ends = [REACHED, "Newton", REACHED, REACHED]
    rows = pd.DataFrame({"scene": "x", "formulation": "ggl", "tol": 1e-6, "error": errors, "end": ends, "residuals": 7, "floor": 0.0})
    band = typical(rows).iloc[0]
    assert (band["low"], band["error"], band["high"], band["done"]) == (1e-3, 2e-3, 3e-3, 0.75)
    lost = typical(rows.assign(error=[1e-3, math.nan, math.nan, math.nan])).iloc[0]
    assert lost["low"] == 1e-3
    assert math.isnan(lost["error"])
    assert math.isnan(lost["high"])


def test_a_single_start_may_be_off_by_luck(numbers):
    rows = default_rows(numbers)
    found = luck(rows, typical(rows))
    assert found.most == pytest.approx(1.0 / 0.9, rel=1e-9)
    assert (found.factor, found.astray) == pytest.approx((1.0, 0.0))
    lucky = rows.assign(error=rows["error"].where(rows["start"] != 0, 0.1 * rows["error"]))
    assert luck(lucky, typical(lucky)).astray == 1.0


def test_powers_of_the_tolerance_are_found(numbers):
    found = slopes(typical(default_rows(numbers)))
    for formulation, power in POWERS.items():
        assert found.loc[formulation].to_numpy() == pytest.approx(power, abs=1e-9)


def test_the_last_decade_is_compared_with_the_one_before(numbers):
    found = last_decade(typical(default_rows(numbers)))
    assert len(found) == len(IVPS) * len(FORMULATIONS)
    assert found["residuals"].to_numpy() == pytest.approx(10**0.2, rel=1e-3)
    assert set(np.round(np.log10(found["error"]), 6)) == {-power for power in POWERS.values()}


def test_an_accuracy_costs_the_calls_of_the_run_that_gives_it(numbers):
    rows = typical(default_rows(numbers))
    cost = check_cost(rows)
    assert cost.least == pytest.approx(cost.most)
    assert cost.never == []
    lost = rows["error"].where(~((rows["scene"] == FAST) & (rows["formulation"] == "index3")), 1.0)
    assert check_cost(rows.assign(error=lost)).never == [IVPS[FAST]]


def test_estimates_are_counted_where_there_are_any(numbers):
    rows = default_rows(numbers)
    found = check_estimate(rows)
    assert found.n == found.close == int(np.sum((rows["error"] < 0.1) & rows["estimate"].notna()))
    assert (found.least, found.most) == pytest.approx((0.9, 0.9))


def changed(frame, value, column, **where):
    chosen = np.ones(len(frame), dtype=bool)
    for name, wanted in where.items():
        chosen &= (frame[name] == wanted).to_numpy()
    assert chosen.any()
    return frame.assign(**{column: frame[column].where(~chosen, value)})


def in_runs(value, column, **where):
    return lambda n: replace(n, runs=changed(n.runs, value, column, **where))


def in_projected(value, column, **where):
    return lambda n: replace(n, projected=changed(n.projected, value, column, **where))


def in_example(value, column, **where):
    return lambda n: replace(n, example=changed(n.example, value, column, **where))


def in_laws(value, **where):
    return lambda n: replace(n, laws=changed(n.laws, value, "exponent", **where))


SLOW = "spherical_pendulum-fig1.1"
TIGHT = {"tol": 1e-12, "default": True}
TAMPERED = {
    "a run is as accurate as asked": in_runs(1e-4, "error", formulation="ggl", cure="derivative", tol=1e-3, scene=SLOW),
    "1e-12 is nearly reached": in_runs(5e-12, "error", formulation="ggl", **TIGHT),
    "a run at 1e-12 failed": in_runs("Newton", "end", formulation="ggl", scene=SLOW, **TIGHT),
    "index 3 is not the worst": in_runs(1e-11, "error", formulation="index3", scene=SLOW, **TIGHT),
    "index 1 is the best": in_runs(1.2e-11, "error", formulation="index1", scene="pendulum_chain-horizontal5", **TIGHT),
    "index 1 stays on the constraint": in_runs(1e-12, "g", formulation="index1", **TIGHT),
    "the reference is too coarse": in_runs(1e-9, "floor", scene=FAST),
    "a cured run failed": in_runs("error test", "end", formulation="ggl", cure="atol", tol=1e-5, scene=SLOW),
    "plain index 3 moves on": in_runs(1.0, "t_reached", formulation="index3", cure="none", scene=FAST, tol=1e-7),
    "plain index 2 works": in_runs(REACHED, "end", formulation="index2", cure="none"),
    "derivatives rescue index 3": in_runs(REACHED, "end", formulation="index3", cure="derivative"),
    "atol is better for index 2": in_runs(1e-16, "error", formulation="index2", cure="atol"),
    "derivatives are better for index 1": in_runs(1e-16, "error", formulation="index1", cure="derivative"),
    "estimates mislead": in_runs(1e-16, "estimate", formulation="index2"),
    "index 3 is cheap": in_runs(1, "residuals", formulation="index3"),
    "index 2 never gets to 1e-6": in_runs(2e-6, "error", formulation="index2", scene=FAST, tol=1e-14),
    "index 1 drifts like t": in_laws(1.0, formulation="index1", quantity="g"),
    "index 1 is off like t^2": in_laws(2.2, formulation="index1", quantity="error"),
    "a law is missing": in_laws(math.nan, formulation="index2", quantity="error"),
    "GGL leaves the constraint": in_laws(1.0, formulation="ggl", quantity="g"),
    "suppress works at index 3": in_runs(REACHED, "end", formulation="index3", cure="suppress"),
    "suppress fails at a loose tolerance": in_runs("Newton", "end", formulation="index2", cure="suppress", tol=1e-3),
    "suppress is no better": in_runs(1.0, "error", formulation="ggl", cure="suppress"),
    "the error test fails with suppress": in_runs("error test", "end", cure="suppress", end="Newton"),
    "projection helps on the fast pendulum": in_projected(1e-20, "error", scene=FAST, method=PROJECTED),
    "projection harms on the double pendulum": in_projected(0.2, "error", scene="double_pendulum-horizontal", method=PROJECTED),
    "angular velocity is no better than speed": in_projected(1e-3, "turning", scene=FAST, method=PLAIN, tol=1e-8),
    "projection keeps the speed": in_projected(1e-20, "speed", scene=FAST, method=PROJECTED),
    "a composition is no better": in_projected(1.0, "error", method=FIXED[1]),
    "RATTLE is best at 1e-12": in_projected(1e-16, "error", method=FIXED[0]),
    "projected, SUNDIALS prints another error": in_example(1.0, "error", method=PROJECTED, tol=1e-7),
    "without projection both right sides agree": in_example(0.5, "error", method=PLAIN),
    "(1.18) stays on the circle": in_example(1e-3, "g", method=PLAIN, tol=1e-5),
}


@pytest.mark.parametrize("tamper", TAMPERED.values(), ids=list(TAMPERED))
def test_a_tampered_number_refutes_the_story(numbers, tamper):
    with pytest.raises(ClaimRefuted):
        check(tamper(numbers))


def test_no_error_is_drawn_below_what_its_reference_can_tell():
    rows = pd.DataFrame({"error": [1e-20, 1e-3, math.nan], "floor": [1e-16, 1e-16, 1e-16]})
    assert shown(rows).to_numpy()[:2].tolist() == [1e-16, 1e-3]
    assert math.isnan(shown(rows).iloc[2])


def test_a_run_without_a_result_is_told_in_words(numbers):
    failed = numbers.runs[(numbers.runs["scene"] == FAST) & (numbers.runs["end"] == "Newton")].head(2)
    said = str(sentences(failed))
    assert "Newton's iteration did not converge" in said.replace("&#39;", "'")
    assert said.count("spherical pendulum, fast") == 2
    assert " and " in said


def test_tables_are_kept_as_csv_and_shown_as_html(numbers, tmp_path):
    assert rows_of(tables(numbers, None), tmp_path) == {
        "runs": 1440,
        "laws": 15,
        "reached": 20,
        "ends": 16,
        "projected": 200,
        "example": 10,
    }


def test_the_page_is_made_of_numbers_and_words(numbers, tmp_path, monkeypatch):
    text = page_of(tolerances, "tolerances", numbers, FIGURES, tmp_path, monkeypatch)
    assert "all 720 runs" in text


def test_a_refuted_claim_leaves_no_page(numbers, tmp_path, monkeypatch):
    require_refused(
        tolerances, "tolerances", TAMPERED["GGL leaves the constraint"](numbers), "g of ggl hardly grows", tmp_path, monkeypatch
    )


FIGURES = ("accuracy", "cures", "drift", "cost", "estimate", "projected")


@pytest.mark.slow
def test_the_figures_show_numbers_that_are_beside_them(numbers, tmp_path):
    assert stems_of(draw(numbers, None, tmp_path)) == set(FIGURES)
    require_figures(FIGURES, tmp_path)


@pytest.mark.slow
@pytest.mark.exhaustive
def test_the_whole_report_is_made_and_its_page_loads_nothing(tmp_path, looks_right):
    told = []
    page = build("tolerances", tmp_path, lambda fraction, label: told.append(fraction))
    source = page.read_text(encoding="utf-8")
    standalone(page)
    looks_right(page)
    assert source.count("<svg") == len(FIGURES)
    assert told == sorted(told)
    assert (told[0], told[-1]) == (0.0, 1.0)
    runs = pd.read_csv(page.parent / "tables" / "runs.csv")
    assert len(runs) == len(IVPS) * len(FORMULATIONS) * (len(TREATMENTS) + STARTS - 1) * len(TOLERANCES)
    assert exact(_tolerances_runs.ivp_of(FAST), T_LONG).t[-1] == T_LONG
