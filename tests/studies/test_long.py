"""Long runs: statistics in bounded memory, checkpoints that go on to the same bits, ensembles, and what the command says."""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from cache_damage import FAMILY
from ivps import ivp

from daebench.diagnostics.drift import Drift
from daebench.diagnostics.manifold import residual_scales
from daebench.diagnostics.random_walk import Walk
from daebench.errors import BadInput
from daebench.runs.ivp import PoissonIvp
from daebench.runs.request import Request
from daebench.studies.long import checkpoint, windows
from daebench.studies.long import run as long_run
from daebench.studies.long.checkpoint import group_identity, identity, load, resumed, save
from daebench.studies.long.ensemble import Ensemble
from daebench.studies.long.run import Checkpoint, LongRun, Stream, start_of
from daebench.studies.long.table import growth, members_table, sentence, share, windows_table
from daebench.studies.long.windows import COUNT, EDGES, LEAST, MANY, MEAN, MOST, SQUARES, Blocks, Windows, centres, mean_square, middles

RUNS = {
    "rattle": LongRun(problem="spherical_pendulum", case="fig1.2", method="rattle", h=0.01, stride=3),
    "lobatto3": LongRun(problem="spherical_pendulum", case="fig1.2", method="lobatto3", h=0.01, stride=3),
    "shake": LongRun(problem="planar_pendulum", case="rotating", method="shake", h=0.01, stride=3),
    "compensated": LongRun(problem="planar_pendulum", case="rotating", method="rattle/kahan_li8", h=0.1, stride=3, compensated=True),
    "mixed": LongRun(problem="planar_pendulum", case="rotating", method="rattle", h=0.01, stride=3, precision="mixed"),
    "local": LongRun(problem="planar_pendulum", case="rotating", method="local:midpoint", h=0.02, stride=3),
    "poisson": LongRun(problem="free_rigid_body", case="symmetric", method="strang", h=0.05, stride=3),
}
STEPS = 500


@pytest.fixture
def uncompiled(monkeypatch):
    """Have methods run as Python, and samples be reduced 32 at a time."""
    compiled = LongRun.solver.fget
    monkeypatch.setattr(LongRun, "solver", property(lambda self: replace(compiled(self), compiled=False)))
    for module in (long_run, windows):
        monkeypatch.setattr(module, "BLOCK", 32)


def marched(spec, steps=STEPS):
    stream = Stream(spec, steps)
    while stream.going:
        stream.advance()
    return stream


def bits(stream):
    run, table = stream.run, stream.windows.table
    parts = stream.numbers(), table, stream.blocks.means, run.state_rows[: run.row, 0]
    return [part.tobytes() for part in parts], run.done, run.left, stream.blocks.length, stream.blocks.total, stream.blocks.pieces


@pytest.mark.sampled(left_out=("lobatto3", "shake", "mixed"))
@pytest.mark.parametrize("name", RUNS)
def test_a_run_that_is_left_and_taken_up_again_ends_with_the_same_bits(name, uncompiled, monkeypatch, random, tmp_path):
    spec, file = RUNS[name], tmp_path / "run.npz"
    monkeypatch.setattr(windows, "MANY", 2)
    whole = marched(spec)
    assert (whole.run.failure, whole.run.done) == (None, STEPS)
    assert whole.windows.samples + whole.run.row == STEPS // spec.stride
    monkeypatch.setattr(long_run, "next_piece", lambda *_: int(random.integers(1, 60)))
    stream, left = Stream(spec, STEPS), 0
    while stream.going:
        stream.advance()
        if random.random() < 0.3:
            save(file, identity(spec), stream)
            stream, left = Stream(spec, STEPS), left + 1
            resumed(stream, load(file, identity(spec)))
    assert left > 3
    assert bits(stream) == bits(whole)


