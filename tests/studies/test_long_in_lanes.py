"""Ensembles of long runs in lanes: the bits of single runs, members that leave their lanes, checkpoints, and what the command says."""

import json
import signal
from dataclasses import replace

import numpy as np
import pytest
from long_runs import bits, bits_of_checkpoint, bits_of_stream, finished, marched
from refusals import refused

from daebench.studies.long import lanes, windows
from daebench.studies.long import run as long_run
from daebench.studies.long.checkpoint import group_identity, load, save
from daebench.studies.long.ensemble import Ensemble, terminated_as_interrupted
from daebench.studies.long.lanes import LaneStream
from daebench.studies.long.run import LongRun, start_of, starts_of

PENDULUM = LongRun(problem="planar_pendulum", case="rotating", method="rattle", h=0.01, stride=3)
RUNS = {
    "compensated": replace(PENDULUM, method="rattle/kahan_li8", h=0.1, compensated=True),
    "local": replace(PENDULUM, method="local:midpoint", h=0.02),
    "poisson": LongRun(problem="free_rigid_body", case="symmetric", method="strang", h=0.05, stride=3),
    "shake": replace(PENDULUM, method="shake"),
}
STEPS = 500


@pytest.fixture
def small_blocks(monkeypatch):
    """Have samples be reduced 32 at a time, and few blocks kept."""
    for module in (long_run, windows, lanes):
        monkeypatch.setattr(module, "BLOCK", 32)
    monkeypatch.setattr(windows, "MANY", 2)


def bits_in_lanes(stream, k):
    return bits(stream.windows.some(k), stream.blocks.some(k), stream.waiting[:, k])


def run_like_single_runs(ensemble):
    """Run an ensemble, require that each member has the bits of a run by itself, and return its checkpoints."""
    ensemble.run(1, lambda _: None)
    kept = ensemble.kept()
    assert sorted(kept) == list(range(ensemble.members))
    for k, checkpoint in kept.items():
        single = marched(ensemble.spec.member_of(k), ensemble.steps)
        assert (checkpoint.failure, checkpoint.done, checkpoint.passages) == (single.failure, single.done, single.passages)
        assert bits_of_checkpoint(checkpoint) == bits_of_stream(single)
    return kept


