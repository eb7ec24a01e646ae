"""Runs of a report in two steps: the same rows as in one, what is kept is not made again, and nothing is timed beside anything."""

from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace

import pytest

from daebench.pages.report import timed_runs
from daebench.pages.report.timed_runs import make_runs
from daebench.records.store import opened
from daebench.studies.grid.measure import row_of
from daebench.studies.grid.run_specification import GridRun
from daebench.studies.grid.specification import key_of

TIMED = GridRun(problem="planar_pendulum", case="rotating", method="rattle", value=1 / 8, t_end=2.0, metrics=("q", "energy"), repeat=1)
CELLS = [
    *(TIMED.at(h) for h in (1 / 8, 1 / 16)),
    replace(TIMED, method="scipy:DOP853", value=1e-6),
    replace(TIMED, value=1 / 32, repeat=0),
    replace(TIMED, t_end=1e-3),
]
"""Fixed steps, a tolerance, one that is not timed, and one that fails: it takes no step."""

TIMES = ("seconds", "callback_seconds")


@pytest.fixture
def pools(monkeypatch):
    """Count open pools, of one thread each."""
    state = {"opened": 0, "open": 0}

    @contextmanager
    def one_thread():
        state["opened"] += 1
        state["open"] += 1
        with ThreadPoolExecutor(1) as pool:
            yield pool
        state["open"] -= 1

    return state, one_thread


@pytest.mark.usefixtures("uncompiled_schemes")
def test_rows_are_those_of_one_step_but_for_their_times(tmp_path, monkeypatch, pools):
    state, one_thread = pools
    alone, told = [], []
    real = timed_runs.with_time
    monkeypatch.setattr(timed_runs, "with_time", lambda specification, row: alone.append(not state["open"]) or real(specification, row))
    with opened(tmp_path / "studies.db") as kept:
        make_runs(CELLS, kept, lambda done, doing: told.append(done), one_thread)
        for specification in CELLS:
            row, expected = (dict(each) for each in (kept.get(key_of(specification)), row_of(specification)))
            assert all((row[name] == row[name]) == (expected[name] == expected[name]) for name in TIMES)
            assert {k: str(v) for k, v in row.items() if k not in TIMES} == {k: str(v) for k, v in expected.items() if k not in TIMES}
        make_runs(CELLS, kept, lambda done, doing: pytest.fail("made again"), one_thread)
    assert alone == [True] * 4
    assert state["opened"] == 1
    assert told == sorted(told)
    assert told[-1] == 1.0


@pytest.mark.usefixtures("uncompiled_schemes")
def test_what_was_looked_at_is_not_looked_at_again(tmp_path, monkeypatch, pools):
    def interrupted(specification, row):
        raise KeyboardInterrupt

    with opened(tmp_path / "studies.db") as kept, monkeypatch.context() as patch:
        patch.setattr(timed_runs, "with_time", interrupted)
        with pytest.raises(KeyboardInterrupt):
            make_runs(CELLS, kept, lambda *told: None, pools[1])
    monkeypatch.setattr("daebench.studies.grid.measure.measured_row", lambda specification: pytest.fail("looked at"))
    with opened(tmp_path / "studies.db") as kept:
        make_runs(CELLS, kept, lambda *told: None, pools[1])
        assert all(key_of(specification) in kept for specification in CELLS)