@pytest.mark.parametrize("name", ["rattle", "local", "poisson"])
def test_samples_are_the_energy_errors_of_the_states_that_a_plain_run_stores(name, uncompiled):
    spec = RUNS[name]
    steps = 30 * spec.stride
    stream = marched(spec, steps)
    run = spec.solver.solve(spec.ivp, Request(value=spec.h, steps=steps, every=spec.stride)).complete()
    states = (run.y,) if isinstance(spec.ivp, PoissonIvp) else (run.p, run.q)
    energies = spec.ivp.along("H", *states)
    assert len(stream.errors) == 30
    np.testing.assert_allclose(stream.errors, energies[1:] - energies[0], rtol=0, atol=1e-14 * abs(energies[0]))
    end = np.concatenate([x[-1] for x in states])
    assert stream.run.linked.leave(stream.run.x).tobytes() == end.tobytes()


def test_members_in_mixed_precision_begin_at_other_numbers_of_single_precision(tmp_path):
    spec = RUNS["mixed"]
    Ensemble(spec, 4, 64, tmp_path).check()
    starts = {start_of(spec.ivp, number, spec.precision).q0.astype(np.float32).tobytes() for number in range(4)}
    assert len(starts) == 4


def test_a_longer_run_stops_where_the_last_step_of_a_shorter_one_tells_that_G_loses_rank(uncompiled, tmp_path):
    spec, file = (
        LongRun(problem="slider_crank", case="lock_up", method="rattle", h=0.005, stride=3, on_singular="stop"),
        tmp_path / "run.npz",
    )
    whole = marched(spec, STEPS)
    assert "G loses rank" in whole.run.failure
    shorter = marched(spec, whole.run.done)
    assert (shorter.run.failure, shorter.run.rank_pending) == (None, True)
    save(file, identity(spec), shorter)
    stream = Stream(spec, STEPS)
    resumed(stream, load(file, identity(spec)))
    while stream.going:
        stream.advance()
    assert stream.run.failure == whole.run.failure
    assert bits(stream) == bits(whole)


def test_windows_have_the_moments_of_their_samples(random):
    series = 1e9 + random.standard_normal(3000)
    found, start = Windows(), 0
    while start < len(series):
        stop = start + int(random.integers(1, 300))
        found.add(series[start:stop])
        start = stop
    assert found.samples == len(series)
    for row, (a, b) in zip(found.table, pairwise(EDGES), strict=False):
        own = series[a - 1 : b - 1]
        exact = own.astype(np.longdouble)
        assert (row[COUNT], row[LEAST], row[MOST]) == (len(own), own.min(), own.max())
        assert row[MEAN] == pytest.approx(float(exact.mean()), rel=1e-15)
        assert row[SQUARES] == pytest.approx(float(((exact - exact.mean()) ** 2).sum()), rel=1e-6, abs=1e-12)
        assert mean_square(row[None])[0] == pytest.approx(float((exact**2).mean()), rel=1e-14)
    assert centres(found.table)[5] == np.mean(np.arange(EDGES[5], EDGES[6]))


def test_blocks_are_few_and_their_means_are_those_of_the_series():
    found, pieces = Blocks(), 3 * MANY
    for k in range(pieces):
        found.add(np.arange(k * windows.BLOCK, (k + 1) * windows.BLOCK, dtype=float))
    assert len(found.means) < MANY
    assert found.length == 4 * windows.BLOCK
    expected = np.arange(len(found.means)) * found.length + (found.length - 1) / 2
    assert found.means.tolist() == expected.tolist()
    assert (middles(len(expected), found.length) - 1).tolist() == expected.tolist()
    assert len(found.means) * found.length + found.pieces * windows.BLOCK == pieces * windows.BLOCK
    assert found.at(2 * found.length).tolist() == [(a + b) / 2 for a, b in zip(expected[::2], expected[1::2], strict=False)]


def test_starts_are_of_the_same_motion_on_the_manifold_and_round_differently():
    own = ivp("spherical-fast")
    found = [start_of(own, k, "float64") for k in range(8)]
    assert found[0] is own
    energies = [float(each.value("H", each.p0, each.q0)) for each in found]
    assert len(set(energies)) > 4
    np.testing.assert_allclose(energies, energies[0], rtol=1e-11)
    g_scale, Gv_scale = residual_scales(own, own.p0, own.q0)
    for each in found[1:]:
        assert np.all(np.abs(each.value("g", each.q0)) <= 1e-15 * g_scale)
        assert np.all(np.abs(each.value("Gv", each.p0, each.q0)) <= 1e-14 * Gv_scale)
        assert 1e-14 < np.abs(each.q0 - own.q0).max() < 1e-12
    assert start_of(own, 3, "float64").q0.tobytes() == found[3].q0.tobytes()