@pytest.mark.sampled(left_out=("local", "shake", "compensated"))
@pytest.mark.parametrize("spec", [PENDULUM, *(pytest.param(RUNS[name], id=name, marks=pytest.mark.slow) for name in RUNS)])
def test_members_in_lanes_have_the_bits_of_runs_by_themselves(spec, small_blocks):
    stream = finished(LaneStream(spec, range(19), STEPS))
    assert (stream.done, stream.windows.samples + stream.row) == (STEPS, STEPS // 3)
    for k in (0, 7, 18):
        single = marched(spec.member_of(k), STEPS)
        assert bits_in_lanes(stream, k) == bits_of_stream(single)
        assert np.array(flat(stream.run.carried_by(k, single.run.memory))).tobytes() == single.numbers().tobytes()


def flat(x):
    return [number for part in x for number in flat(part)] if isinstance(x, tuple) else [*np.ravel(x)]


def test_starts_of_members_are_those_of_single_runs():
    ivp = PENDULUM.member_of(0).ivp
    some = starts_of(ivp, [0, 3, 11], 0.01)
    for k, number in enumerate((0, 3, 11)):
        single = start_of(ivp, number, "float64")
        assert [x[k].tobytes() for x in some.start] == [x.tobytes() for x in single.start]


def test_lanes_that_are_left_and_taken_up_again_end_with_the_same_bits(small_blocks, monkeypatch, random, tmp_path):
    file, who = tmp_path / "lanes.npz", group_identity(PENDULUM)
    whole = finished(LaneStream(PENDULUM, range(5), STEPS))
    monkeypatch.setattr(lanes, "next_piece", lambda *_: int(random.integers(1, 60)))
    stream, left = LaneStream(PENDULUM, range(5), STEPS), 0
    while stream.going:
        stream.advance()
        if random.random() < 0.3:
            save(file, who, stream)
            kept = load(file, who)
            stream, left = LaneStream(PENDULUM, kept.members, STEPS), left + 1
            stream.restore(kept)
    assert left > 3
    assert [bits_in_lanes(stream, k) for k in range(5)] == [bits_in_lanes(whole, k) for k in range(5)]
    assert stream.numbers().tobytes() == whole.numbers().tobytes()


@pytest.fixture
def scattered(monkeypatch):
    """Have starts differ so much that some members stop early, at different times."""
    monkeypatch.setattr(long_run, "ROUNDINGS", 0.9 / 2.0**-52)
    long_run._ivp.cache_clear()
    yield replace(PENDULUM, h=0.45, stride=2)
    long_run._ivp.cache_clear()


def test_members_that_fail_keep_step_and_reason_and_the_others_go_on(scattered, small_blocks, tmp_path):
    ensemble = Ensemble(scattered, 20, STEPS, tmp_path)
    kept = run_like_single_runs(ensemble)
    failed = {k for k, checkpoint in kept.items() if checkpoint.failure}
    assert 3 <= len(failed) <= 17
    assert len({kept[k].done for k in failed}) > 1
    assert {path.name for path in tmp_path.glob("*.npz")} == {ensemble.path(0, 19).name} | {ensemble.path(k).name for k in failed}
    assert Ensemble(scattered, 20, STEPS, tmp_path).pieces(2) == []


def test_members_whose_energy_is_beyond_all_bounds_are_given_up(small_blocks, tmp_path):
    spec = LongRun(problem="spherical_pendulum", case="fig1.2", method="rk4", h=0.4, stride=2)
    for checkpoint in run_like_single_runs(Ensemble(spec, 3, 2000, tmp_path)).values():
        assert "the energy is beyond 1e+140 at t = " in checkpoint.failure


@pytest.mark.sampled(left_out=("stop",))
@pytest.mark.slow
@pytest.mark.parametrize("mode", ["stop", "continue"])
def test_members_whose_G_loses_rank_go_on_by_themselves(mode, small_blocks, tmp_path):
    spec = LongRun(problem="slider_crank", case="lock_up", method="rattle", h=0.005, stride=3, on_singular=mode)
    for checkpoint in run_like_single_runs(Ensemble(spec, 4, STEPS, tmp_path)).values():
        assert ("G loses rank" in checkpoint.failure) == (mode == "stop")


def test_a_signal_leaves_a_checkpoint_that_is_gone_on_with_to_the_same_bits(small_blocks, monkeypatch, tmp_path):
    told = []

    def stop(part):
        told.append(part)
        if len(told) == 2:
            signal.raise_signal(signal.SIGTERM)

    monkeypatch.setattr(lanes, "next_piece", lambda *_: 50)
    ensemble = Ensemble(PENDULUM, 18, STEPS, tmp_path)
    with pytest.raises(KeyboardInterrupt), terminated_as_interrupted():
        ensemble.run(1, stop)
    assert len(told) == 2
    assert {checkpoint.done for checkpoint in ensemble.kept().values()} == {64 + 32}
    assert [len(piece.members) for piece in ensemble.pieces(1)] == [18]
    run_like_single_runs(ensemble)
    assert ensemble.done() == 1


def test_an_ensemble_grows_by_members_and_steps(small_blocks, tmp_path):
    for members, steps in ((1, 300), (17, 300), (20, 300), (20, STEPS)):
        ensemble = Ensemble(PENDULUM, members, steps, tmp_path)
        ensemble.check()
        ensemble.run(1, lambda _: None)
        assert {checkpoint.done for checkpoint in ensemble.kept().values()} == {steps}
    assert sorted(path.name[len(ensemble.stem) + 1 : -4] for path in tmp_path.glob("*.npz")) == ["000", "001-016", "017-019"]
    few = Ensemble(PENDULUM, 9, STEPS, tmp_path)
    assert (sorted(few.kept()), few.pieces(1)) == (list(range(9)), [])
    with refused("member-beyond-request", says=("500", "300")):
        Ensemble(PENDULUM, 20, 300, tmp_path).check()


def test_the_command_gives_exponent_standard_error_verdict_and_bands(daebench, tmp_path):
    words = ("long", "planar_pendulum", "--case", "rotating", "--methods", "rattle", "--h", "0.01", "--stride", "3", "--steps", "9e3")
    status, out, err = daebench(*words, "--ensemble", "32", "--workers", "1", "--out", tmp_path, "--json")
    (run,) = json.loads(out)["runs"]
    assert (status, err) == (0, "")
    assert run["told_from"] == {"asked": 32, "begun": 32, "failed": 0, "told": 32, "until": 90.0, "whole": True}
    assert (run["exponent"], run["standard_error"]) == (run["growth"]["exponent"], run["growth"]["exponent_error"])
    assert abs(run["exponent"] - 0.5) < 4 * run["standard_error"] < 0.4
    assert (run["growth"]["members"], run["growth"]["verdict"]) == (32, "random walk")
    assert "90 % of members" in next(tmp_path.glob("*.svg")).read_text()
