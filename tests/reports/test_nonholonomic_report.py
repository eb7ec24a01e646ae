"""The report on nonholonomic problems: its measurements on short runs, claims that faults refute, tables, figures and the page."""

import numpy as np
import pandas as pd
import pytest
from reported import tables_of_page
from tampered import changed

from daebench.pages.report.claims import ClaimRefuted
from daebench.reports import nonholonomic
from daebench.reports.nonholonomic import Numbers, check, classes, levels, motions, rates
from daebench.reports.nonholonomic.motions import CONTACT, INTEGRABLE, METHODS, MOTIONS, PAIR, PERTURBED, SHIFTED, SYMMETRIC, TRANSMISSION

FIGURES = ("energy", "rates", "levels", "cost")


def verdict(name, problem, case, kind):
    """Return the verdict that the page says, or "" where a method needs another form of H."""
    if case == SHIFTED and name in ("nonholonomic_newmark", PAIR):
        return ""
    reversible = kind in (INTEGRABLE, PERTURBED)
    good = name in (*SYMMETRIC, PAIR, "gni") and reversible
    good |= (name, case) == ("gni", "uneven") or (name == "gauss2+proj" and problem == CONTACT and reversible)
    return "bounded" if good else "drifts"


@pytest.fixture(scope="module")
def numbers():
    """Return numbers of which all that the page says is true."""
    runs = [
        {"problem": problem, "case": case, "class": kind, "method": name, "verdict": verdict(name, problem, case, kind), "size": 0.02}
        for (problem, case), kind in MOTIONS.items()
        for name in METHODS
    ]
    runs = pd.DataFrame(runs).assign(driver="bounded", lost=0.0, steps=5e5, failure="", Gv=1e-15)
    runs.loc[(runs["method"] == "dla") & (runs["case"] == "uneven"), "lost"] = 0.999
    t = np.geomspace(1, 1e5, 20)
    series = [
        pd.DataFrame({"problem": p, "case": case, "method": name, "t": t, "size": 1e-6 * t}) for p, case in MOTIONS for name in METHODS
    ]
    h = np.array(rates.STEPS)
    slopes = [
        pd.DataFrame({"case": case, "method": name, "h": h, "rate": -(1e-9 if case == "even" else 1.0) * h ** (2 if name == "dla" else 4)})
        for case in rates.CASES
        for name in motions.SCHEMES
    ]
    off, windows = [], []
    for name, factor in zip(motions.SOLVERS, (3.0, 300.0), strict=True):
        off += [{"method": name, "tol": tol, "Gv": factor * tol, "energy": factor * 10 * tol, "steps": 1000} for tol in levels.TOLERANCES]
        grown = np.linspace(0.1, 1, levels.WINDOWS) if factor > 10 else 1.0
        windows += [
            pd.DataFrame({"method": name, "tol": tol, "t": np.linspace(20, 2000, levels.WINDOWS), "Gv": factor * tol * grown})
            for tol in levels.TOLERANCES
        ]
    order = {name: 2 if name in ("dla", "gni") else 4 for name in METHODS}
    n = 2.0 ** np.arange(4, 18)
    priced = [
        pd.DataFrame({"method": name, "value": 1 / n, "error_q": (20 / n) ** order[name], "evaluations": n * (1 if "rk4" in name else 4)})
        for name in METHODS
    ]
    priced = pd.concat(priced, ignore_index=True).assign(
        bound_q=1e-13, failure="", reference="exact", energy_verdict="bounded", seconds=np.nan
    )
    turning = pd.DataFrame({"method": METHODS, "energy": 1e-3, "turning": [0.6 if name == "gni" else 1e-13 for name in METHODS]})
    return Numbers(
        runs=runs,
        series=pd.concat(series, ignore_index=True),
        rates=pd.concat(slopes, ignore_index=True),
        levels=pd.DataFrame(off),
        levels_series=pd.concat(windows, ignore_index=True),
        sleigh=turning,
        cost=priced,
    )