def test_members_of_a_start_with_zeros_are_distinct_runs(tmp_path, uncompiled):
    spec = LongRun(problem="double_pendulum", case="horizontal", method="rattle", h=0.01, stride=1)
    Ensemble(spec, 16, 64, tmp_path).check()
    ends = {marched(spec.member_of(k), 31).errors.tobytes() for k in range(16)}
    assert len(ends) == 16


def test_members_that_begin_alike_are_refused(monkeypatch, tmp_path):
    monkeypatch.setattr(long_run, "ROUNDINGS", 0.0)
    with pytest.raises(BadInput, match=r"members 0 and 1 of planar_pendulum, case rotating, begin at the same state"):
        Ensemble(replace(RUNS["shake"], stride=1, on_singular="stop"), 3, 10, tmp_path).check()


def samples(spec, steps):
    """Return the energies of the samples of a run, taken from it one by one."""
    stream, found = Stream(spec, steps), []
    while stream.going:
        row = stream.run.row
        stream._piece = 1
        stream.advance()
        found.append(stream.run.state_rows[row, 0])
    return np.array(found)


def test_members_round_as_good_as_independently(uncompiled):
    """Truncation of order 8 is below round-off here: what the energy changes from step to step is rounding alone."""
    spec = replace(RUNS["compensated"], compensated=False, h=0.01, stride=1)
    changes = [np.diff(samples(spec.member_of(k), 250)) for k in range(4)]
    apart = np.corrcoef(changes)[np.triu_indices(4, 1)]
    assert np.abs(apart).max() < 0.3  # five standard errors of one pair, 1 / sqrt(250)
    assert abs(apart.mean()) < 0.12


def refused(tmp_path, spec, other, match):
    file = tmp_path / "run.npz"
    save(file, identity(spec), marched(spec, 8))
    with pytest.raises(BadInput, match=match):
        load(file, other())


def test_a_checkpoint_of_something_else_is_refused(uncompiled, tmp_path, monkeypatch):
    spec = RUNS["rattle"]
    refused(tmp_path, spec, lambda: identity(replace(spec, h=0.02)), r"is of a run with h = 0.01, not 0.02; name another folder by --out")
    refused(tmp_path, spec, lambda: identity(spec) | {"definition": "other"}, "another definition of spherical_pendulum")
    with monkeypatch.context() as patch:
        patch.setattr(checkpoint, "code_version", lambda: "an older one")
        ours = identity(spec)
    refused(tmp_path, spec, lambda: ours, "another version of daebench or of its libraries")
    monkeypatch.setattr(checkpoint, "LAYOUT", 0)
    file = tmp_path / "older.npz"
    save(file, identity(spec), marched(spec, 8))
    monkeypatch.setattr(checkpoint, "LAYOUT", 1)
    with pytest.raises(BadInput, match="layout 0, here 1"):
        load(file, identity(spec))


def test_a_damaged_checkpoint_is_named(uncompiled, tmp_path):
    for damage in FAMILY.values():
        file = tmp_path / "run.npz"
        save(file, identity(RUNS["rattle"]), marched(RUNS["rattle"], 8))
        file.write_bytes(damage(file.read_bytes()))
        with pytest.raises(BadInput, match=r"is damaged, or no checkpoint of a long run.*remove it"):
            load(file, identity(RUNS["rattle"]))


def walkers(count, random, drift=0.0, failed=()):
    """Return checkpoints of members whose energy is a walk, with 128 samples each."""
    return {
        k: Checkpoint(
            done=2048,
            left=16,
            passages=0,
            seconds=1.0,
            failure="it fell." if k in failed else "",
            windows=Windows(),
            blocks=Blocks(),
            numbers=np.empty(0),
            waiting=1.0 + 1e-10 * (np.cumsum(random.standard_normal(128)) + drift * np.arange(128)),
            first=1.0,
        )
        for k in range(count)
    }


