"""Three ways to hold the rod: the runs are as the picture tells, a run that is not is refused, and the index begins with what moves."""

from dataclasses import replace

import numpy as np
import pytest

from daebench.errors import DaebenchError
from daebench.pages.report.index import MOVING, moving
from daebench.reports.index_reduction.rods import T_END, H, Held, check_rods, envelope, measure_rods
from daebench.reports.index_reduction.rods_moving import LENGTH, SCALE, data


def made_up(t_end, slope, level, rod, failure=None):
    """Return a run whose energy error is level + slope t, and whose rod has these lengths at its start and its end."""
    t = H * np.arange(round(t_end / H) + 1)
    q = np.zeros((len(t), 3))
    q[:, 2] = -np.linspace(*rod, len(t))
    return Held(t, q, level * np.sin(t) + slope * t, failure)


@pytest.fixture
def story():
    rk4 = made_up(2500.0, 3e-7, 1e-9, (1.0, 0.1), "not finite")
    rk4.energy_error[-1] = np.inf
    return {
        "rattle": made_up(T_END, 0.0, 1e-4, (1.0, 1.0)),
        "se": made_up(25.0, 1e-2, 0.0, (1.0, 0.3), "no solution"),
        "rk4": rk4,
    }


def test_numbers_of_the_picture_are_those_of_the_runs(story):
    facts = check_rods(story)
    assert facts.flat == pytest.approx(1e-4, rel=1e-3)
    assert facts.crossing == pytest.approx(1000 / 3, abs=2 * H)
    assert (facts.gone, facts.se_stops) == (2500.0, 25.0)
    assert story["se"].rod[facts.short] < 0.81 <= story["se"].rod[facts.short - 1]


@pytest.mark.parametrize(
    ("name", "planted", "words"),
    [
        ("rattle", made_up(T_END, 1e-5, 1e-4, (1.0, 1.0)), "RATTLE is bounded"),
        ("rattle", made_up(T_END, 0.0, 1e-4, (1.0, 1.0 - 1e-9)), "rod's length"),
        ("rattle", made_up(4000.0, 0.0, 1e-4, (1.0, 1.0), "no"), "reaches the end"),
        ("rk4", made_up(T_END, 3e-7, 1e-9, (1.0, 0.9)), "RK4 does not reach the end"),
        ("rk4", made_up(2500.0, 1e-5, 0.0, (1.0, 0.9), "not finite"), "RK4 starts"),
        ("se", made_up(25.0, 1e-2, 0.0, (1.0, 0.9), "no solution"), "shorter"),
    ],
    ids=["drift", "rod", "stops", "never gone", "no better", "long rod"],
)
def test_story_that_does_not_hold_is_refused(story, name, planted, words):
    with pytest.raises(DaebenchError, match=words):
        check_rods(story | {name: planted})


def test_envelope_has_the_largest_error_of_every_window(story):
    run = story["rk4"]
    t, error = envelope(replace(run, energy_error=np.where(np.isclose(run.t, 123.45), 7.0, run.energy_error)))
    assert np.sum(error[:-1] == 7.0) == 1
    assert np.isinf(error[-1])
    assert t[np.argmax(error == 7.0)] >= 123.449 > t[np.argmax(error == 7.0) - 1]


def test_index_begins_with_what_moves(tmp_path):
    assert moving(tmp_path, ["one", "other"]) == ""
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / MOVING).write_text("<figure>moves</figure>", encoding="utf-8")
    assert moving(tmp_path, ["one", "other"]) == "<figure>moves</figure>"


@pytest.mark.slow
def test_runs_are_as_the_picture_tells():
    runs = measure_rods()
    facts = check_rods(runs)
    assert 50 < facts.crossing < 90
    assert 2000 < facts.gone < 3000
    assert 10 < facts.se_stops < 40
    shown = data(runs, facts)
    start = shown["pieces"][0]["runs"]
    assert [len(piece[0]) for piece in start] == 3 * [round(LENGTH / H) + 1]
    assert [piece[2][0] for piece in start] == 3 * [SCALE]
    assert [len(piece[0]) for piece in shown["pieces"][-1]["runs"]] == [round(LENGTH / H) + 1, 0, 0]
