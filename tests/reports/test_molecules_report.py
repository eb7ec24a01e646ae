"""The report on molecules: potentials, laws, conclusions from numbers that are known, claims that faults refute, and the page."""

from dataclasses import replace
from functools import cache, partial

import numpy as np
import pandas as pd
import pytest
from reported import tables_of_page
from tampered import changed

from daebench.draw.figures import drawing
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.pages.report.claims import ClaimRefuted
from daebench.problems import butane
from daebench.reports import molecules
from daebench.reports.molecules import Numbers, check, energy_change, motions
from daebench.reports.molecules.energy_change import UNJUDGED, final, row, windows
from daebench.reports.molecules.laws import fit
from daebench.reports.molecules.motions import (
    BUTANE,
    COMPENSATED,
    DIFFERENCES,
    DOUBLE,
    GAUSS_SEIDEL,
    ILVES,
    KERNELS,
    LINCS,
    MIDDLE,
    MIXED,
    MULTIPLIERS,
    RING,
    SETTLE,
    STEPS,
    TITLES,
    WATER,
    Setting,
    in_a_well,
    settings,
)
from daebench.reports.molecules.tolerance import draw_answer
from daebench.runs.request import Request

NORMAL = np.array([-1.6, -1.0, -0.6, -0.2, 0.2, 0.6, 1.0, 1.6])
LOSSES = {WATER: 40.0, BUTANE: 400.0, RING: 100.0}
"""Of the iteration of Gauss and Seidel: the change over the tolerance."""


def outcome(setting):
    """Return mean, spread and rounds that are known, by the laws that the page tells of."""
    exact = setting.scheme in (SETTLE, "rattle")
    lost = -LOSSES[setting.molecule] * setting.tolerance if setting.scheme == GAUSS_SEIDEL else 0.0
    if setting.precision != DOUBLE:
        rounding = -2e-5 / setting.h if setting.velocities == DIFFERENCES else 0.0
        return rounding + lost, {COMPENSATED: 1e-6, MIXED: 1e-7}.get(setting.precision, 1e-5), 0.0 if exact else 9.0
    if setting.scheme == GAUSS_SEIDEL:
        return lost, -0.1 * lost, -10 * np.log10(setting.tolerance)
    if setting.scheme == ILVES:
        two = setting.tolerance >= 1e-6
        return (-1e3 * setting.h**5 if two else -1e-12), 1e-14, 2.0 if two else 3.0
    return (0.0, 1e-14, 4.0) if exact else (-1e-2 * setting.h**3 / setting.iterations, 1e-9, 9.0)


@cache
def made():
    """Return numbers with known answers: changes of the Gauss-Seidel iteration are 40, 400 and 100 times the tolerance."""
    rows, starts, growth = [], [], []
    for kernel in KERNELS:
        for setting in settings(*kernel):
            mean, spread, rounds = outcome(setting)
            ends = mean + spread * NORMAL
            low, median, high = np.quantile(np.abs(ends), (0.0, 0.5, 1.0))
            numbers = {"rounds": rounds, "nanoseconds": 100 + 10 * rounds, "mean": mean, "error": spread / 3, "spread": spread}
            numbers |= {
                "low": low,
                "median": median,
                "high": high,
                "slope": 0.0 if setting.molecule == WATER else mean,
                "slope_error": spread / 3,
            }
            judged = UNJUDGED if setting.h != MIDDLE else UNJUDGED | {"verdict": "bounded", "alpha": 0.5, "alpha_error": 0.02}
            rows.append(vars(setting) | numbers | judged)
            starts.append(pd.DataFrame(vars(setting) | {"start": range(len(ends)), "change": ends}))
            if setting.h == MIDDLE:
                t = np.array([1.0, 10.0, 100.0])
                growth.append(pd.DataFrame(vars(setting) | {"t": t, "mean": mean * t / 100, "spread": spread * np.sqrt(t / 100)}))
    about = [(WATER, 9, 3, 6, 0.8, "", 1.1), (BUTANE, 12, 5, 7, 0.88, "", 1.6), (RING, 18, 12, 6, 1.0, "has no sum.", 1.7)]
    names = ["molecule", "positions", "constraints", "degrees", "radius", "refused", "loose"]
    converged = [{"molecule": molecule, "h": h, "fluctuation": 2.0, "kinetic": 5.0} for molecule, steps in STEPS.items() for h in steps]
    frame = pd.DataFrame(converged).assign(oscillation=1e-3, rounds=3.0, verdict="bounded", reason="", bound=1e-4)
    frames = pd.DataFrame(rows), pd.concat(starts, ignore_index=True), pd.concat(growth, ignore_index=True)
    return Numbers(pd.DataFrame(about, columns=names), frame, *frames)


