"""The report on tolerances: fits of powers, ends of runs in words, work limits, and claims that tampered numbers refute."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from pages import standalone
from reported import page_of, require_figures, require_refused, rows_of

from daebench.errors import RunFailed
from daebench.methods.solvers.ida import DEFAULT_TREATMENTS, Ida
from daebench.methods.solvers.multiplier_treatment import TREATMENTS
from daebench.pages.report import build
from daebench.pages.report.claims import ClaimRefuted
from daebench.reference.keep import store
from daebench.reports import tolerances
from daebench.reports.tolerances import runs as _tolerances_runs
from daebench.reports.tolerances.claims import EXPONENTS, check, check_cost, check_estimate, last_decade, slopes
from daebench.reports.tolerances.drift import T_LONG, TOL, fit_power, windows
from daebench.reports.tolerances.exact import Exact, exact
from daebench.reports.tolerances.figures import draw, shown
from daebench.reports.tolerances.numbers import Numbers
from daebench.reports.tolerances.runs import FAST, FORMULATIONS, IVPS, REACHED, TOLERANCES, difference, end, reason, series
from daebench.reports.tolerances.tables import sentences, tables, to_ask
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
    reference = Exact(t, q, 1e-15, 1.0)
    for work_limit in ("WORK_LIMIT", "SHORT_WORK_LIMIT"):
        monkeypatch.setattr(_tolerances_runs, work_limit, WorkLimit(300, 1000, 100))
    monkeypatch.setattr(_tolerances_runs, "T_END", 0.5)
    monkeypatch.setattr(_tolerances_runs.solve, "__defaults__", (0.5,))
    monkeypatch.setattr(_tolerances_runs, "ivp_of", lambda name: ivp)
    monkeypatch.setattr(_tolerances_runs, "exact_of", lambda name, t_end: reference)


def test_a_series_has_errors_estimates_and_ends(tiny):
    rows = pd.DataFrame(series("planar_pendulum-rotating", "index2", (1e-4, 1e-5, 1e-8), ("derivative", "none")))
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
    with pytest.raises(RunFailed, match=r"of use up to t = 7\.5 only, and 10 is needed"):
        exact(get_ivp("planar"), 10.0)


def test_errors_know_the_bound_of_their_reference_and_the_rounding(get_ivp, monkeypatch):
    bound = {"q": np.array([[0, 1e-18], [3e-17, 0], [1.0, 1.0]])}
    long = SimpleNamespace(name="x", horizon=2.0, double_horizon=math.inf, t=np.array([0.0, 1.0, 2.0]), q=np.full((3, 2), 2.0), bound=bound)
    long.amplification = np.array([1.0, 5.0, 9.0])
    monkeypatch.setattr(store, "find", lambda problem, case: long)
    found = exact(get_ivp("planar"), 1.0)
    assert found.floor == 3e-17 + np.finfo(float).eps
    assert (len(found.t), found.amplification) == (2, 5.0)


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
    "index3": {"atol": 1, "derivative": None, "none": None},
    "index2": {"atol": 2, "derivative": 1, "none": None},
    "ggl": {"atol": 1.5, "derivative": 1, "none": None},
    "index1": {"atol": 1, "derivative": 2, "none": 1},
}


def made_row(name, formulation, treatment, tol):
    problem, _, case = name.partition("-")
    factor = CURE_FACTORS[formulation][treatment]
    error = math.nan if factor is None else factor * FACTORS[formulation] * tol ** POWERS[formulation]
    failed = factor is None
    return {
        "problem": problem,
        "case": case,
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


@pytest.fixture(scope="module")
def numbers():
    """Return numbers made up so that all that the page says is true."""
    keys = [(name, f, treatment, tol) for name in IVPS for f in FORMULATIONS for treatment in TREATMENTS for tol in TOLERANCES]
    t = np.arange(801) / 8
    drift = [
        pd.DataFrame({"formulation": f, "tol": TOL, "t": t, "g": 1e-9, "energy": 1e-9 * t, "error": 1e-9 * t**2}) for f in FORMULATIONS
    ]
    laws = [
        law_row(f, tol, x) for f in FORMULATIONS for tol in ((TOL, 1e-8) if f == "index1" else (TOL,)) for x in ("g", "energy", "error")
    ]
    return Numbers(pd.DataFrame([made_row(*key) for key in keys]), pd.concat(drift, ignore_index=True), pd.DataFrame(laws))


def default_rows(numbers, name=None):
    runs = numbers.runs.assign(scene=numbers.runs["problem"] + "-" + numbers.runs["case"])
    return runs[runs["default"] & ((runs["scene"] == name) | (name is None))]


def test_the_story_passes_on_numbers_of_which_it_is_true(numbers):
    found = check(numbers)
    assert found.headline.done == found.headline.runs == len(IVPS) * len(FORMULATIONS) * len(TOLERANCES)
    assert found.treatments.at_start == len(TOLERANCES)
    assert found.treatments.gain["index2"] == pytest.approx(2, rel=1e-12)
    assert found.treatments.gain["index1"] == pytest.approx(0.5, rel=1e-12)
    assert found.tight.best == pytest.approx(2e-12**0.9 * 2 / 2**0.9, rel=1e-9)
    assert (found.treatments.stopped, found.treatments.ours) == (5 * 12 * 4, 0)


def test_powers_of_the_tolerance_are_found(numbers):
    found = slopes(default_rows(numbers))
    for formulation, power in POWERS.items():
        assert found.loc[formulation].to_numpy() == pytest.approx(power, abs=1e-9)


def test_the_last_decade_is_compared_with_the_one_before(numbers):
    found = last_decade(default_rows(numbers))
    assert len(found) == len(IVPS) * len(FORMULATIONS)
    assert found["residuals"].to_numpy() == pytest.approx(10**0.2, rel=1e-3)
    assert set(np.round(np.log10(found["error"]), 6)) == {-power for power in POWERS.values()}


def test_an_accuracy_costs_the_calls_of_the_run_that_gives_it(numbers):
    rows = default_rows(numbers)
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


def in_laws(value, **where):
    return lambda n: replace(n, laws=changed(n.laws, value, "exponent", **where))


TIGHT = {"tol": 1e-12, "default": True}
TAMPERED = {
    "a run is as accurate as asked": in_runs(1e-4, "error", formulation="ggl", cure="derivative", tol=1e-3, case="fig1.1"),
    "1e-12 is nearly reached": in_runs(5e-12, "error", formulation="ggl", **TIGHT),
    "a run at 1e-12 failed": in_runs("Newton", "end", formulation="ggl", case="fig1.1", **TIGHT),
    "index 3 is not the worst": in_runs(1e-11, "error", formulation="index3", case="fig1.1", **TIGHT),
    "index 1 is the best": in_runs(1.2e-11, "error", formulation="index1", case="horizontal5", **TIGHT),
    "index 1 stays on the constraint": in_runs(1e-12, "g", formulation="index1", **TIGHT),
    "the reference is too coarse": in_runs(1e-9, "floor", case="fig1.2"),
    "a cured run failed": in_runs("error test", "end", formulation="ggl", cure="atol", tol=1e-5, case="fig1.1"),
    "plain index 3 moves on": in_runs(1.0, "t_reached", formulation="index3", cure="none", case="fig1.2", tol=1e-7),
    "plain index 2 works": in_runs(REACHED, "end", formulation="index2", cure="none"),
    "derivatives rescue index 3": in_runs(REACHED, "end", formulation="index3", cure="derivative"),
    "atol is better for index 2": in_runs(1e-16, "error", formulation="index2", cure="atol"),
    "derivatives are better for index 1": in_runs(1e-16, "error", formulation="index1", cure="derivative"),
    "estimates mislead": in_runs(1e-16, "estimate", formulation="index2"),
    "index 3 is cheap": in_runs(1, "residuals", formulation="index3"),
    "index 2 never gets to 1e-6": in_runs(2e-6, "error", formulation="index2", case="fig1.2", tol=1e-14),
    "index 1 drifts like t": in_laws(1.0, formulation="index1", quantity="g"),
    "index 1 is off like t^2": in_laws(2.2, formulation="index1", quantity="error"),
    "a law is missing": in_laws(math.nan, formulation="index2", quantity="error"),
    "GGL leaves the constraint": in_laws(1.0, formulation="ggl", quantity="g"),
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
    failed = numbers.runs.assign(scene=FAST).loc[lambda rows: rows["end"] == "Newton"].head(2)
    said = str(sentences(failed))
    assert "Newton's iteration did not converge" in said.replace("&#39;", "'")
    assert said.count("spherical pendulum, fast") == 2
    assert " and " in said


def test_tables_are_kept_as_csv_and_shown_as_html(numbers, tmp_path):
    assert rows_of(tables(numbers, tmp_path), tmp_path) == {"runs": 720, "laws": 15, "reached": 20, "ends": 12}


def test_the_page_is_made_of_numbers_and_words(numbers, tmp_path, monkeypatch):
    text = page_of(tolerances, "tolerances", numbers, FIGURES, tmp_path, monkeypatch)
    assert "all 240 runs" in text


def test_a_refuted_claim_leaves_no_page(numbers, tmp_path, monkeypatch):
    require_refused(
        tolerances, "tolerances", TAMPERED["GGL leaves the constraint"](numbers), "g of ggl hardly grows", tmp_path, monkeypatch
    )


FIGURES = ("accuracy", "cures", "drift", "cost", "estimate")


@pytest.mark.slow
def test_the_figures_show_numbers_that_are_beside_them(numbers, tmp_path):
    assert set(draw(numbers, tmp_path)) == set(FIGURES)
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
    assert len(runs) == len(IVPS) * len(FORMULATIONS) * len(TREATMENTS) * len(TOLERANCES)
    assert exact(_tolerances_runs.ivp_of(FAST), T_LONG).t[-1] == T_LONG
