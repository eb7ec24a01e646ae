"""Long runs: statistics in bounded memory, checkpoints that go on to the same bits, ensembles, and what the command says."""

import json
import math
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cache_damage import FAMILY
from ivps import ivp
from long_runs import bits_of_checkpoint, bits_of_stream, everything, finished, marched, require_going_on, taken_up
from refusals import refused, require_refusals
from scipy import stats

from daebench.diagnostics.drift import Drift
from daebench.diagnostics.manifold import residual_scales
from daebench.diagnostics.random_walk import Walk
from daebench.runs.ivp import PoissonIvp
from daebench.runs.request import Request
from daebench.studies.long import checkpoint, windows
from daebench.studies.long import run as long_run
from daebench.studies.long.checkpoint import group_identity, identity, load, save
from daebench.studies.long.ensemble import Ensemble
from daebench.studies.long.run import Checkpoint, LongRun, Stream, start_of
from daebench.studies.long.table import Share, growth, members_table, sentence, share, windows_table
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


@pytest.mark.sampled(left_out=("lobatto3", "shake", "mixed"))
@pytest.mark.parametrize("name", RUNS)
def test_a_run_that_is_left_and_taken_up_again_ends_with_the_same_bits(name, uncompiled, monkeypatch, random, tmp_path):
    monkeypatch.setattr(windows, "MANY", 2)
    require_going_on(RUNS[name], STEPS, monkeypatch, random, tmp_path / "run.npz")


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
    spec, file = LongRun(problem="slider_crank", case="lock_up", method="rattle", h=0.005, stride=3), tmp_path / "run.npz"
    whole = marched(spec, STEPS)
    assert "G loses rank" in whole.run.failure
    shorter = marched(spec, whole.run.done)
    assert (shorter.run.failure, shorter.run.rank_pending) == (None, True)
    save(file, identity(spec), shorter)
    longer = finished(taken_up(spec, STEPS, file))
    assert longer.run.failure == whole.run.failure
    assert everything(longer) == everything(whole)


def test_windows_have_the_moments_of_their_samples(random):
    series, found = 1e9 + random.standard_normal(3000), Windows()
    for part in np.split(series, np.unique(random.integers(1, 3000, 20))):
        found.add(part)
    assert found.samples == len(series)
    for row, own in zip(found.table, np.split(series, EDGES[1:] - 1), strict=False):
        exact = own.astype(np.longdouble)
        assert (row[COUNT], row[LEAST], row[MOST]) == (len(own), own.min(), own.max())
        assert row[MEAN] == pytest.approx(float(exact.mean()), rel=1e-15)
        assert row[SQUARES] == pytest.approx(float(((exact - exact.mean()) ** 2).sum()), rel=1e-6, abs=1e-12)
        assert mean_square(row[None])[0] == pytest.approx(float((exact**2).mean()), rel=1e-14)
    assert centres(found.table)[5] == np.mean(np.arange(EDGES[5], EDGES[6]))