def test_a_well_adds_its_energy_to_that_of_the_molecule():
    free = butane.problem()
    held = in_a_well(free, 7.0)
    place = {x: 0.1 * k - 0.3 for k, x in enumerate(held.q)}
    expected = free.U.subs(free.parameters).subs(place).evalf()
    energy = held.U.subs(held.parameters).subs(place).evalf()
    assert float(energy - expected) == pytest.approx(7.0 / 2 * (0.3**2 + 0.2**2 + 0.1**2), rel=1e-9)
    assert set(held.integrals) == {"L1", "L2", "L3"}
    assert held.cases.keys() == free.cases.keys()


@pytest.mark.parametrize(("a", "b"), [(1.3, -0.5), (0.7, 2.0)])
def test_a_law_that_is_there_is_found_and_what_is_not_clear_is_left_out(a, b):
    rows = pd.DataFrame([(tol, h) for tol in (1e-3, 1e-4, 1e-5, 1e-6) for h in (0.01, 0.02, 0.04)], columns=["tolerance", "h"])
    rows = rows.assign(mean=-3.0 * rows["tolerance"] ** a * rows["h"] ** b, error=1e-12)
    noise = rows.assign(tolerance=1e-9, mean=1e-5, error=1e-4)
    lost = rows.assign(mean=-2.0)
    law = fit(pd.concat([rows, noise, lost]))
    assert (law.a, law.b, law.points, law.tightest) == (pytest.approx(a), pytest.approx(b), 12, 1e-6)
    assert max(law.a_error, law.b_error) < 1e-12
    assert np.isnan(fit(noise).a)
    assert np.isnan(fit(rows.assign(tolerance=np.nan)).a)


def test_changes_are_means_of_the_last_eighth_and_windows_have_means_and_spreads():
    t = np.arange(257.0)
    off = np.stack([t, 3 * t])
    assert final(off) == pytest.approx([240.5, 721.5])
    middles, mean, spread = windows(t, off)
    assert mean == pytest.approx(2 * middles)
    assert spread == pytest.approx(np.sqrt(2) * middles)


@pytest.fixture
def forgotten():
    """Have what is kept of motions be forgotten before a test, and after it."""
    for ends in (False, True):
        for function in (motions.ivp_of, motions.starts, motions.converged):
            function.cache_clear()
        if not ends:
            yield


@pytest.mark.usefixtures("forgotten")
def test_changes_are_those_of_runs_by_themselves(monkeypatch):
    monkeypatch.setattr(motions, "FixedStep", partial(FixedStep, compiled=False))
    monkeypatch.setattr(motions, "STARTS", {WATER: 2})
    monkeypatch.setattr(motions, "APART", 0.02)
    monkeypatch.setattr(motions, "T_END", 0.64)
    setting = Setting(WATER, GAUSS_SEIDEL, DOUBLE, 0.04, tolerance=1e-3)
    found = motions.change(setting, motions.energies(setting))
    start = motions.starts(WATER)[1]
    both = [method.solve(start, Request(value=0.04, steps=16)) for method in (setting.method, motions.FixedStep("rattle"))]
    H = [start.along("H", run.p, run.q) for run in both]
    assert found[1] * motions.fluctuation(WATER, 0.04) == pytest.approx(H[0] - H[1], abs=1e-12)
    assert np.max(np.abs(found)) > 1e-6
    assert row(replace(setting, h=0.03), motions.Energies(np.arange(17.0), found, found, 1.0, 1.0), found)["rounds"] == 1.0


def test_conclusions_are_those_that_the_numbers_were_made_for():
    found = check(made())
    assert found.answer.by_molecule.to_dict() == {WATER: 1e-5, BUTANE: 1e-6, RING: 1e-6}
    assert found.answer.steps == {1e-6: [0.01, 0.02, 0.04]}
    assert found.answer.not_run == {RING: [0.01]}
    assert found.missed.empty
    laws = found.laws.set_index(["molecule", "scheme", "what"])
    assert laws.loc[(BUTANE, GAUSS_SEIDEL, "all tolerances"), "a"] == pytest.approx(1)
    assert laws.loc[(WATER, ILVES, "two rounds"), "b"] == pytest.approx(5)
    assert laws.loc[(WATER, LINCS, "(8, 4)"), "b"] == pytest.approx(3, abs=0.1)
    assert found.hess.smaller.settle["b"] == pytest.approx(-1)
    assert found.hess.always.down == found.hess.always.n
    assert found.hess.smaller.compensated == pytest.approx(10)
    assert found.luck.some == 0
    assert found.cost.decade == pytest.approx(10)
    assert found.tenfold.least == pytest.approx(10)


def test_the_picture_of_the_answer_shows_the_numbers(tmp_path):
    found = check(made())
    with drawing():
        path = draw_answer(found.runs, found.answer.usual, tmp_path)
    shown = pd.read_csv(path.with_suffix(".csv")).set_index(["molecule", "tolerance"])["limit"]
    assert shown[BUTANE, 1e-6] == pytest.approx(4e-4 * (1 + 0.2 / 3))


