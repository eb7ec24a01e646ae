"""What became of a run, in one word."""

from dataclasses import replace

import pytest

from daebench.stepping import REASONS
from daebench.studies.cell import Cell
from daebench.studies.measure import row_of
from daebench.studies.outcomes import OUTCOMES, TOLD, outcome_of

pytestmark = pytest.mark.usefixtures("uncompiled_schemes")

FAST = {"problem": "spherical_pendulum", "case": "fig1.2", "t_end": 20.0}
RUNS = {
    "fine": {**FAST, "method": "rattle", "value": 0.01},
    "drifting": {**FAST, "method": "rk4+proj", "value": 0.05},
    "coarse": {**FAST, "method": "symplectic_euler", "value": 0.05, "t_end": 10.0, "parameters": (("gravity", 100.0),)},
    "wrong branch": {**FAST, "method": "rattle", "value": 10 / 128, "t_end": 10.0, "parameters": (("gravity", 10**1.75),)},
    "off the manifold": {**FAST, "method": "se", "value": 0.003, "t_end": 3.0},
    "no solution": {**FAST, "method": "rattle", "value": 2.0},
    "rank lost": {"problem": "slider_crank", "case": "lock_up", "t_end": 2.0, "method": "rattle", "value": 0.01},
    "blown up": {**FAST, "method": "midpoint", "value": 1e200, "t_end": 1e202},
}


@pytest.mark.parametrize("word", RUNS)
def test_a_run_is_called_what_it_is(word):
    cell = Cell(metrics=("energy", "manifold", "jump"), outputs=10_000, **RUNS[word])
    row = row_of(cell)
    assert outcome_of(cell, row) == word, row
    assert word in OUTCOMES


@pytest.mark.parametrize("verdict", ["kept", "bounded", "undetermined", "drifts"])
def test_a_drift_is_what_the_verdict_says(verdict):
    row = {"failure": "", "g": 0.0, "energy_scale": 10.0, "energy_error": 3e-12, "energy_verdict": verdict}
    cell = Cell(metrics=("energy", "manifold"), **RUNS["fine"])
    assert outcome_of(cell, row) == ("drifting" if verdict == "drifts" else "fine")


def test_a_slope_over_two_oscillations_is_no_drift():
    cell = Cell(problem="planar_pendulum", case="rotating", method="rattle", value=0.01, t_end=4.0, metrics=("energy", "manifold"))
    row = row_of(replace(cell, parameters=(("gravity", 0.01),)))
    assert row["energy_verdict"] == "undetermined"
    assert outcome_of(cell, row) == "fine"


def test_every_reason_of_a_scheme_has_a_word():
    for status, (reason, _) in REASONS.items():
        sentence = f"rattle stopped at t = 1: {reason.format(sweeps=100, relaxations=1000, residual=1.0)}; do something."
        assert [word for text, word in TOLD.items() if text in sentence], status
