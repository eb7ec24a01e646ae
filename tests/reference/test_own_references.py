"""References of one's own: where they go, that none is overwritten unasked, that no name is a path, and who is told whose they are."""

import io
import json
import shutil
import sys
from pathlib import Path

import platformdirs
import pytest
from refusals import refused

from daebench.records import seals
from daebench.reference.keep import form, store
from daebench.reference.make.build import build
from daebench.testing import reference_trajectory

NAME = "planar_pendulum-own"
SHIPPED = "planar_pendulum-rotating"

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
    """Return a folder of references of one's own with one in it that daebench does not have."""
    folder = tmp_path / "own"
    found = store.load(SHIPPED, references)
    store.save(NAME, _content(found), found.text, folder)
    monkeypatch.setenv("DAEBENCH_REFERENCES", str(folder))
    return folder


def _content(found):
    return {key: value for key, value in found.certificate.items() if key not in ("format", "name", "data", "checksum")}


def test_a_folder_of_ones_own_is_in_the_users_data(monkeypatch):
    monkeypatch.delenv("DAEBENCH_REFERENCES")
    package = Path(store.__file__).parents[2].resolve()
    assert form.own_folder().is_relative_to(platformdirs.user_data_path("daebench"))
    assert not form.own_folder().resolve().is_relative_to(package)
    assert form.folders()[0] == form.DATA


def test_no_name_is_a_path(references, tmp_path, monkeypatch, daebench):
    monkeypatch.chdir(tmp_path)
    for name in PATHS:
        for call in (store.load, store.kept_in):
            with refused("reference-name-malformed"):
                call(name, references)
        with refused("reference-name-malformed"):
            build(name, folder=tmp_path / "there")
        with refused("reference-name-malformed"):
            store.save(name, {}, {"t": []}, tmp_path / "there")
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
    monkeypatch.setenv("DAEBENCH_REFERENCES", str(tmp_path / "made" / "own"))
    monkeypatch.setattr("daebench.reference.make.build.ida_errors", lambda *_: [])
    before = sorted(form.DATA.rglob("*"))
    name = "torus-inner"
    status, out, _ = daebench("reference", "build", name, "--t-end", 2)
    assert (status, out) == (0, f"written: {tmp_path / 'made' / 'own' / name}\n")
    assert sorted(form.DATA.rglob("*")) == before
    assert [path.name for path in (tmp_path / "made" / "own").iterdir()] == [name]
    assert store.find("torus", "inner").horizon == 2


@pytest.mark.parametrize("folder", [None, "--folder", "--out"])
def test_nothing_is_overwritten_without_a_terminal(daebench, own, folder, monkeypatch):
    name, words = "torus-inner", [] if folder is None else [folder, own]
    found = store.load(NAME)
    store.save(name, _content(found), found.text, own)
    monkeypatch.setattr(sys, "stdin", io.StringIO())
    status, out, err = daebench("reference", "build", name, *words)
    assert (status, out) == (2, "")
    assert err == f"daebench: {name} is already in {own}; add --overwrite to replace it.\n"
    with refused("reference-exists"):
        build(name, folder=None if folder is None else own)
    assert store.load(name).certificate == store.load(name, own).certificate


@pytest.mark.parametrize(("answer", "made"), [("y", True), ("n", False), ("", False)], ids=["yes", "no", "nothing"])
def test_at_a_terminal_one_is_asked(answer, made, daebench, own, monkeypatch):
    asked, built = [], []
    found = store.load(NAME)
    store.save("torus-inner", _content(found), found.text, own)
    monkeypatch.setattr(sys.stdin, "isatty", lambda: True, raising=False)
    monkeypatch.setattr("typer.confirm", lambda text, **more: asked.append(text) or answer == "y")
    monkeypatch.setattr("daebench.reference.make.build.build", lambda name, **more: built.append(more["overwrite"]) or own)
    status, _, err = daebench("reference", "build", "torus-inner")
    assert asked == [f"torus-inner is already in {own}. Replace it?"]
    assert (status, built) == ((0, [True]) if made else (2, []))
    assert ("was not changed" in err) != made


def test_every_command_finds_ones_own_and_says_whose_it_is(daebench, own):
    rows = {row["name"]: row["kept_in"] for row in json.loads(daebench("reference", "list", "--json")[1])}
    assert rows[NAME] == str(own)
    assert {place for name, place in rows.items() if name != NAME} == {"daebench"}
    assert len(rows) == len(store.names(form.DATA)) + 1
    assert json.loads(daebench("reference", "show", NAME, "--json")[1])["kept_in"] == str(own)
    assert json.loads(daebench("reference", "show", SHIPPED, "--json")[1])["kept_in"] == "daebench"
    assert str(own) in daebench("reference", "show", NAME)[1]
    found = json.loads(daebench("reference", "at", "planar_pendulum", "--case", "rotating", "--t", 1, "--json")[1])
    assert found["kept_in"] == "daebench"
    (verified,) = json.loads(daebench("reference", "verify", NAME, "--json")[1])["references"]
    assert verified["kept_in"] == str(own)
    assert reference_trajectory(NAME).horizon == 4


def test_one_that_daebench_has_is_not_hidden_by_ones_own_and_the_list_says_so(daebench, own, references):
    shutil.copytree(references / SHIPPED, own / SHIPPED)
    assert store.kept_in(SHIPPED) == form.DATA
    assert store.load(SHIPPED).horizon > store.load(SHIPPED, own).horizon == 4
    assert store.names().count(SHIPPED) == 1
    assert f"{SHIPPED} of {own} is not listed, because daebench has one of this name" in daebench("reference", "list")[1]
    assert "is not listed" not in daebench("reference", "list", "--folder", own)[1]
