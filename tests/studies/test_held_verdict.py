"""A drift of a method that claims the two-form is held against a run of ten times the length: none is false, and true ones stay."""

from collections import Counter
from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
import pytest
from planted import plant

import daebench
from daebench.diagnostics.drift import Drift
from daebench.diagnostics.energy_verdict import energy_verdict
from daebench.errors import RunFailed
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import methods_of
from daebench.runs.request import Request
from daebench.schemes.kernels.claims import Claims
from daebench.studies import held_verdict as study
from daebench.studies.ensemble.energies import ended_members, member_energies
from daebench.studies.grid.run_specification import ParameterRuns
from daebench.studies.grid.runs_together import parameter_row
from daebench.studies.held_verdict import SHORT, UNKNOWN, held_verdict

PENDULUM = initial_value_problem("planar_pendulum")
REQUEST = Request(value=0.1, t_end=1.0, every=2)
SHOWN = Drift("drifts", law="linear", exponent=1.0, exponent_low=0.9, exponent_high=1.1, change=3.0, change_bound=4.0)


@dataclass(frozen=True)
class Scripted(FixedStep):
    """A method that notes what it is asked, and gives nothing but the length of its run."""

    asked: list = field(default_factory=list, compare=False)
    symplectic: bool = True
    fails: bool = False

    @property
    def claims(self):
        return Claims(order=2, symmetric=True, symplectic=self.symplectic, keeps_g=True, keeps_Gv=True, system="constrained", source="")

    def solve(self, ivp, request):
        self.asked.append(request)
        if self.fails:
            raise RunFailed("it cannot go on.")
        return SimpleNamespace(steps=request.steps)


@pytest.fixture
def judged(monkeypatch):
    """Return the verdict where runs have these verdicts, one after another, and what longer runs were asked."""

    def judge(*verdicts, **method):
        given = iter(verdicts)
        monkeypatch.setattr(study, "energy_verdict", lambda ivp, run: next(given))
        scripted = Scripted("rattle", **method)
        return held_verdict(PENDULUM, scripted, REQUEST, SimpleNamespace(steps=10)), scripted.asked

    return judge


@pytest.mark.parametrize("verdict", ["kept", "bounded", "undetermined", "failed"])
def test_a_run_that_does_not_drift_costs_no_other(judged, verdict):
    told = Drift(verdict, reason="why")
    assert judged(told) == (told, [])


def test_a_drift_without_the_claim_costs_no_other(judged):
    assert judged(SHOWN, symplectic=False) == (SHOWN, [])


def test_a_drift_that_a_longer_run_confirms_stays(judged):
    told, (asked,) = judged(SHOWN, Drift("drifts", law="power"))
    assert told == SHOWN
    assert (asked.steps, asked.t_end, asked.every, asked.value) == (100, None, 2, 0.1)


LONGER = {
    "bounded": (Drift("bounded"), SHORT),
    "kept": (Drift("kept"), SHORT),
    "undetermined": (Drift("undetermined", reason="few"), f"{UNKNOWN}: few"),
    "failed": (Drift("failed", reason="it stopped"), f"{UNKNOWN}: it stopped"),
}


@pytest.mark.parametrize(("longer", "reason"), LONGER.values(), ids=LONGER)
def test_a_drift_that_no_longer_run_confirms_is_undetermined_and_has_no_law(judged, longer, reason):
    told, _ = judged(SHOWN, longer)
    assert (told.verdict, told.reason, told.law, told.words) == ("undetermined", reason, "", "")
    assert np.isnan([told.exponent, told.exponent_low, told.exponent_high]).all()
    assert (told.change, told.change_bound) == (3.0, 4.0)


def test_a_longer_run_that_cannot_be_made_confirms_nothing(judged):
    told, _ = judged(SHOWN, fails=True)
    assert (told.verdict, told.reason) == ("undetermined", f"{UNKNOWN}: it cannot go on.")


# ---- real runs -------------------------------------------------------------------------------------------------------------

CHAOTIC = {"rattle": (0.01, 5.0), "lobatto3": (0.04, 10.0), "rattle/suzuki4": (0.02, 5.0)}
"""Step sizes and ends of short runs of a chaotic double pendulum, by method."""


