"""Commands of studies: exit status, JSON and files are those of the verdict and the numbers, which tests of studies hold to be right."""

import itertools
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from checks import EXACT, Study

from daebench.methods.fixed_step.constrained import FixedStep
from daebench.studies.diagnose import diagnosis
from daebench.studies.diagnose.dictionary import FAULTS

CODES = Path(__file__).parents[1] / "studies" / "planted" / "double_pendulum_codes.py"
STEPS = "step-for double_pendulum --case horizontal --method rattle --h 0.02 --t-end 2 --statistic energy"
CHAOS = "chaos double_pendulum --case horizontal --method rattle --h 0.01 --t-end 5"
CHECK = "check spherical_pendulum --case fig1.1 --h 0.03 --steps 20 --method"

ENDS = {
    "order spherical_pendulum --case fig1.2b --methods rattle --t-end 32 --h 4 --halvings 2": 1,
    "ensemble planar_pendulum --case horizontal --method rattle --h 4 --steps 5 --members 6": 1,
    f"{STEPS} --members 64 --margin 1": 0,
    f"{STEPS} --members 64 --margin 1e-9 --halvings 2": 1,
    f"{STEPS} --members 40 --margin 100 --halvings 2": 1,
    f"{CHAOS} --plane q2,q4 --cells 3": 0,
    f"diagnose {CODES}:multiplier_half_1 --problem double_pendulum --param mass2=3": 1,
}
"""Commands, and their exit status: 1 where runs or members stop, no step passes or is decided on, or there is a fault."""


@pytest.mark.usefixtures("plain_functions")
@pytest.mark.parametrize(("words", "status"), ENDS.items(), ids=[words.replace(str(CODES), "CODES") for words in ENDS])
def test_a_study_ends_with_its_verdict(daebench, words, status):
    ended, out, err = daebench(*words.split())
    assert (ended, out != "", err) == (status, True, "")


@pytest.fixture
def shown(daebench, tmp_path):
    """Return what gives the exit status of a command and its JSON, with its files in a folder."""

    def call(words, *, files=False):
        status, out, _ = daebench(*words.split(), *(("--out", tmp_path) if files else ()), "--json")
        return status, json.loads(out)

    return call


@pytest.mark.usefixtures("plain_functions", "uncompiled_schemes")
def test_an_order_has_its_points_and_why_some_are_not_used(shown):
    status, found = shown("order planar_pendulum --case rotating --methods rattle --t-end 4 --h 0.5 --halvings 6 --param gravity=3")
    series = found["series"][0]
    assert (status, found["parameters"]["gravity"], found["times"]) == (0, 3, [0.5 * k for k in range(1, 9)])
    assert (series["component"], series["claimed"], len(series["points"])) == ("q", 2, 7)
    for point in series["points"]:
        assert point["steps"] * point["h"] == 4
        assert point["used"] == (point["reason"] == "")
        assert (point["error"] is None) == (point["reason"] == "failed") == bool(point["failure"])
    assert abs(series["order"] - 2) < 0.1


def test_an_ensemble_has_quantiles_and_a_row_a_member(shown, tmp_path):
    words = "ensemble planar_pendulum --case horizontal --method rattle --h 0.1 --t-end 5 --members 12 --points 6"
    status, printed = shown(words, files=True)
    assert (status, printed["members"], printed["steps"], printed["failed"]) == (0, 12, 50, 0)
    energy = list(printed["quantiles"]["energy"].values())
    assert energy == sorted(energy)
    rows = pd.concat([pd.read_csv(tmp_path / f"{name}.csv") for name in ("starts", "ends")])
    assert len(rows) == 24
    assert np.hypot(rows["q1"], rows["q2"]).to_numpy() == pytest.approx(1, abs=1e-14)


def test_a_map_of_chaos_counts_its_cells(shown, tmp_path):
    status, printed = shown(f"{CHAOS} --plane q1=-1.5:1.5,p1=-1:1 --energy case --cells 6", files=True)
    rows = pd.read_csv(tmp_path / "chaos.csv")
    assert (status, printed["cells"], printed["empty"], len(rows)) == (0, 36, 12, 36)
    assert rows["verdict"].value_counts().to_dict().items() <= printed.items()
    assert printed["exponent"]["low"] <= printed["exponent"]["value"] <= printed["exponent"]["high"]


def test_members_without_an_interval_are_undecided_with_the_number_that_it_takes(shown):
    row = shown(f"{STEPS} --members 40 --margin 100 --halvings 2")[1]["tried"][0]
    assert (row["verdict"], row["needed"], row["differences"]["10 %"][1:]) == ("undecided", 42, [None, None])


@pytest.fixture
def made_up_orders(monkeypatch, uncompiled_schemes):
    monkeypatch.setattr("daebench.studies.claims.check.study", lambda *_, **__: Study(q=lambda h: h**2, p=lambda h: h**2))


@pytest.mark.usefixtures("made_up_orders")
def test_a_check_has_a_row_a_claim(shown):
    status, found = shown(f"{CHECK} rattle")
    rows = {row["property"]: row for row in found["claims"]}
    assert (status, found["falls_short"], found["h"], found["steps"]) == (0, [], 0.03, 20)
    assert rows.keys() >= {"order", *EXACT, "Poisson in the chart", "keeps L3", "symplectic on two_bodies_on_sphere"}
    assert rows["symplectic"]["measured"] <= rows["symplectic"]["bound"]
    assert (rows["keeps L3"]["claimed"], rows["keeps L3"]["bound"]) == (None, None)
    assert len(found["unseen"]) > 0


@pytest.mark.usefixtures("made_up_orders")
def test_a_false_claim_exits_1_naming_the_property(shown, monkeypatch):
    claims = replace(FixedStep("se").claims, symplectic=True, order=3)
    monkeypatch.setattr(FixedStep, "claims", property(lambda _: claims))
    status, found = shown(f"{CHECK} se")
    short = ["order", "symplectic"]
    assert (status, found["falls_short"]) == (1, [*short, *(f"{name} on two_bodies_on_sphere" for name in short)])


def test_the_faults_are_listed(shown):
    assert [row["name"] for row in shown("list faults")[1]["faults"]] == list(FAULTS)


@pytest.mark.slow
@pytest.mark.usefixtures("plain_functions")
@pytest.mark.parametrize("among", [3, pytest.param(None, marks=pytest.mark.exhaustive)], ids=["some", "all"])
def test_the_problem_of_a_code_is_sought_where_none_is_given(shown, monkeypatch, among):
    names = ["planar_pendulum", "double_pendulum", "spherical_pendulum", *diagnosis.problems("constrained")]
    monkeypatch.setattr(diagnosis, "problems", lambda kind: dict.fromkeys(itertools.islice(names, among)))
    status, found = shown(f"diagnose {CODES}:multiplier_sign_1")
    assert (status, found["problem"], found["faults"]) == (1, "double_pendulum", ["multiplier_sign"])
