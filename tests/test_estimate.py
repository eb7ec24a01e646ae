"""About how long: kept runs are a measure for those like them, and compilation is not taken for work."""

from dataclasses import replace

import pytest

from daebench.studies.cell import Cell
from daebench.studies.estimate import LEAST_SECONDS, STEP_SECONDS, TOLERANCE_SECONDS, estimate
from daebench.studies.store import Kept, opened

FIXED = Cell(problem="planar_pendulum", case="rotating", method="rattle", value=0.01, t_end=100.0, metrics=("energy",))
CHOSEN = replace(FIXED, method="scipy:DOP853", value=1e-6)


@pytest.fixture
def store(tmp_path):
    with opened(tmp_path / "rows.db") as found:
        yield found


def keep(store, cell, took, failure=""):
    store.put([Kept(f"{cell}", cell.plain(), {"failure": failure}, "", took)])


def test_without_kept_runs_it_is_what_is_usual(store):
    found = estimate([FIXED, replace(FIXED, t_end=0.1), CHOSEN], store)
    assert found.seconds == pytest.approx(1e4 * STEP_SECONDS + LEAST_SECONDS + 100 * TOLERANCE_SECONDS)
    assert "none of these methods was run" in found.sentence(1, "in one process")


def test_time_is_in_proportion_to_steps_and_repetitions_and_not_to_what_the_first_run_compiled(store):
    keep(store, replace(FIXED, value=0.1), 5.0)
    keep(store, FIXED, 0.5)
    keep(store, replace(FIXED, value=0.02), 0.0, failure="stopped at once")
    found = estimate([replace(FIXED, value=0.001, repeat=3)], store)
    assert found.seconds == pytest.approx(0.5 * 10 * 4)
    assert found.sentence(2, "on 2 processes").startswith("about 10 s on 2 processes (an estimate from kept runs of the same methods")


def test_rows_with_less_than_no_repetitions_are_no_division_by_zero(store):
    keep(store, replace(FIXED, repeat=-1), 0.5)
    assert estimate([FIXED], store).seconds == pytest.approx(0.5)


def test_where_steps_are_chosen_the_nearest_tolerance_tells(store):
    keep(store, replace(CHOSEN, value=1e-4), 1.0)
    keep(store, replace(CHOSEN, value=1e-8), 3.0)
    assert estimate([replace(CHOSEN, value=1e-9, t_end=200.0)], store).seconds == pytest.approx(6.0)
    mixed = estimate([CHOSEN, FIXED], store)
    assert (mixed.like, mixed.cells) == (1, 2)
    assert "for 1 of them" in mixed.sentence(1, "in one process")