TAMPERED = {
    "dla drifts on a reversible motion": changed("runs", "verdict", "drifts", "method == 'dla' and case == 'coupled'"),
    "dla is bounded on one that is not": changed("runs", "verdict", "bounded", "method == 'dla' and case == 'uneven_coupled'"),
    "one method is good on all": changed("runs", "verdict", "bounded", "method == 'ida:index1'"),
    "gni drifts where springs are linear": changed("runs", "size", 0.9, "method == 'gni' and case == 'uneven'"),
    "the verdict on gni is left open": changed("runs", "verdict", "undecided", "method == 'gni' and case == 'uneven'"),
    "rk4 is bounded somewhere": changed("runs", "verdict", "bounded", "method == 'rk4+proj' and case == 'even'"),
    "the pair of Newmark's methods is good": changed("runs", "verdict", "bounded", f"method == {PAIR!r} and case == 'uneven'"),
    "dla leaves energy": changed("runs", "lost", 0.5, "method == 'dla' and case == 'uneven'"),
    "dla has another order": changed("rates", "rate", -1e-3, "method == 'dla' and case == 'uneven' and h == 0.025"),
    "index 2 leaves the constraint": changed("levels", "Gv", 1e-3, "method == 'ida:index2' and tol == 1e-08"),
    "a sleigh goes on turning": changed("sleigh", "turning", 0.1, "method == 'dla'"),
    "dla is the cheapest": changed("cost", "evaluations", 1.0, "method == 'dla'"),
}


@pytest.mark.parametrize("tamper", TAMPERED.values(), ids=list(TAMPERED))
def test_a_tampered_number_refutes_the_story(numbers, tamper):
    with pytest.raises(ClaimRefuted):
        check(tamper(numbers))


def test_the_story_passes_on_numbers_of_which_it_is_true(numbers):
    found = check(numbers)
    assert found.rates.powers["dla"].power == pytest.approx(2)
    assert found.rates.half == pytest.approx(np.log(2) / 0.01)
    assert (found.levels.ratio, found.levels.grown) == (pytest.approx(3), pytest.approx(1 / (0.1 + 0.9 * 10 / 99)))
    assert (found.cost.best, found.cost.spark) == ("rk4+proj", pytest.approx(4))


def test_a_rate_is_that_of_the_energy_that_is_left(plain_functions, monkeypatch):
    """Of x and z alone, e^(-0.1 t) of it: without the driver's energy, and only as long as a part of it is left."""
    ivp = motions.ivp_of(TRANSMISSION, "even")
    assert motions.driven(ivp) == pytest.approx(1.0)
    assert motions.driven(motions.ivp_of(CONTACT, SHIFTED)) == pytest.approx(1.0)
    t = np.arange(0, 100, 0.5)
    monkeypatch.setattr(rates, "solved", lambda *_: type("Run", (), {"t": t}))
    monkeypatch.setattr(rates, "energy_error", lambda *_: np.exp(-0.1 * t) - 1 + 0.25 * np.sin(t))
    monkeypatch.setattr(rates, "integral_errors", lambda *_: {"driver": 0.25 * np.sin(t) + 1e-9})
    assert rates.rates("even", "dla")["rate"].to_numpy() == pytest.approx(-0.1, abs=1e-6)


def test_a_run_has_verdicts_and_its_largest_errors_so_far(plain_functions, monkeypatch):
    monkeypatch.setattr(motions, "T_END", 100.0)
    monkeypatch.setattr(motions, "H", 0.5)
    row, series = motions.long_run(CONTACT, "integrable", "rk4+proj")
    assert (row["class"], row["steps"], row["failure"]) == (INTEGRABLE, 200, "")
    assert series["size"].is_monotonic_increasing
    assert series["size"].iloc[-1] == pytest.approx(row["size"])
    refused, none = motions.long_run(CONTACT, SHIFTED, PAIR)
    assert (refused["verdict"], len(none)) == ("", 0)
    assert "constant M" in refused["failure"]


def test_a_cell_says_when_a_run_failed_and_then_has_no_number():
    assert (str(classes.cell("failed", 1e5)), str(classes.cell("", np.nan))) == ("failed<br><small></small>", "\N{EN DASH}")


def test_the_page_is_made_of_numbers_and_words(numbers, tmp_path, monkeypatch):
    rows = tables_of_page(nonholonomic, "nonholonomic", numbers, FIGURES, tmp_path, monkeypatch)
    assert rows == {"classes": len(MOTIONS) * len(METHODS), "rates": 80, "levels": 8, "sleigh": len(METHODS), "cost": len(METHODS)}