def test_blocks_are_few_and_their_means_are_those_of_the_series():
    found, pieces = Blocks(), 3 * MANY
    for part in np.arange(float(pieces * windows.BLOCK)).reshape(pieces, windows.BLOCK):
        found.add(part)
    count = len(found.means)
    expected = np.arange(count) * found.length + (found.length - 1) / 2
    assert (count < MANY, found.length) == (True, 4 * windows.BLOCK)
    assert found.means.tolist() == (middles(count, found.length) - 1).tolist() == expected.tolist()
    assert count * found.length + found.pieces * windows.BLOCK == pieces * windows.BLOCK
    assert found.at(2 * found.length).tolist() == expected[: count // 2 * 2].reshape(-1, 2).mean(axis=1).tolist()


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
    with refused("members-begin-alike"):
        Ensemble(replace(RUNS["shake"], stride=1), 3, 10, tmp_path).check()


def changes_of(spec, steps):
    """Return what the energy changes by in each step of a run, of which one is taken at a time."""
    stream, found = Stream(spec, steps), []
    while stream.going:
        row, stream._piece = stream.run.row, 1
        stream.advance()
        found.append(stream.run.state_rows[row, 0])
    return np.diff(found)


def test_members_round_as_good_as_independently(uncompiled):
    """Truncation of order 8 is below round-off here: what the energy changes from step to step is rounding alone."""
    spec = replace(RUNS["compensated"], compensated=False, h=0.01, stride=1)
    changes = [changes_of(spec.member_of(k), 250) for k in range(4)]
    apart = np.corrcoef(changes)[np.triu_indices(4, 1)]
    assert np.abs(apart).max() < 0.3  # five standard errors of one pair, 1 / sqrt(250)
    assert abs(apart.mean()) < 0.12


def test_a_checkpoint_of_something_else_or_damaged_is_refused(uncompiled, tmp_path, monkeypatch):
    spec, file = RUNS["rattle"], tmp_path / "run.npz"
    ours = identity(spec)
    with monkeypatch.context() as patch:
        patch.setattr(checkpoint, "code_version", lambda: "an older one")
        older = identity(spec)
    save(file, ours, marched(spec, 8))
    for code, other in (
        ("checkpoint-of-other-run", identity(replace(spec, h=0.02))),
        ("checkpoint-of-other-problem", ours | {"definition": "other"}),
        ("checkpoint-of-other-libraries", older),
    ):
        with refused(code):
            load(file, other)
    whole = file.read_bytes()
    for damage in FAMILY.values():
        file.write_bytes(damage(whole))
        with refused("checkpoint-damaged"):
            load(file, ours)
    file.write_bytes(whole)
    monkeypatch.setattr(checkpoint, "LAYOUT", checkpoint.LAYOUT + 1)
    with refused("checkpoint-of-other-version"):
        load(file, ours)


WALKING = replace(RUNS["rattle"], stride=16)


def walkers(count, random, drift=0.0, failed=()):
    """Return checkpoints of members whose energy is a walk, with 128 samples each."""
    return {k: with_samples(1e-10 * (np.cumsum(random.standard_normal(128)) + drift * np.arange(128)), k in failed) for k in range(count)}


def with_samples(errors, failed=False):
    """Return the checkpoint of a member whose samples are these errors of an energy 1, all of them in no window yet."""
    return Checkpoint(
        done=16 * len(errors),
        left=16,
        passages=0,
        seconds=1.0,
        failure="it fell." if failed else "",
        windows=Windows(),
        blocks=Blocks(),
        numbers=np.empty(0),
        waiting=1.0 + errors,
        first=1.0,
    )


def test_sixteen_members_tell_a_walk_and_fewer_do_not(random):
    found = growth(WALKING, walkers(24, random))
    assert isinstance(found, Walk)
    assert found.verdict == "random walk"
    assert growth(WALKING, walkers(20, random, failed=(0, 7))).members == 18
    few = walkers(18, random, failed=(0, 1, 2))
    assert isinstance(growth(WALKING, few), Drift)
    assert share(WALKING, few, 18, 2048) == Share(18, 18, 3, 15, pytest.approx(20.48), False)
    assert share(WALKING, walkers(3, random), 3, 2048).whole
    none = walkers(2, random, failed=(0, 1)), {0: with_samples(np.zeros(0))}
    assert [growth(WALKING, members) for members in none] == [None, None]
    assert [share(WALKING, members, 2, 2048).told for members in none] == [0, 0]


def test_the_slope_of_a_drift_is_off_by_its_standard_error_times_a_number_of_student(random):
    """Slopes of independent walks are normal: of 16 members they are off as Student's t says, with 15 degrees of freedom."""
    found = [growth(WALKING, walkers(16, random, drift=1.0)) for _ in range(40)]
    assert {each.law for each in found} == {"linear"}
    off = [(each.slope - 1e-10 / (WALKING.stride * WALKING.h)) / each.slope_error for each in found]
    normal = stats.norm.ppf(stats.t(15).cdf(off))
    assert abs(normal.sum()) < 5 * len(off) ** 0.5
    assert 1e-6 < stats.chi2(len(off)).cdf(normal @ normal) < 1 - 1e-6


def test_members_that_are_far_behind_are_left_out_and_the_sentence_says_so(random):
    members = walkers(20, random)
    for number, most in ((3, 0), (4, 63), (5, 64)):
        members[number] = with_samples(members[number].waiting[:most] - 1.0)
    found = growth(WALKING, members)
    assert (type(found), found.members) == (Walk, 18)
    told = share(WALKING, members, 32, 2048)
    assert told == Share(32, 20, 0, 18, pytest.approx(10.24), False)
    assert sentence(found, told).endswith("to t = 10.24 from 18 of 32 members; left out: 2 of 32 far behind, 12 of 32 not begun.")
    long = Blocks(length=4 * windows.BLOCK, means=random.standard_normal(600))
    table = Windows(np.array([[600.0 * long.length, 0, 1, -1, 1]]))
    members[0] = replace(members[0], blocks=long, windows=table, waiting=np.ones(0))
    assert isinstance(growth(WALKING, members), Drift)
    assert share(WALKING, members, 32, 2048).told == 1


def test_the_windows_of_all_are_those_of_the_samples_of_members_who_have_filled_them(random):
    members = walkers(5, random)
    errors = np.array([kept.errors for kept in members.values()])
    members[4] = with_samples(members[4].waiting[:90] - 1.0)
    table = windows_table(members_table(WALKING, members))
    for a, b, row in zip(EDGES - 1, np.minimum(EDGES[1:] - 1, 128), table.itertuples(), strict=False):
        own = errors[: 5 if b <= 90 else 4, a:b]
        assert row.t == pytest.approx((a + 1 + b) / 2 * 0.16)
        assert row.members == len(own)
        assert row.mean == pytest.approx(own.mean())
        assert row.rms == pytest.approx(np.sqrt((own**2).mean()))
        assert row.spread == pytest.approx(own.mean(axis=1).std(ddof=1))
        assert row.largest == np.abs(own).max()
    assert set(table["members"]) == {4, 5}


WORDS = ("long", "planar_pendulum", "--case", "rotating", "--methods", "rattle", "--h", "0.01", "--steps", "1e3")


def test_the_command_says_what_became_of_the_energy(daebench, uncompiled, tmp_path):
    words = (*WORDS, "--ensemble", 2, "--workers", 1, "--out", tmp_path)
    status, out, err = daebench(*words, "--json")
    (run,) = json.loads(out)["runs"]
    assert (status, err, run["steps"], run["failures"]) == (0, "", [1000, 1000], {})
    assert {path.suffix for path in tmp_path.iterdir()} >= {".csv", ".png", ".svg"}
    assert sum(1 for _ in tmp_path.glob("checkpoints/*.npz")) == 2
    assert "2 x 1000 steps, 0 of them" in daebench(*words, "--dry-run")[1]
    require_refusals(daebench, words, ("member-beyond-request", "--steps 500"))


def test_an_interrupted_command_goes_on(daebench, uncompiled, tmp_path, monkeypatch):
    words = (*WORDS, "--steps", "600", "--out", tmp_path)
    with monkeypatch.context() as patch:
        interrupt(patch, signal.SIGTERM)
        status, out, err = daebench(*words)
    assert (status, err.count("\n")) == (130, 1)
    assert "Told to t = 0.64 from 1 of 1 members" in out
    assert "10.7 % of rattle" in err
    spec = LongRun(problem="planar_pendulum", case="rotating", method="rattle", h=0.01)
    ensemble = Ensemble(spec, 1, 600, tmp_path / "checkpoints")
    assert ensemble.kept()[0].done == 64
    assert daebench(*words)[0] == 0
    kept, whole = ensemble.kept()[0], marched(spec, 600)
    assert (kept.done, kept.numbers.tobytes(), bits_of_checkpoint(kept)) == (600, whole.numbers().tobytes(), bits_of_stream(whole))


def interrupt(patch, number):
    """Have a signal come after each piece of a run."""
    advance = Stream.advance

    def interrupted(self):
        advance(self)
        signal.raise_signal(number)

    patch.setattr(Stream, "advance", interrupted)


def test_an_interruption_before_the_first_sample_is_no_traceback(daebench, uncompiled, tmp_path, monkeypatch):
    interrupt(monkeypatch, signal.SIGINT)
    status, out, err = daebench(*WORDS, "--stride", "100", "--out", tmp_path)
    assert (status, err.count("\n")) == (130, 1)
    assert "1 of 1 before the first sample" in out


def test_a_member_that_stops_early_says_why_and_keeps_its_windows(daebench, uncompiled, tmp_path):
    words = ("long", "spherical_pendulum", "--case", "fig1.2", "--methods", "rk4", "--h", "0.4", "--steps", "2000", "--stride", "2")
    status, out, err = daebench(*words, "--out", tmp_path)
    assert (status, err) == (1, "")
    assert "the energy is beyond 1e+140 at t = " in out
    (file,) = tmp_path.glob("*-members.csv")
    assert len(file.read_text().splitlines()) > 3
    words = ("long", "spherical_pendulum", "--case", "fig1.2", "--methods", "symplectic_euler", "--h", "0.625", "--steps", "1e4")
    status, out, err = daebench(*words, "--out", tmp_path, "--dry-run")
    assert (status, err) == (0, "")
    assert "a trial stopped early: symplectic_euler" in out


def test_bad_input_is_one_sentence(daebench, tmp_path):
    require_refusals(
        daebench,
        (*WORDS, "--out", tmp_path),
        ("long-own-steps", "--methods ida:index2"),
        ("long-steps-out-of-range", "--steps 1.5"),
        ("stride-out-of-range", "--stride 0"),
        ("stride-out-of-range", "--stride 1001"),
        ("long-ensemble-empty", "--ensemble 0"),
        ("workers-not-positive", "--workers 0"),
        ("unknown-name", "--precision half"),
    )
    words = ("long", "free_rigid_body", "--h", "0.1", "--out", tmp_path)
    require_refusals(daebench, words, ("long-on-other-system", "--methods lifted:rattle"))


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
        assert bits_of_checkpoint(left[k]) == bits_of_checkpoint(whole[k])


def _ended(number, words):
    """Start the command, end it as soon as a checkpoint is there that was not, and return its status."""
    folder = Path(words[-1]) / "checkpoints"
    before = _stamps(folder)
    program = "import daebench.studies.long.ensemble as e; e.SECONDS = 0.05; from daebench.cli.app import main; main()"
    process = subprocess.Popen(
        [sys.executable, "-c", program, *words],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    deadline = time.monotonic() + 120
    while time.monotonic() < deadline and process.poll() is None and _stamps(folder) == before:
        time.sleep(0.02)
    process.send_signal(number)
    return process.wait(timeout=60)


def _stamps(folder):
    return {path.name: path.stat().st_mtime_ns for path in folder.glob("*.npz") if not path.name.startswith(".")}


@pytest.mark.parametrize("roundings", [0.3, 1.3, 3.0])
def test_members_that_part_by_few_roundings_have_a_verdict(roundings, random):
    """The truncation error is one for all and bounded; a spread of 2.8e-16, seen too late to measure its growth, leaves nothing open."""
    walks = np.cumsum(random.standard_normal((16, 128)), axis=1)
    walks *= roundings * 2.0**-52 / np.max(np.std(walks, axis=0))
    found = growth(WALKING, {k: with_samples(1e-8 * np.sin(0.9 * np.arange(128)) + walk) for k, walk in enumerate(walks)})
    assert found.verdict == "bounded"
    assert math.isnan(found.exponent)
