"""Building a reference: the command's whole way, resumed where it was cut off, and refused where it cannot be certified."""

import json
import sys

import mpmath as mp
import numpy as np
import pytest
from refusals import refused

from daebench.methods.solvers.taylor_equations import library
from daebench.problems.planar_pendulum import closed_form
from daebench.reference.check.ida_errors import ida_errors
from daebench.reference.keep.store import load, names
from daebench.reference.make import build as building
from daebench.reference.make import constrained, independent_computations
from daebench.reference.make.build import build
from daebench.reference.make.certify import NotCertified
from daebench.reference.make.stages import Stages

NAME = "planar_pendulum-rotating"


@pytest.fixture
def rotating(references):
    return load(NAME, references)


def test_stored_digits_are_those_of_the_motion(rotating):
    with mp.workdps(60):
        for k in (1, 7, 32):
            q, p = closed_form(mp.mpf(k) / 8, [0, -1], [mp.mpf(5) / 2, 0], {"mass": 1, "length": 1, "gravity": 1})
            for part, values in (("q", q), ("p", p)):
                errors = [abs(mp.mpf(rotating.text[f"{part}{i + 1}"][k]) - x) for i, x in enumerate(values)]
                assert np.all([float(x) for x in errors] <= rotating.bound[part][k])
    assert rotating.bound["q"].max() < 1e-30


def test_the_certificate_tells_what_was_asked_of_it(rotating):
    found = rotating.certificate
    assert found["definition"]["p0"] == ["5/2", "0"]
    assert found["made"]["by"] == f"daebench reference build {NAME} --t-end 4.0 --spacing 8"
    assert found["horizon"] | {"rule": ""} == {"truth": 4.0, "double": None, "asked": 4.0, "rule": ""}
    assert set(found["drift"]) == {"g", "Gv", "energy"}
    assert all(0 < value < 1e-31 for value in found["drift"].values())
    assert found["rank"]["smallest_singular_value"] == pytest.approx(4.0)
    assert len(found["amplification"]["values"]) == 33
    assert found["versions"]["heyoka"]


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


@pytest.mark.parametrize("off", [1e-7, 1e-10], ids=str)
def test_a_truth_that_ida_knows_better_is_refused(rotating, off):
    kept = {}

    def keep(stage, make):
        if stage not in kept:
            kept[stage] = make()
        return kept[stage]

    reference = dict(rotating.values)
    ida_errors(rotating.ivp(), rotating.t, reference, keep)
    reference["q"] = reference["q"] + off * (rotating.t[:, None] > 2)
    with refused("reference-disagrees-with-ida", NotCertified, says=("ida:index2", "q")):
        ida_errors(rotating.ivp(), rotating.t, reference, keep)


def test_an_interrupted_build_goes_on_where_it_stopped(tmp_path, monkeypatch):
    done, integrated = [], independent_computations.integrated

    def counted(*arguments, **options):
        done.append("taylor")
        return integrated(*arguments, **options)

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(independent_computations, "integrated", counted)
    with monkeypatch.context() as patch:
        patch.setattr(building, "ida_errors", interrupted)
        with pytest.raises(KeyboardInterrupt):
            build(NAME, folder=tmp_path, t_end=2)
    assert names(tmp_path) == ()
    assert len(done) == 4
    monkeypatch.setattr(building, "ida_errors", lambda *_: [])
    build(NAME, folder=tmp_path, t_end=2)
    assert len(done) == 4
    assert load(NAME, tmp_path).horizon == 2
    assert [path.name for path in tmp_path.iterdir()] == [NAME]
    build(NAME, folder=tmp_path, t_end=2, overwrite=True)
    assert len(done) == 8


def test_a_stage_that_was_left_in_pieces_is_made_again(tmp_path):
    stages = Stages(tmp_path / "stages", "key", lambda stage: None)
    stages.record("one", lambda: {"x": 1})
    (tmp_path / "stages" / "one.json").write_text('{"x": ')
    assert stages.record("one", lambda: {"x": 2}) == {"x": 2}