def test_sixteen_members_tell_a_walk_and_fewer_do_not(random):
    spec = replace(RUNS["rattle"], stride=16)
    found = growth(spec, walkers(24, random))
    assert isinstance(found, Walk)
    assert found.verdict == "random walk"
    whole = share(spec, walkers(24, random), 24, 2048)
    assert sentence(found, whole).startswith("random walk: the spread of 24 members grows as t^(0.")
    assert "Told to" not in sentence(found, whole)
    assert growth(spec, walkers(20, random, failed=(0, 7))).members == 18
    few = growth(spec, members := walkers(18, random, failed=(0, 1, 2)))
    assert isinstance(few, Drift)
    said = sentence(few, share(spec, members, 18, 2048))
    assert "can be identified from 16 members or more, of which there are 15 so far. " in said
    assert said.endswith("Told to t = 20.48 from 15 of 18 members; left out: 3 of 18 stopped early.")
    assert growth(spec, walkers(2, random, failed=(0, 1))) is None
    drifting = growth(spec, walkers(16, random, drift=1.0))
    assert drifting.law == "linear"
    assert drifting.slope == pytest.approx(1e-10 / (spec.stride * spec.h), abs=4 * drifting.slope_error)


def test_members_that_are_far_behind_are_left_out_and_the_sentence_says_so(random):
    spec, members = replace(RUNS["rattle"], stride=16), walkers(20, random)
    for number, most in ((3, 0), (4, 63), (5, 64)):
        members[number] = replace(members[number], waiting=members[number].waiting[:most], done=16 * most)
    found = growth(spec, members)
    assert (type(found), found.members) == (Walk, 18)
    said = sentence(found, share(spec, members, 32, 2048))
    assert said.endswith(" Told to t = 10.24 from 18 of 32 members; left out: 2 of 32 far behind, 12 of 32 not begun.")
    long = Blocks(length=4 * windows.BLOCK, means=random.standard_normal(600))
    table = Windows(np.array([[600.0 * long.length, 0, 1, -1, 1]]))
    members[0] = replace(members[0], blocks=long, windows=table, waiting=np.ones(0))
    assert isinstance(growth(spec, members), Drift)
    assert share(spec, members, 32, 2048).told == 1


def test_where_nothing_can_be_told_the_sentence_says_why(random):
    spec = replace(RUNS["rattle"], stride=16)
    failed, early = walkers(2, random, failed=(0, 1)), walkers(2, random)
    early = {number: replace(kept, waiting=kept.waiting[:0]) for number, kept in early.items()}
    assert sentence(growth(spec, failed), share(spec, failed, 2, 2048)) == "undetermined: every member stopped early."
    assert "2 of 16 members have begun, and every one of them stopped early" in sentence(None, share(spec, failed, 16, 2048))
    assert growth(spec, early) is None
    assert sentence(None, share(spec, early, 2, 2048)).startswith("undetermined: there are too few samples")


def test_the_windows_of_all_are_those_of_their_samples_together(random):
    spec, members = replace(RUNS["rattle"], stride=16), walkers(5, random)
    table = windows_table(members_table(spec, members))
    errors = np.array([kept.errors for kept in members.values()])
    a, b = EDGES[9] - 1, EDGES[10] - 1
    row = table.iloc[9]
    assert row["t"] == pytest.approx((a + 1 + b) / 2 * 0.16)
    assert row["members"] == 5
    assert row["mean"] == pytest.approx(errors[:, a:b].mean())
    assert row["rms"] == pytest.approx(np.sqrt((errors[:, a:b] ** 2).mean()))
    assert row["spread"] == pytest.approx(errors[:, a:b].mean(axis=1).std(ddof=1))
    assert row["largest"] == np.abs(errors[:, a:b]).max()


def test_a_window_that_not_all_members_have_filled_is_that_of_those_who_have(random):
    spec, members = replace(RUNS["rattle"], stride=16), walkers(3, random)
    members[2] = replace(members[2], waiting=members[2].waiting[:90])
    table = windows_table(members_table(spec, members))
    filled = np.minimum(EDGES[1 : len(table) + 1] - EDGES[: len(table)], 129 - EDGES[: len(table)])
    short = np.clip(91 - EDGES[: len(table)], 0, filled)
    assert table["members"].tolist() == [3 if short_ == all_ else 2 for short_, all_ in zip(short, filled, strict=True)]
    assert table["members"].iloc[[0, -1]].tolist() == [3, 2]


