"""What became of a run, in one word."""

import math

import numpy as np
import pandas as pd
import pytest

from daebench.diagnostics.manifold import residual_scales
from daebench.methods.fixed_step.reasons import REASONS
from daebench.studies.grid.measure import row_of
from daebench.studies.grid.outcomes import ENERGY, OUTCOMES, TOLD, outcomes_of, varied_runs
from daebench.studies.grid.run_specification import GridRun

pytestmark = pytest.mark.usefixtures("uncompiled_schemes")

FAST = {"problem": "spherical_pendulum", "case": "fig1.2", "t_end": 20.0}
RUNS = {
    "fine": {**FAST, "method": "rattle", "value": 0.01},
    "coarse": {**FAST, "method": "symplectic_euler", "value": 0.05, "t_end": 10.0, "parameters": (("gravity", 100.0),)},
    "wrong branch": {**FAST, "method": "rattle", "value": 10 / 128, "t_end": 10.0, "parameters": (("gravity", 10**1.75),)},
    "off the manifold": {**FAST, "method": "se", "value": 0.003, "t_end": 3.0},
    "no solution": {**FAST, "method": "rattle", "value": 2.0},
    "rank lost": {"problem": "slider_crank", "case": "lock_up", "t_end": 2.0, "method": "rattle", "value": 0.01},
    "blown up": {**FAST, "method": "midpoint", "value": 1e200, "t_end": 1e202},
}


def outcome_of(specification, row):
    rows = {name: [row.get(name, math.nan)] for name in (*row, *ENERGY)}
    scale, _ = residual_scales(specification.ivp, *specification.ivp.start)
    return outcomes_of(rows, np.array([scale]))[0]


@pytest.mark.parametrize("word", RUNS)
def test_a_run_is_called_what_it_is(word):
    specification = GridRun(metrics=("energy", "manifold", "jump"), outputs=10_000, **RUNS[word])
    row = row_of(specification)
    assert outcome_of(specification, row) == word, row
    assert word in OUTCOMES


SIZES = {1e-12: "fine", 0.09: "fine", 0.11: "coarse", 0.99: "coarse", 1.01: "lost", 1e6: "lost", math.inf: "lost"}


@pytest.mark.parametrize("verdict", ["kept", "bounded", "undetermined", "drifts"])
@pytest.mark.parametrize("size", SIZES)
def test_a_run_is_called_by_the_size_of_its_error_whatever_its_trend(size, verdict):
    row = {"failure": "", "g": 0.0, "energy_size": size, "energy_scale": 10.0, "energy_error": 10 * size, "energy_verdict": verdict}
    specification = GridRun(metrics=("energy", "manifold"), **RUNS["fine"])
    assert outcome_of(specification, row) == SIZES[size]


def test_an_accurate_run_that_drifts_is_fine_and_its_trend_is_told_apart():
    """RK4 with projection: it drifts at every step size, by less than the oscillation of RATTLE."""
    given = {**FAST, "value": 0.005, "parameters": (("gravity", 1.0),), "metrics": ("energy", "manifold", "jump"), "outputs": 2000}
    some = [GridRun(**given, method=name) for name in ("rattle", "rk4+proj")]
    table = varied_runs(some, "gravity", lambda each: pd.DataFrame(map(row_of, each)))
    assert table["outcome"].tolist() == ["fine", "fine"]
    assert table["trend"].tolist() == ["bounded", "drifts"]
    assert table["size"][1] < table["size"][0] / 10


@pytest.mark.parametrize("word", sorted(set(OUTCOMES) - {"fine", "coarse", "lost"}))
def test_a_run_that_came_to_no_end_on_the_manifold_has_no_trend(word, monkeypatch):
    monkeypatch.setattr("daebench.studies.grid.outcomes.outcomes_of", lambda rows, scales: np.array([word], dtype=object))
    specification = GridRun(metrics=("energy", "manifold"), parameters=(("gravity", 1.0),), **RUNS["fine"])
    row = {"energy_size": 1.0, "energy_scale": 1.0, "energy_error": 1.0, "energy_verdict": "drifts"}
    assert varied_runs([specification], "gravity", lambda specifications: pd.DataFrame([row]))["trend"].tolist() == [""]


def test_a_slope_over_two_oscillations_is_no_drift():
    given = {"problem": "planar_pendulum", "case": "rotating", "method": "rattle", "value": 0.01, "t_end": 4.0}
    specification = GridRun(**given, metrics=("energy", "manifold"), parameters=(("gravity", 0.01),))
    row = row_of(specification)
    assert (row["energy_verdict"], outcome_of(specification, row)) == ("undetermined", "fine")


def test_every_reason_of_a_scheme_has_a_word():
    for status, (reason, _) in REASONS.items():
        sentence = f"rattle stopped at t = 1: {reason.format(sweeps=100, relaxations=1000, residual=1.0)}; do something."
        assert [word for text, word in TOLD.items() if text in sentence], status
