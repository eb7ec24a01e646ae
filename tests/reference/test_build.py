"""Building a reference: the command's whole way, resumed where it was cut off, and refused where it cannot be certified."""

import sys

import mpmath as mp
import numpy as np
import pytest
from kept_stages import keeping, spoiled
from refusals import refused
from rotating import NAME, exact

from daebench.reference.check.ida_errors import ida_errors
from daebench.reference.keep.store import load, names
from daebench.reference.make import build as building
from daebench.reference.make import constrained, independent_computations
from daebench.reference.make.build import build
from daebench.reference.make.certify import NotCertified
from daebench.reference.make.stages import Stages


@pytest.fixture
def rotating(references):
    return load(NAME, references)


def test_stored_digits_are_those_of_the_motion(rotating):
    with mp.workdps(60):
        for k in (1, 7, 32):
            for part, values in zip("qp", exact(rotating.t[k]), strict=False):
                errors = [abs(mp.mpf(rotating.text[f"{part}{i + 1}"][k]) - x) for i, x in enumerate(values)]
                assert np.all(np.array(errors, dtype=float) <= rotating.bound[part][k])
    assert rotating.bound["q"].max() < 1e-30


def test_the_certificate_tells_what_was_asked_of_it(rotating):
    found = rotating.certificate
    assert found["definition"]["p0"] == ["5/2", "0"]
    assert found["made"]["by"].endswith(f"build {NAME} --t-end 4.0 --spacing 8")
    assert found["horizon"] | {"rule": ""} == {"truth": 4.0, "double": None, "asked": 4.0, "rule": ""}
    assert set(found["drift"]) == {"g", "Gv", "energy"}
    assert all(0 < value < 1e-31 for value in found["drift"].values())
    assert found["rank"]["smallest_singular_value"] == pytest.approx(4.0)
    assert len(found["amplification"]["values"]) == 33


def test_ida_is_measured_against_the_digits(rotating):
    rows = rotating.certificate["ida"]
    assert [(row["method"], row["tol"]) for row in rows] == [(f"ida:{f}", 10.0**-k) for f in ("index2", "ggl") for k in range(10, 15)]
    for row in rows:
        assert row["status"] == "reached the end"
        assert row["lost"] is None
        assert 1e-15 < row["error"]["q"] < 1e3 * row["tol"]
        assert row["estimate"]["q"] > 0.2 * row["error"]["q"]
        assert row["residuals"] > row["steps"] > 100
        assert [mark for mark, _ in row["error_q_until"]] == [1.0, 2.0]


@pytest.mark.parametrize("off", [1e-7, 1e-10])
def test_a_truth_that_ida_knows_better_is_refused(rotating, off):
    keep, reference = keeping(), dict(rotating.values)
    ida_errors(rotating.ivp(), rotating.t, reference, keep)
    reference["q"] = reference["q"] + off * (rotating.t[:, None] > 2)
    with refused("reference-disagrees-with-ida", NotCertified, says=("ida:index2", "q")):
        ida_errors(rotating.ivp(), rotating.t, reference, keep)


@pytest.fixture
def series(monkeypatch):
    """Give the list of Taylor series that were integrated, a word each."""
    done, integrated = [], independent_computations.integrated
    monkeypatch.setattr(independent_computations, "integrated", lambda *a, **k: done.append("taylor") or integrated(*a, **k))
    return done


@pytest.fixture
def interrupted(monkeypatch):
    """Give a function that begins a build, which is interrupted before IDA is run; builds after it go without IDA."""

    def begun(folder, **more):
        def interrupt(*_):
            raise KeyboardInterrupt

        monkeypatch.setattr(building, "ida_errors", interrupt)
        with pytest.raises(KeyboardInterrupt):
            build(NAME, folder=folder, t_end=2, **more)
        monkeypatch.setattr(building, "ida_errors", lambda *_: [])

    return begun


def test_an_interrupted_build_goes_on_where_it_stopped(tmp_path, series, interrupted):
    interrupted(tmp_path)
    assert names(tmp_path) == ()
    assert len(series) == 4
    build(NAME, folder=tmp_path, t_end=2)
    assert len(series) == 4
    assert load(NAME, tmp_path).horizon == 2
    assert [path.name for path in tmp_path.iterdir()] == [NAME]
    build(NAME, folder=tmp_path, t_end=2, overwrite=True)
    assert len(series) == 8


def test_what_a_stage_left_is_what_is_read_and_pieces_of_one_are_made_again(tmp_path):
    stages = Stages(tmp_path / "stages", "key", lambda stage: None)
    with mp.workdps(70):
        rows = stages.rows("one", lambda: [[mp.mpf(1) / 3, mp.mpf("1e-40")]])
        assert abs(rows[0][0] - mp.mpf(1) / 3) < 1e-59
        assert stages.rows("one", lambda: 1 / 0) == rows
    (tmp_path / "stages" / "one.json").write_text('{"x": ')
    assert stages.record("one", lambda: {"x": 2}) == {"x": 2}


def test_what_other_code_made_or_what_was_made_for_another_request_is_not_used(tmp_path, monkeypatch, series, interrupted):
    for code in ("one", "other"):
        monkeypatch.setattr(building, "_code", lambda problem, code=code: [code])
        interrupted(tmp_path, overwrite=True)
    assert len(series) == 8
    build(NAME, folder=tmp_path, t_end=4)
    assert load(NAME, tmp_path).horizon == 4


def test_a_reference_that_is_being_built_is_not_built_twice_at_once(tmp_path, monkeypatch):
    def meanwhile(*_):
        with refused("reference-being-built"):
            build(NAME, folder=tmp_path, t_end=2)
        return []

    monkeypatch.setattr(building, "ida_errors", meanwhile)
    build(NAME, folder=tmp_path, t_end=2)
    assert [path.name for path in tmp_path.iterdir()] == [NAME]


def test_a_failed_certification_leaves_the_old_reference(copied, monkeypatch):
    before, right = load(NAME, copied).certificate["checksum"], constrained.own_coordinates
    monkeypatch.setattr(constrained, "own_coordinates", lambda definition: spoiled(right(definition), 0, "1e-24"))
    with pytest.raises(NotCertified):
        build(NAME, folder=copied, t_end=4, overwrite=True)
    assert load(NAME, copied).certificate["checksum"] == before


BAD = {
    "reference-name-unknown-form": [{"name": "planar_pendulum"}],
    "unknown-name": [{"name": "plane_pendulum-rotating"}, {"name": "planar_pendulum-rotates"}],
    "spacing-not-power-of-two": [{"spacing": 10}],
    "end-not-whole-outputs": [{"t_end": t_end} for t_end in (1.3, 0.5, 1e300, float("nan"))] + [{"t_end": 0.03, "spacing": 1024}],
}


def test_bad_requests_are_refused(tmp_path):
    for code, requests in BAD.items():
        for request in requests:
            with refused(code):
                build(**{"name": NAME} | request, folder=tmp_path)
    assert not list(tmp_path.iterdir())


def test_without_heyoka_there_is_the_command_that_installs_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "heyoka", None)
    with refused("certification-needs-heyoka"):
        build(NAME, folder=tmp_path)