WORDS = ("long", "planar_pendulum", "--case", "rotating", "--methods", "rattle", "--h", "0.01", "--steps", "1e3")


def test_the_command_says_what_became_of_the_energy(daebench, uncompiled, tmp_path):
    words = (*WORDS, "--ensemble", 2, "--workers", 1, "--out", tmp_path)
    status, out, err = daebench(*words, "--json")
    (run,) = json.loads(out)["runs"]
    assert (status, err, run["steps"], run["failures"]) == (0, "", [1000, 1000], {})
    assert {path.suffix for path in tmp_path.iterdir()} >= {".csv", ".png", ".svg"}
    assert run["growth"]["verdict"] in run["verdict"]
    assert sum(1 for _ in tmp_path.glob("checkpoints/*.npz")) == 2
    status, out, _ = daebench(*words, "--dry-run")
    assert (status, out.startswith("rattle: 2 x 1000 steps, 0 of them to do")) == (0, True)
    status, _, err = daebench(*words, "--steps", "500")
    assert (status, "has 1000 steps already, and 500 are requested" in err) == (2, True)


def test_an_interrupted_command_says_what_is_kept_and_goes_on(daebench, uncompiled, tmp_path, monkeypatch):
    advance, calls = Stream.advance, []

    def stopped(self):
        advance(self)
        calls.append(self)
        if len(calls) == 1:
            signal.raise_signal(signal.SIGTERM)

    words = (*WORDS, "--steps", "600", "--out", tmp_path)
    with monkeypatch.context() as patch:
        patch.setattr(Stream, "advance", stopped)
        status, out, err = daebench(*words)
    assert status == 130
    assert "undetermined: there are too few samples; take more steps. Told to t = 0.64 from 1 of 1 members." in out
    assert err.startswith("daebench: interrupted; 10.7 % of rattle")
    assert err.endswith("the same command continues from there.\n")
    spec = LongRun(problem="planar_pendulum", case="rotating", method="rattle", h=0.01)
    ensemble = Ensemble(spec, 1, 600, tmp_path / "checkpoints")
    assert ensemble.kept()[0].done == 64
    assert daebench(*words)[0] == 0
    kept, whole = ensemble.kept()[0], marched(spec, 600)
    assert (kept.done, kept.numbers.tobytes()) == (600, whole.numbers().tobytes())
    assert kept.windows.with_(kept.errors).table.tobytes() == whole.windows.with_(whole.errors).table.tobytes()


def test_an_interruption_before_the_first_sample_is_no_traceback(daebench, uncompiled, tmp_path, monkeypatch):
    advance = Stream.advance

    def stopped(self):
        advance(self)
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(Stream, "advance", stopped)
    status, out, err = daebench(*WORDS, "--stride", "100", "--out", tmp_path)
    assert (status, err.startswith("daebench: interrupted; ")) == (130, True)
    assert "too few samples; take more steps. Told from no member; left out: 1 of 1 before the first sample." in out


def test_a_dry_run_whose_trial_fails_says_why(daebench, uncompiled, tmp_path):
    words = ("long", "spherical_pendulum", "--case", "fig1.2", "--methods", "symplectic_euler", "--h", "0.625", "--steps", "1e4")
    status, out, err = daebench(*words, "--out", tmp_path, "--dry-run")
    assert (status, err) == (0, "")
    assert "10000 of them to do; a trial stopped early: symplectic_euler on spherical_pendulum, case fig1.2, stopped at t = 0 " in out


def test_a_method_above_the_problem_is_refused(daebench, tmp_path):
    status, _, err = daebench("long", "free_rigid_body", "--methods", "lifted:rattle", "--h", "0.1", "--out", tmp_path)
    assert (status, err.count("\n")) == (2, 1)
    assert "lifted:rattle has its state on another system" in err


