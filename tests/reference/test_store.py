"""References as files: what is read is what was written, and anything else is named; a crash costs nothing."""

import itertools
import json
from pathlib import Path

import pytest
from cache_damage import FAMILY
from refusals import refused
from rotating import NAME, UNIT
from tampered import altered

from daebench.records.seals import checksum
from daebench.reference.keep import store
from daebench.reference.keep.store import CERTIFICATE, Damaged, find, load, names


def test_what_is_read_is_what_was_written(references):
    found = load(NAME, references)
    assert names(references) == (NAME,)
    assert found.t.tolist() == [k / 8 for k in range(33)]
    assert found.q.shape == found.p.shape == found.bound["q"].shape == (33, 2)
    assert found.lam.shape == found.bound["lam"].shape == (33, 1)
    assert found.p[0].tolist() == [2.5, 0.0]
    assert list(map(float, found.text["q2"])) == found.q[:, 1].tolist()
    assert max(len(text.lstrip("-0.").replace(".", "")) for text in found.text["q1"]) == 34
    assert dict(found.ivp().parameters) == found.parameters == UNIT


def test_a_reference_is_found_by_problem_and_case(references):
    assert find("planar_pendulum", "rotating", references).name == NAME
    with refused("no-reference", says=(NAME,)):
        find("planar_pendulum", None, references)
    with refused("no-reference", says=("spherical_pendulum",)):
        find("spherical_pendulum", "fig1.2", references)
    with refused("unknown-name", says=(NAME,)):
        load("planar_pendulum-rotatin", references)


def digit(content):
    """Return what a file holds with a digit of it changed."""
    assert b"7" in content
    return content.replace(b"7", b"6", 1)


CSV = f"{NAME}.csv"
DAMAGE = {
    "a CSV that is cut short": (CSV, lambda content: content[:-100], "reference-digest-wrong"),
    "a digit of the CSV": (CSV, digit, "reference-digest-wrong"),
    "a CSV that is gone": (CSV, None, "reference-unreadable"),
    "a certificate that is cut short": (CERTIFICATE, lambda content: content[:-100], "reference-certificate-damaged"),
    "a certificate that was altered": (CERTIFICATE, digit, "reference-digest-wrong"),
    "a certificate of something else": (CERTIFICATE, lambda content: b"[1, 2]", "reference-certificate-damaged"),
}


@pytest.mark.parametrize(("file", "damage", "code"), DAMAGE.values(), ids=DAMAGE)
def test_damage_is_named(file, damage, code, copied):
    path = copied / NAME / file
    if damage is None:
        path.unlink()
    else:
        path.write_bytes(damage(path.read_bytes()))
    with refused(code, Damaged, says=(NAME,)):
        load(NAME, copied)


@pytest.mark.parametrize("file", [CERTIFICATE, CSV])
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


def again(folder):
    """Write the reference in place of itself, with another word in it."""
    altered(NAME, folder, certificate=lambda claims: claims.update(about="written again"))


def is_new(folder):
    """Tell whether the reference is the one that was written again, of a folder that has nothing else in it."""
    assert [path.name for path in folder.iterdir()] == [NAME]
    return load(NAME, folder).certificate["about"] == "written again"


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
    assert is_new(copied)


def test_a_crash_while_files_are_written_leaves_the_old_reference(copied, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(store, "written", lambda _: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            again(copied)
    assert not is_new(copied)


def test_a_reference_of_other_parameters_says_so(copied):
    altered(NAME, copied, certificate=lambda claims: claims["definition"]["parameters"].update(mass="2.0"))
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
