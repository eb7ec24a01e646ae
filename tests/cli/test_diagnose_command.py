"""The command ``daebench diagnose``: what it prints, how it exits and what it refuses."""

import itertools
import json
from pathlib import Path

import pytest

from daebench.studies.diagnose import diagnosis
from daebench.studies.diagnose.dictionary import FAULTS

CODES = Path(__file__).parents[1] / "studies" / "planted" / "double_pendulum_codes.py"
ON = ("--problem", "double_pendulum", "--param", "mass2=3")

pytestmark = pytest.mark.usefixtures("plain_functions")


def test_a_fault_is_named_with_what_to_change_and_exits_1(daebench):
    status, out, err = daebench("diagnose", f"{CODES}:multiplier_half_1", *ON)
    assert (status, err) == (1, "")
    assert "fault: multiplier_half" in out
    assert FAULTS["multiplier_half"].remedy in out
    assert "measured: order " in out


def test_the_faults_are_listed(daebench):
    status, out, _ = daebench("list", "faults", "--json")
    assert (status, [row["name"] for row in json.loads(out)["faults"]]) == (0, list(FAULTS))


@pytest.mark.slow
@pytest.mark.parametrize("among", [3, pytest.param(None, marks=pytest.mark.exhaustive)], ids=["some", "all"])
def test_the_problem_is_sought_where_none_is_given(daebench, monkeypatch, among):
    names = ["planar_pendulum", "double_pendulum", "spherical_pendulum", *diagnosis.problems("constrained")]
    monkeypatch.setattr(diagnosis, "problems", lambda kind: dict.fromkeys(itertools.islice(names, among)))
    status, out, _ = daebench("diagnose", f"{CODES}:multiplier_sign_1", "--json")
    shown = json.loads(out)
    assert (status, shown["problem"], shown["faults"]) == (1, "double_pendulum", ["multiplier_sign"])
