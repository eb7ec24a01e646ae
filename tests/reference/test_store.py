"""References as files: what is read is what was written, and anything else is named; a crash costs nothing."""

import itertools
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from cache_damage import FAMILY
from refusals import refused

from daebench.records.seals import checksum
from daebench.reference.keep import store
from daebench.reference.keep.store import CERTIFICATE, Damaged, find, load, names, save

NAME = "planar_pendulum-rotating"


def test_what_is_read_is_what_was_written(references):
    found = load(NAME, references)
    assert names(references) == (NAME,)
    assert found.t.tolist() == [k / 8 for k in range(33)]
    assert found.q.shape == found.p.shape == found.bound["q"].shape == (33, 2)
    assert found.lam.shape == found.bound["lam"].shape == (33, 1)
    assert found.p[0].tolist() == [2.5, 0.0]
    assert all(float(text) == value for text, value in zip(found.text["q2"], found.q[:, 1], strict=True))
    assert max(len(text.lstrip("-0.").replace(".", "")) for text in found.text["q1"]) == 34
    assert found.parameters == {"mass": 1.0, "length": 1.0, "gravity": 1.0}
    assert dict(found.ivp().parameters) == found.parameters
    assert found.double_horizon == np.inf


def test_a_reference_is_found_by_problem_and_case(references):
    assert find("planar_pendulum", "rotating", references).name == NAME
    with refused("no-reference", says=(NAME,)):
        find("planar_pendulum", None, references)
    with refused("no-reference", says=("spherical_pendulum",)):
        find("spherical_pendulum", "fig1.2", references)
    with refused("unknown-name", says=(NAME,)):
        load("planar_pendulum-rotatin", references)


def data(folder):
    return folder / NAME / f"{NAME}.csv"


def cut(path):
    path.write_bytes(path.read_bytes()[:-100])


def digit(path):
    text = path.read_text()
    assert "7" in text
    path.write_text(text.replace("7", "6", 1))


DAMAGE = {
    "a CSV that is cut short": (lambda folder: cut(data(folder)), "reference-digest-wrong"),
    "a digit of the CSV": (lambda folder: digit(data(folder)), "reference-digest-wrong"),
    "a CSV that is gone": (lambda folder: data(folder).unlink(), "reference-unreadable"),
    "a certificate that is cut short": (lambda folder: cut(folder / NAME / CERTIFICATE), "reference-certificate-damaged"),
    "a certificate that was altered": (lambda folder: digit(folder / NAME / CERTIFICATE), "reference-digest-wrong"),
}


@pytest.mark.parametrize(("damage", "code"), DAMAGE.values(), ids=DAMAGE)
def test_damage_is_named(damage, code, copied):
    damage(copied)
    with refused(code, Damaged, says=(NAME,)):
        load(NAME, copied)


@pytest.mark.parametrize("file", [CERTIFICATE, f"{NAME}.csv"])
def test_no_damage_of_a_reference_goes_unseen(copied, file):
    whole, right = (copied / NAME / file).read_bytes(), load(NAME, copied)
    for what, damage in FAMILY.items():
        (copied / NAME / file).write_bytes(damage(whole))
        try:
            found = load(NAME, copied)
        except Damaged:
            continue
        assert (found.text, dict(found.certificate)) == (right.text, dict(right.certificate)), what


def test_another_layout_is_refused(copied):
    path = copied / NAME / CERTIFICATE
    certificate = json.loads(path.read_text()) | {"format": 2}
    path.write_text(json.dumps(certificate | {"checksum": checksum(certificate)}))
    with refused("reference-of-other-layout", Damaged, says=("2", "1")):
        load(NAME, copied)


def test_a_certificate_of_something_else_is_refused(copied):
    (copied / NAME / CERTIFICATE).write_text("[1, 2]")
    with refused("reference-certificate-damaged", Damaged):
        load(NAME, copied)


def again(folder):
    """Write the reference in place of itself, with another word in it."""
    found = load(NAME, folder)
    content = {key: value for key, value in found.certificate.items() if key not in ("format", "name", "data", "checksum")}
    save(NAME, content | {"about": "written again"}, found.text, folder)


def test_a_reference_takes_the_place_of_the_old_one_and_leaves_nothing_else(copied):
    again(copied)
    assert load(NAME, copied).certificate["about"] == "written again"
    assert [path.name for path in copied.iterdir()] == [NAME]


@pytest.mark.parametrize("which", [1, 2], ids=["old one moved", "new one moved"])
def test_a_crash_while_places_are_changed_leaves_the_old_reference(which, copied, monkeypatch):
    rename, calls = Path.rename, []

    def crash(self, target):
        calls.append(target)
        if len(calls) == which:
            raise KeyboardInterrupt
        return rename(self, target)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "rename", crash)
        with pytest.raises(KeyboardInterrupt):
            again(copied)
    assert names(copied) == (NAME,)
    assert load(NAME, copied).certificate["about"] != "written again"
    again(copied)
    assert load(NAME, copied).certificate["about"] == "written again"
    assert [path.name for path in copied.iterdir()] == [NAME]


def test_a_crash_while_files_are_written_leaves_the_old_reference(copied, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(store, "written", lambda _: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            again(copied)
    assert [path.name for path in copied.iterdir()] == [NAME]
    assert load(NAME, copied).certificate["about"] != "written again"


def test_a_reference_of_other_parameters_says_so(copied):
    found = load(NAME, copied)
    content = json.loads(json.dumps(dict(found.certificate)))
    content["definition"]["parameters"]["mass"] = "2.0"
    kept = {key: value for key, value in content.items() if key not in ("format", "name", "data", "checksum")}
    shutil.rmtree(copied / NAME)
    save(NAME, kept, found.text, copied)
    with refused("reference-of-other-parameters", says=("2.0",)):
        load(NAME, copied).ivp()


STEERING = ("\x1b[2J", "\x1b]0;title\x07", "\x9b2J", "\x08\x08", "\x0c", "\u202eabc", "\u2066", "\x7f", "\x00")


def test_nothing_of_a_reference_steers_a_terminal(copied):
    path = copied / NAME / CERTIFICATE
    whole = path.read_text()
    for text, ascii_alone in itertools.product(STEERING, (True, False)):
        certificate = json.loads(whole)
        certificate["about"] += text
        certificate["checksum"] = checksum(certificate)
        path.write_text(json.dumps(certificate, ensure_ascii=ascii_alone), encoding="utf-8")
        with refused("reference-unprintable", Damaged) as error:
            load(NAME, copied)
        assert str(error.value).isprintable(), (text, ascii_alone)