def test_what_other_code_made_is_not_used(tmp_path, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    done, integrated = [], independent_computations.integrated
    monkeypatch.setattr(independent_computations, "integrated", lambda *a, **k: done.append(1) or integrated(*a, **k))
    monkeypatch.setattr(building, "ida_errors", interrupted)
    for code in ("one", "other"):
        monkeypatch.setattr(building, "_code", lambda problem, code=code: [code])
        with pytest.raises(KeyboardInterrupt):
            build(NAME, folder=tmp_path, t_end=2, overwrite=True)
    assert len(done) == 8


def test_a_reference_that_is_being_built_is_not_built_twice_at_once(tmp_path, monkeypatch):
    def meanwhile(*_):
        with refused("reference-being-built"):
            build(NAME, folder=tmp_path, t_end=2)
        return []

    monkeypatch.setattr(building, "ida_errors", meanwhile)
    build(NAME, folder=tmp_path, t_end=2)
    assert [path.name for path in tmp_path.iterdir()] == [NAME]


def test_stages_of_another_request_are_not_used(tmp_path, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(building, "ida_errors", interrupted)
        with pytest.raises(KeyboardInterrupt):
            build(NAME, folder=tmp_path, t_end=2)
    monkeypatch.setattr(building, "ida_errors", lambda *_: [])
    build(NAME, folder=tmp_path, t_end=4)
    assert load(NAME, tmp_path).horizon == 4


def test_a_failed_certification_leaves_the_old_reference(copied, monkeypatch):
    before = load(NAME, copied).certificate["checksum"]
    right = constrained.own_coordinates

    def wrong(definition):
        (x, rate), *rest = right(definition)
        return [(x, rate * (library().real128(1) + library().real128("1e-24"))), *rest]

    monkeypatch.setattr(constrained, "own_coordinates", wrong)
    with pytest.raises(NotCertified):
        build(NAME, folder=copied, t_end=4, overwrite=True)
    assert load(NAME, copied).certificate["checksum"] == before


BAD = {
    "no case": ({"name": "planar_pendulum"}, "reference-name-unknown-form"),
    "unknown problem": ({"name": "plane_pendulum-rotating"}, "unknown-name"),
    "unknown case": ({"name": "planar_pendulum-rotates"}, "unknown-name"),
    "spacing": ({"name": NAME, "spacing": 10}, "spacing-not-power-of-two"),
    "end": ({"name": NAME, "t_end": 1.3}, "end-not-whole-outputs"),
    "short": ({"name": NAME, "t_end": 0.03, "spacing": 1024}, "end-not-whole-outputs"),
    "too short": ({"name": NAME, "t_end": 0.5}, "end-not-whole-outputs"),
    "too long": ({"name": NAME, "t_end": 1e300}, "end-not-whole-outputs"),
    "no end": ({"name": NAME, "t_end": float("nan")}, "end-not-whole-outputs"),
}


def test_bad_requests_are_refused(tmp_path):
    for request, code in BAD.values():
        with refused(code):
            build(**request, folder=tmp_path)
        assert not list(tmp_path.iterdir())


def test_without_heyoka_there_is_the_command_that_installs_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "heyoka", None)
    with refused("certification-needs-heyoka"):
        build(NAME, folder=tmp_path)


def test_what_a_stage_left_is_what_is_read(tmp_path):
    stages = Stages(tmp_path / "stages", "key", lambda stage: None)
    with mp.workdps(70):
        rows = stages.rows("one", lambda: [[mp.mpf(1) / 3, mp.mpf("1e-40")]])
        assert abs(rows[0][0] - mp.mpf(1) / 3) < 1e-59
        assert stages.rows("one", lambda: 1 / 0) == rows
    assert json.loads((tmp_path / "stages" / "one.json").read_text())["rows"][0][1] == "1.0e-40"
