"""Long runs of code from outside: samples, checkpoints that go on to the same bits, ensembles, and what is refused."""

import json
import time

import numpy as np
import pytest
from long_runs import marched, require_going_on
from outside_code import RATTLE
from refusals import refused, require_refusals

from daebench.methods.outside import ending
from daebench.studies.long import ensemble, windows
from daebench.studies.long import run as long_run
from daebench.studies.long.checkpoint import identity, load, save
from daebench.studies.long.ensemble import run_member
from daebench.studies.long.run import LongRun

STEPS = 500


def long_of(method, **settings):
    return LongRun(**{"problem": "spherical_pendulum", "case": "fig1.2", "method": method, "h": 0.01, "stride": 3} | settings)


@pytest.fixture
def small_blocks(monkeypatch):
    """Have samples be reduced 32 at a time."""
    for module in (long_run, windows):
        monkeypatch.setattr(module, "BLOCK", 32)


@pytest.fixture(params=["./mine.py:step", "libmine.so:step"])
def spec(request, mine, library):
    return long_of(request.param.replace("libmine.so", str(library)))


def test_samples_are_those_of_rattle_and_the_state_is_its_own(spec):
    theirs, own = marched(spec, 90), marched(long_of("rattle"), 90)
    assert (theirs.run.done, len(theirs.errors)) == (90, 30)
    assert np.allclose(theirs.errors, own.errors, rtol=0, atol=1e-12)
    assert np.abs(own.errors).max() > 1e-5
    run = spec.solver.solve(spec.ivp, spec.request(90))
    assert np.array_equal(np.concatenate(theirs.run.state), np.concatenate([run.p[-1], run.q[-1]]))


def test_a_run_that_is_left_and_taken_up_again_ends_with_the_same_bits(spec, small_blocks, monkeypatch, random, tmp_path):
    require_going_on(spec, STEPS, monkeypatch, random, tmp_path / "run.npz")


def test_a_run_of_another_text_is_not_gone_on_with(mine, tmp_path):
    spec, file = long_of("./mine.py:step"), tmp_path / "run.npz"
    save(file, identity(spec), marched(spec, 9))
    (mine / "mine.py").write_text(RATTLE + "# another\n")
    with refused("checkpoint-of-other-method", says=("py:step",)):
        load(file, identity(spec))


def test_a_run_that_goes_wrong_keeps_its_samples_and_says_where(mine, library):
    late = marched(long_of(f"{library}:fails_late"), STEPS)
    done = late.run.done
    assert 0 < done < STEPS
    assert f"(step {done + 1} of 500, h = 0.01)" in late.run.failure
    assert len(late.errors) == done // 3
    shrinking = marched(long_of("./mine.py:shrinks", case="fig1.1", stride=1), STEPS)
    assert (shrinking.run.done, len(shrinking.errors)) == (5, 5)
    with refused("state-not-arrays"):
        marched(long_of("./mine.py:one"), STEPS)
    blown = marched(long_of("./mine.py:blows_up", case="fig1.1", stride=1), STEPS)
    assert "the energy is beyond 1e+140 at t = 0.01" in blown.run.failure


def test_what_hangs_is_ended_by_a_second_interruption_that_comes_later(mine, monkeypatch, tmp_path):
    monkeypatch.setattr(ensemble, "PATIENCE", 0.2)
    monkeypatch.setattr(ending, "SILENCE", 120.0)  # its end is no interruption
    spec, began = long_of("./mine.py:interrupted"), time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        run_member(spec, STEPS, tmp_path / "run.npz")
    assert time.monotonic() - began >= 0.3
    assert not (tmp_path / "run.npz").exists()


WORDS = ("long", "spherical_pendulum", "--case", "fig1.1", "--h", 0.01, "--steps", 3000)


def test_the_command_tells_a_drift_from_none_and_goes_on(mine, daebench, tmp_path):
    words = (*WORDS, "--methods", "./mine.py:step,./mine.py:reduced", "--ensemble", 2, "--workers", 1, "--out", tmp_path)
    status, out, err = daebench(*words, "--json")
    assert (status, err) == (0, "")
    assert [(run["growth"]["verdict"], run["growth"]["law"]) for run in json.loads(out)["runs"]] == [
        ("bounded", ""),
        ("drifts", "linear"),
    ]
    assert sum(1 for _ in tmp_path.glob("checkpoints/*.npz")) == 4
    assert daebench(*words, "--dry-run")[1].count("2 x 3000 steps, 0 of them to do") == 2


def test_what_has_more_than_a_state_is_refused(mine, daebench, tmp_path):
    require_refusals(
        daebench,
        (*WORDS, "--out", tmp_path, "--methods"),
        ("long-not-from-state", "./mine.py:solve"),
        ("long-not-from-state", "./mine.py:Counting"),
        ("long-not-from-state", "exec:true"),
        ("compensated-from-outside", "./mine.py:step --compensated"),
        ("outside-precision", "./mine.py:step --precision float32"),
    )
