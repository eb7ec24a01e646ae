"""References of one's own: where they go, that none is overwritten unasked, that no name is a path, and who is told whose they are."""

import io
import json
import shutil
import sys
from pathlib import Path

import platformdirs
import pytest
from refusals import refused
from tampered import content_of

from daebench.records import seals
from daebench.reference.keep import form, store
from daebench.reference.make.build import build
from daebench.testing import reference_trajectory

NAME = "planar_pendulum-own"
SHIPPED = "planar_pendulum-rotating"
TORUS = "torus-inner"

PATHS = [
    "../x-y",
    "..",
    ".",
    "/somewhere/x-y",
    "/x-y",
    "x/../y-z",
    "x-y/",
    "./x-y",
    "C:x-y",
    "C:\\x-y",
    "\\\\host\\x-y",
    "x\\y-z",
    "..\\x-y",
    "~/x-y",
]
PATHS += ["x-y\n", "x-\0y", "-x-y", ".x-y", "x y-z", "x-y.", "", "x-" + 200 * "y", "x-y:z", "x-*", "$HOME-x", "x-é"]


@pytest.fixture
def own(references, tmp_path, monkeypatch):
    """Return a folder of references of one's own with two in it that daebench does not have."""
    folder = tmp_path / "own"
    found = store.load(SHIPPED, references)
    for name in (NAME, TORUS):
        store.save(name, content_of(found), found.text, folder)
    monkeypatch.setenv("DAEBENCH_REFERENCES", str(folder))
    return folder


def test_a_folder_of_ones_own_is_in_the_users_data(monkeypatch):
    monkeypatch.delenv("DAEBENCH_REFERENCES")
    assert form.own_folder().is_relative_to(platformdirs.user_data_path("daebench"))
    assert not form.own_folder().resolve().is_relative_to(Path(store.__file__).parents[2].resolve())
    assert form.folders()[0] == form.DATA


def test_no_name_is_a_path(references, tmp_path, monkeypatch, daebench):
    monkeypatch.chdir(tmp_path)
    calls = [
        lambda name: store.load(name, references),
        lambda name: store.kept_in(name, references),
        lambda name: build(name, folder=tmp_path / "there"),
        lambda name: store.save(name, {}, {"t": []}, tmp_path / "there"),
    ]
    for name in PATHS:
        for call in calls:
            with refused("reference-name-malformed"):
                call(name)
        if "\0" not in name and not name.startswith("-"):
            for words in (("build", name), ("show", name), ("verify", name), ("export", name), ("compare", "x.csv", "--with", name)):
                status, out, err = daebench("reference", *words)
                assert (status, out, err.count("\n")) == (2, "", 1), name
                assert len(err) < 300
        assert not list(tmp_path.iterdir()), name


def test_every_reference_of_daebench_has_a_name():
    for name in store.names(form.DATA):
        form.require_name(name)
        with refused("reference-comes-with-daebench", says=(name,)):
            build(name)


def test_a_certificate_names_no_other_file(copied):
    path = copied / SHIPPED / store.CERTIFICATE
    for file in ("../../secret.csv", "/etc/passwd", f"../{SHIPPED}/{SHIPPED}.csv", "other.csv"):
        content = json.loads(path.read_text())
        content["data"]["file"] = file
        content["checksum"] = seals.checksum(content)
        path.write_text(json.dumps(content))
        with refused("reference-digest-wrong", store.Damaged):
            store.load(SHIPPED, copied)


def test_a_reference_is_built_in_the_folder_of_ones_own(daebench, tmp_path, monkeypatch):
    place = tmp_path / "made" / "own"
    monkeypatch.setenv("DAEBENCH_REFERENCES", str(place))
    monkeypatch.setattr("daebench.reference.make.build.ida_errors", lambda *_: [])
    before = sorted(form.DATA.rglob("*"))
    assert daebench("reference", "build", TORUS, "--t-end", 2)[0] == 0
    assert sorted(form.DATA.rglob("*")) == before
    assert [path.name for path in place.iterdir()] == [TORUS]
    assert store.find("torus", "inner").horizon == 2


@pytest.mark.parametrize("folder", [None, "--folder", "--out"])
def test_nothing_is_overwritten_without_a_terminal(daebench, own, folder, monkeypatch):
    monkeypatch.setattr(sys, "stdin", io.StringIO())
    status, out, err = daebench("reference", "build", TORUS, *([] if folder is None else [folder, own]))
    assert (status, out, err.count("\n"), daebench.error.code) == (2, "", 1, "reference-already-there")
    with refused("reference-exists"):
        build(TORUS, folder=None if folder is None else own)


@pytest.mark.parametrize(("answer", "made"), [(True, (0, [True])), (False, (2, []))], ids=["yes", "no"])
def test_at_a_terminal_one_is_asked(answer, made, daebench, own, monkeypatch):
    asked, built = [], []
    monkeypatch.setattr(sys.stdin, "isatty", lambda: True, raising=False)
    monkeypatch.setattr("typer.confirm", lambda text, **more: asked.append(text) or answer)
    monkeypatch.setattr("daebench.reference.make.build.build", lambda name, **more: built.append(more["overwrite"]) or own)
    status, _, _ = daebench("reference", "build", TORUS)
    assert len(asked) == 1
    assert (status, built) == made


def test_every_command_finds_ones_own_and_says_whose_it_is(daebench, own):
    def told(*words):
        return json.loads(daebench("reference", *words, "--json")[1])

    rows = {row["name"]: row["kept_in"] for row in told("list")}
    assert {name: place for name, place in rows.items() if place != "daebench"} == dict.fromkeys((NAME, TORUS), str(own))
    assert len(rows) == len(store.names(form.DATA)) + 2
    assert (told("show", NAME)["kept_in"], told("show", SHIPPED)["kept_in"]) == (str(own), "daebench")
    assert str(own) in daebench("reference", "show", NAME)[1]
    assert told("at", "planar_pendulum", "--case", "rotating", "--t", 1)["kept_in"] == "daebench"
    assert told("verify", NAME)["references"][0]["kept_in"] == str(own)
    assert reference_trajectory(NAME).horizon == 4


def test_one_that_daebench_has_is_not_hidden_by_ones_own_and_the_list_says_so(daebench, own, references):
    shutil.copytree(references / SHIPPED, own / SHIPPED)
    assert store.kept_in(SHIPPED) == form.DATA
    assert store.load(SHIPPED).horizon > store.load(SHIPPED, own).horizon == 4
    assert store.names().count(SHIPPED) == 1
    told, of_own = (daebench("reference", "list", *folder)[1] for folder in ((), ("--folder", own)))
    assert ("not listed" in told, "not listed" in of_own) == (True, False)
