"""The report on tolerances: fits of powers, ends of runs in words, work limits, and claims that tampered numbers refute."""

import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from published import CVPENDULUM
from reported import tables_of_page
from tampered import changed

from daebench.methods.solvers.error_test import TREATMENTS
from daebench.methods.solvers.ida import DEFAULT_TREATMENTS, Ida
from daebench.pages.report.claims import ClaimRefuted
from daebench.reports import tolerances
from daebench.reports.tolerances import Numbers, check
from daebench.reports.tolerances import projection as _tolerances_projection
from daebench.reports.tolerances import runs as _tolerances_runs
from daebench.reports.tolerances.accuracy import to_ask
from daebench.reports.tolerances.drift import EXPONENTS, TOL, fit_power, windows
from daebench.reports.tolerances.exact import ROUNDINGS, Exact, refined
from daebench.reports.tolerances.projection import EXAMPLE_TOLERANCES, FIXED, PLAIN, PRINTED, PROJECTED, compared, example
from daebench.reports.tolerances.runs import FAST, FORMULATIONS, IVPS, REACHED, TOLERANCES, end, motion, reason, series
from daebench.runs.request import Request, WorkLimit

WHERE = "ida:index2 on planar_pendulum, case horizontal, stopped at t = 3 of 10 (tol = 1e-05)"
ENDS = {
    "the local error test failed too often, or with the smallest step": "error test",
    "Newton's iteration failed too often, or with the smallest step": "Newton",
    "the step size has collapsed to 1.0e-16": "step size",
    "400000 calls of the residual were not enough": "patience",
    "SUNDIALS refuses to go on (what: a (b))": "other",
}
"""Reasons for which runs stop, and their kinds."""


def test_a_run_s_end_is_read_off_its_sentence():
    assert (end(None), reason(None)) == (REACHED, "")
    sentences = {f"{WHERE}: {words}; use a larger tol.": words for words in ENDS}
    assert {reason(sentence): end(sentence) for sentence in sentences} == ENDS


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


@pytest.mark.parametrize("name", ["planar_pendulum-horizontal", FAST])
def test_a_refined_motion_is_within_its_bound_of_the_certified_one(name):
    ivp, certified = motion(name, 0)
    found = refined(ivp, certified.t)
    off = np.max(np.abs(found.q - certified.q))
    assert off <= found.floor + certified.floor
    assert found.floor < 1e-13
    assert found.floor > ROUNDINGS * np.finfo(float).eps * 0.9


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
        "reason": next(words for words, kind in ENDS.items() if kind == "Newton") if failed else "",
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


def test_the_story_passes_on_numbers_of_which_it_is_true(numbers):
    found = check(numbers)
    assert found.headline.done == found.headline.runs == 720
    assert (found.headline.starts, found.treatments.at_start) == (len(LUCK), len(TOLERANCES))
    assert found.treatments.gain == pytest.approx(found.treatments.gain | {"index2": 2, "index1": 0.5}, rel=1e-12)
    assert found.tight.best == pytest.approx(2e-12**0.9 * 2 / 2**0.9, rel=1e-9)
    assert found.treatments.suppressed.lost == dict.fromkeys(("index3", "index2", "ggl"), (30, 60))
    assert found.treatments.suppressed.gain == pytest.approx({"index3": 2, "index2": 2, "ggl": 1.5}, rel=1e-12)
    assert (found.treatments.stopped, found.treatments.ours) == (5 * 12 * 4 + 90, 0)
    assert (found.projected.better, found.projected.starts) == (1.0, 2)
    assert found.projected.helped.to_numpy() == pytest.approx(0.1, rel=1e-12)
    assert found.projected.worse.to_numpy() == pytest.approx(3, rel=1e-12)
    assert (found.example.unlike, found.example.off) == pytest.approx((200, 0))


SLOW = "spherical_pendulum-fig1.1"
TAMPERED = {
    "a run is as accurate as asked": changed(
        "runs", "error", 1e-4, f"formulation == 'ggl' and cure == 'derivative' and tol == 0.001 and scene == {SLOW!r}"
    ),
    "1e-12 is nearly reached": changed("runs", "error", 5e-12, "formulation == 'ggl' and tol == 1e-12 and default"),
    "index 3 is not the worst": changed(
        "runs", "error", 1e-11, f"formulation == 'index3' and scene == {SLOW!r} and tol == 1e-12 and default"
    ),
    "index 1 stays on the constraint": changed("runs", "g", 1e-12, "formulation == 'index1' and tol == 1e-12 and default"),
    "the reference is too coarse": changed("runs", "floor", 1e-9, f"scene == {FAST!r}"),
    "plain index 3 moves on": changed(
        "runs", "t_reached", 1.0, f"formulation == 'index3' and cure == 'none' and scene == {FAST!r} and tol == 1e-07"
    ),
    "derivatives rescue index 3": changed("runs", "end", REACHED, "formulation == 'index3' and cure == 'derivative'"),
    "estimates mislead": changed("runs", "estimate", 1e-16, "formulation == 'index2'"),
    "index 3 is cheap": changed("runs", "residuals", 1, "formulation == 'index3'"),
    "index 1 drifts like t": changed("laws", "exponent", 1.0, "formulation == 'index1' and quantity == 'g'"),
    "GGL leaves the constraint": changed("laws", "exponent", 1.0, "formulation == 'ggl' and quantity == 'g'"),
    "suppress works at index 3": changed("runs", "end", REACHED, "formulation == 'index3' and cure == 'suppress'"),
    "projection helps on the fast pendulum": changed("projected", "error", 1e-20, f"scene == {FAST!r} and method == {PROJECTED!r}"),
    "turning is no better": changed("projected", "turning", 1e-3, f"scene == {FAST!r} and method == {PLAIN!r} and tol == 1e-08"),
    "a composition is no better": changed("projected", "error", 1.0, f"method == {FIXED[1]!r}"),
    "projected, SUNDIALS prints another error": changed("example", "error", 1.0, f"method == {PROJECTED!r} and tol == 1e-07"),
    "(1.18) stays on the circle": changed("example", "g", 1e-3, f"method == {PLAIN!r} and tol == 1e-05"),
}


@pytest.mark.parametrize("tamper", TAMPERED.values(), ids=list(TAMPERED))
def test_a_tampered_number_refutes_the_story(numbers, tamper):
    with pytest.raises(ClaimRefuted):
        check(tamper(numbers))


def test_the_page_is_made_of_numbers(numbers, tmp_path, monkeypatch):
    rows = tables_of_page(tolerances, "tolerances", numbers, FIGURES, tmp_path, monkeypatch)
    assert rows == {"runs": 1440, "laws": 15, "reached": 20, "ends": 16, "projected": 200, "example": 10}


FIGURES = ("accuracy", "cures", "drift", "cost", "estimate", "projected")


def test_what_to_ask_for_is_the_loosest_from_which_all_tighter_ones_do():
    rows = pd.DataFrame({"tol": [1e-3, 1e-4, 1e-5, 1e-6], "error": [1e-7, 1.0, 1e-7, 1e-8]})
    assert [to_ask(rows, wanted) for wanted in (1e-6, 1.0)] == [1e-5, 1e-3]
    assert math.isnan(to_ask(rows, 1e-9))
    assert math.isnan(to_ask(rows.assign(error=rows["error"].where(rows["tol"] > 1e-6)), 1e-6))