def test_the_page_is_made_of_its_numbers(tmp_path, monkeypatch):
    stems = ("answer", "tolerances", "growth", "steps")
    rows = tables_of_page(molecules, "molecules", made(), stems, tmp_path, monkeypatch)
    expected = {"runs": len(made().runs), "radii": len(TITLES), "asked": 2 * len(TITLES), "starts": len(made().starts)}
    assert rows | expected == rows


FAULTS = {
    "some tolerance keeps the change below": changed("runs", "mean", -0.5, f"molecule == {RING!r} and scheme == {ILVES!r}"),
    "falls with a power of the tolerance": changed(
        "runs", "mean", -0.01, f"molecule == {BUTANE!r} and scheme == {GAUSS_SEIDEL!r} and precision == {DOUBLE!r}"
    ),
    "SETTLE and RATTLE change the energy of water by less": changed(
        "runs", "high", 1e-6, f"scheme == {SETTLE!r} and precision == {DOUBLE!r}"
    ),
    "a random walk without a bias": changed(
        "runs", "alpha", 1.0, f"scheme == {SETTLE!r} and velocities == {MULTIPLIERS!r} and precision == 'single'"
    ),
    "loses some energy at once": changed("runs", "slope", -1.0, f"molecule == {WATER!r} and scheme == {GAUSS_SEIDEL!r}"),
    "make the same run": lambda n: replace(n, runs=n.runs.assign(mean=n.runs["mean"] + 1e-13 * np.arange(len(n.runs)))),
    "LINCS is refused on the ring alone": changed("molecules", "refused", ""),
    "decreases the energy|at once": lambda n: replace(
        n, runs=n.runs.assign(mean=n.runs["mean"].where(n.runs["h"] < MIDDLE, n.runs["mean"].abs()))
    ),
    "each decade of the tolerance takes more rounds": changed(
        "runs", "rounds", 3.0, f"scheme == {GAUSS_SEIDEL!r} and molecule == {WATER!r}"
    ),
}
"""Words of claims, and faults that refute them."""


@pytest.mark.parametrize(("claim", "fault"), FAULTS.items())
def test_a_number_that_refutes_a_claim_stops_the_page(claim, fault):
    with pytest.raises(ClaimRefuted, match=claim):
        check(fault(made()))


@pytest.mark.slow
@pytest.mark.usefixtures("forgotten")
def test_a_kernel_is_measured_with_its_verdicts(monkeypatch):
    monkeypatch.setattr(motions, "STARTS", {WATER: 16})
    monkeypatch.setattr(motions, "T_END", 8.0)
    runs, starts, growth = energy_change.measured(WATER, GAUSS_SEIDEL, DOUBLE)
    assert len(runs) == len(list(settings(WATER, GAUSS_SEIDEL, DOUBLE)))
    assert len(starts) == 16 * len(runs)
    assert set(growth["h"]) == {MIDDLE}
    assert (runs.loc[runs["h"] == MIDDLE, "verdict"] != "").all()
    by_tolerance = runs[runs["h"] == MIDDLE].set_index("tolerance")
    assert by_tolerance.loc[1e-8, "high"] < 1e-2 * by_tolerance.loc[1e-4, "low"]


def unlucky():
    """Return numbers with a loose tolerance that does well by chance, a start in the wrong order, and too much rounding."""
    numbers = made()
    runs, starts = numbers.runs, numbers.starts
    iteration = (runs["scheme"] == GAUSS_SEIDEL) & (runs["molecule"] == BUTANE)
    chance = iteration & (runs["precision"] == DOUBLE) & (runs["tolerance"] == 1e-4) & (runs["h"] == MIDDLE)
    runs = runs.assign(**runs[["mean", "error"]].where(~chance, 1e-5))
    rounded = iteration & (runs["precision"] == "single")
    runs = runs.assign(**runs[["mean", "slope"]].where(~rounded, runs[["mean", "slope"]] - 0.01))
    wrong = (starts["scheme"] == GAUSS_SEIDEL) & (starts["precision"] == DOUBLE) & (starts["molecule"] == RING)
    wrong &= (starts["tolerance"] == 1e-4) & (starts["h"] == MIDDLE) & (starts["start"] == 0)
    return replace(numbers, runs=runs, starts=starts.assign(change=starts["change"].where(~wrong, 0.0)))


def test_a_looser_tolerance_that_does_as_well_by_chance_is_told_of_and_not_taken():
    found = check(unlucky())
    assert found.answer.by_molecule[BUTANE] == 1e-6
    (told,) = found.answer.fortuitous.to_dict("records")
    assert (told["molecule"], told["h"], told["fortuitous"]) == (BUTANE, MIDDLE, [1e-4])