def many(name, h, t_end):
    return daebench.ensemble("double_pendulum", method=name, h=h, t_end=t_end, members=100, starts="energy", seed=5, points=400)


@pytest.mark.exhaustive
def test_of_three_hundred_short_chaotic_runs_of_symplectic_methods_none_drifts():
    before, after = Counter(), Counter()
    for name, (h, t_end) in CHAOTIC.items():
        runs = many(name, h, t_end)
        alone = np.array(member_energies(runs.run, ended_members(runs.run))["energy_verdict"])
        before += Counter(alone.tolist())
        after += Counter(runs.verdicts.tolist())
        i = next(iter(np.flatnonzero(alone == "drifts")), 0)
        (method,) = methods_of(runs.ivp, [name])
        request = Request(value=h, t_end=t_end, every=int(runs.run.index[1]))
        start = runs.run.members.member(int(i))
        assert held_verdict(start, method, request, method.solve(start, request)).verdict == runs.verdicts[i]
    assert before["drifts"] >= 5  # else this tests nothing
    assert after["drifts"] == 0
    assert after.total() == 300
    assert after["bounded"] == before["bounded"]


@pytest.mark.slow
@pytest.mark.sampled(left_out=("implicit_euler",))
@pytest.mark.parametrize("name", ["rk4", "implicit_euler"])
def test_true_drifts_of_other_methods_stay(name):
    runs = many(name, 0.02, 10.0)
    assert np.mean(runs.verdicts == "drifts") >= 0.95


@pytest.mark.slow
@pytest.mark.sampled(left_out=("midpoint",))
@pytest.mark.parametrize(
    ("name", "place", "h", "t_end"),
    [("midpoint", ("double_pendulum", "horizontal"), 0.02, 20.0), ("se", ("spherical_pendulum", "fig1.1"), 0.03, 100.0)],
    ids=["midpoint", "se"],
)
def test_true_drifts_of_reduced_formulations_stay(name, place, h, t_end):
    ivp = initial_value_problem(*place)
    (method,) = methods_of(ivp, [name])
    request = Request(value=h, t_end=t_end)
    assert held_verdict(ivp, method, request, method.solve(ivp, request)).verdict == "drifts"


@pytest.mark.exhaustive
def test_the_drift_of_an_iteration_that_is_ended_by_its_residual_stays(get_ivp, monkeypatch, tmp_path):
    """RATTLE claims the two-form, and loses it where Newton's iteration leaves a residual of 1e-6."""
    line = "x, size, scale, residual, pivot = update(x, data)"
    accepted = "return before, (OK, residual, pivot, tally(update, iteration))"
    stop = f"before = x\n        {line}\n        if residual <= 1e-6:\n            {accepted}"
    plant(monkeypatch, tmp_path, "schemes.kernels.newton", line, stop)
    ivp, request = get_ivp("spherical-fast"), Request(value=0.0028, t_end=20000, every=997, watch=("energy",))
    method = FixedStep("rattle")
    run = method.solve(ivp, request)
    assert energy_verdict(ivp, run).verdict == held_verdict(ivp, method, request, run).verdict == "drifts"


@pytest.mark.parametrize("scheme", ["rattle", "rk4"])
def test_runs_in_a_parameter_are_held_as_runs_by_themselves(scheme, monkeypatch):
    """All verdicts are made drifts; those of the method that claims the two-form are then not confirmed."""
    seen = []

    def verdicts(t, errors, **about):
        seen.append(len(t))
        return np.full(len(errors), "drifts" if len(seen) == 1 else "bounded", dtype="U12")

    monkeypatch.setattr("daebench.studies.ensemble.energies.energy_verdicts", verdicts)
    monkeypatch.setattr("daebench.studies.ensemble.energies.may_be_a_part", lambda states, sizes: np.zeros(len(sizes), dtype=bool))
    about = {"problem": "planar_pendulum", "case": "rotating", "method": scheme, "value": 0.05, "t_end": 2.0, "metrics": ("energy",)}
    some = ParameterRuns(**about, varied="gravity", values=(1.0, 2.0))
    row = parameter_row(some, lambda run: pytest.fail("a run by itself"))
    assert row["energy_verdict"] == ["undetermined" if scheme == "rattle" else "drifts"] * 2
    assert seen == ([41, 401] if scheme == "rattle" else [41])