def test_a_member_that_stops_early_says_why_and_keeps_its_windows(daebench, uncompiled, tmp_path):
    words = ("long", "spherical_pendulum", "--case", "fig1.2", "--methods", "rk4", "--h", "0.4", "--steps", "2000", "--stride", "2")
    status, out, err = daebench(*words, "--out", tmp_path)
    assert (status, err) == (1, "")
    assert "member 0: rk4 on spherical_pendulum, case fig1.2: the energy is beyond 1e+140 at t = " in out
    assert "Its windows so far are stored." in out
    (file,) = tmp_path.glob("*-members.csv")
    assert len(file.read_text().splitlines()) > 3


def test_bad_input_is_one_sentence(daebench, tmp_path):
    for words, says in [
        (("--methods", "ida:index2"), "chooses its own steps"),
        (("--steps", "1.5"), "must be a whole number"),
        (("--stride", "0"), "stride = 0 must be at least one step"),
        (("--stride", "1001"), "at most the 1000 steps"),
        (("--ensemble", "0"), "give at least 1"),
        (("--workers", "0"), "--workers 0 must be at least 1"),
        (("--precision", "half"), "unknown precision 'half'"),
    ]:
        status, out, err = daebench(*WORDS, *words, "--out", tmp_path / "new")
        assert (status, out) == (2, "")
        assert says in err
        assert err.count("\n") == 1


@pytest.mark.exhaustive
def test_an_ensemble_that_is_ended_in_any_way_goes_on_to_the_same_bits(tmp_path):
    words = ["long", "planar_pendulum", "--case", "rotating", "--methods", "rattle", "--h", "0.01", "--steps", "1e7"]
    words += ["--ensemble", "24", "--workers", "2"]
    ended = [_ended(number, [*words, "--out", str(tmp_path / "left")]) for number in (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)]
    assert ended == [-9, 130, 130]
    for out in ("left", "whole"):
        subprocess.run([sys.executable, "-m", "daebench", *words, "--out", str(tmp_path / out)], check=True, capture_output=True)
    spec = LongRun(problem="planar_pendulum", case="rotating", method="rattle", h=0.01)
    ensembles = [Ensemble(spec, 24, 10**7, tmp_path / out / "checkpoints") for out in ("left", "whole")]
    left, whole = (ensemble.kept() for ensemble in ensembles)
    for first, last in ((0, 15), (16, 23)):
        numbers = [load(ensemble.path(first, last), group_identity(spec)).numbers for ensemble in ensembles]
        assert numbers[0].tobytes() == numbers[1].tobytes()
    for k in range(24):
        assert left[k].windows.table.tobytes() == whole[k].windows.table.tobytes()
        assert left[k].blocks.means.tobytes() == whole[k].blocks.means.tobytes()


def _ended(number, words):
    """Start the command, end it as soon as a checkpoint is there that was not, and return its status."""
    folder = Path(words[-1]) / "checkpoints"
    before = _stamps(folder)
    process = subprocess.Popen(
        [
            sys.executable,
            "-c",
            "import daebench.studies.long.ensemble as e; e.SECONDS = 0.05; from daebench.cli.app import main; main()",
            *words,
        ],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    deadline = time.monotonic() + 120
    while time.monotonic() < deadline and process.poll() is None and _stamps(folder) == before:
        time.sleep(0.02)
    process.send_signal(number)
    process.communicate(timeout=60)
    return process.returncode


def _stamps(folder):
    return {path.name: path.stat().st_mtime_ns for path in folder.glob("*.npz") if not path.name.startswith(".")}


@pytest.mark.parametrize("roundings", [0.3, 1.3, 3.0])
def test_members_that_part_by_few_roundings_have_a_verdict(roundings, random):
    """The truncation error is one for all and bounded; a spread of 2.8e-16, seen too late to measure its growth, leaves nothing open."""
    spec, common = replace(RUNS["rattle"], stride=16), 1e-8 * np.sin(0.9 * np.arange(128))
    walks = np.cumsum(random.standard_normal((16, 128)), axis=1)
    walks *= roundings * 2.0**-52 / np.max(np.std(walks, axis=0))
    members = {k: replace(member, waiting=1.0 + (common + walks[k])) for k, member in walkers(16, random).items()}
    found = growth(spec, members)
    assert found.verdict == "bounded"
    said = sentence(found, share(spec, members, 16, 2048))
    assert said.startswith("bounded: the 16 members do not spread beyond round-off, and their mean changes by at most ")
