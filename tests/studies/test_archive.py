"""Archives of studies: one file that says how it was made, that is held against a new run, and that nobody can smuggle anything into."""

import hashlib
import io
import json
import shutil
import tracemalloc
import zipfile
from dataclasses import replace

import pandas as pd
import pytest
from cache_damage import FAMILY
from own_files import RING
from refusals import refused, require_refusals
from uncompiled import Uncompiled

from daebench.errors import BadInput
from daebench.methods.foreign import Trust
from daebench.records.comparison import DIFFERS, EQUAL, WITHIN
from daebench.records.rows import as_json, of_json
from daebench.records.store import opened
from daebench.studies.grid import reproduce
from daebench.studies.grid.archive import FORMAT, MANIFEST, ROWS, write_archive
from daebench.studies.grid.reproduce import compared, read
from daebench.studies.grid.run_specification import ivp_of
from daebench.studies.grid.study import Study

TRUSTED = Trust(everything=True)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Make a folder with a study of a problem of daebench's and of one of one's own, and its archive."""
    folder = tmp_path_factory.mktemp("made")
    (folder / "ring.py").write_text(RING)
    ivp_of.cache_clear()  # another test may have read another file by this name
    with pytest.MonkeyPatch.context() as patch, opened(folder / "s.db") as store:
        patch.chdir(folder)
        patch.setattr("daebench.methods.names.FixedStep", Uncompiled)
        pendulum = {"problem": "planar_pendulum", "cases": ["rotating"], "metrics": ("q", "energy")}
        Study(**pendulum, methods=["rattle", "scipy:DOP853"], values={"h": [1 / 8, 1 / 16], "tol": [1e-6]}, t_end=2.0).table(store)
        Study(problem="./ring.py", methods=["rattle"], values={"h": [1 / 8]}, t_end=2.0, repeat=1).table(store)
        write_archive(store, folder / "s.zip")
    return folder


@pytest.fixture
def archived(made, tmp_path, monkeypatch, uncompiled_schemes):
    """Return a copy of that folder, to work in."""
    shutil.copytree(made, tmp_path / "here")
    monkeypatch.chdir(tmp_path / "here")
    ivp_of.cache_clear()
    return tmp_path / "here"


def parts(path):
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def pack(path, files, more=None, **settings):
    """Write an archive of these files, with a manifest that is right for them but for what is given."""
    digests = {name: hashlib.sha256(content).hexdigest() for name, content in files.items() if name != MANIFEST}
    manifest = json.loads(files[MANIFEST]) | {"files": digests} | (more or {})
    with zipfile.ZipFile(path, "w", **settings) as archive:
        for name, content in {**files, MANIFEST: json.dumps(manifest).encode()}.items():
            archive.writestr(name, content)


def reproduced(daebench, change):
    """Reproduce the archive with its rows changed; return exit status and output."""
    files = parts("s.zip")
    rows = [change(of_json(line)) for line in files[ROWS].decode().splitlines()]
    pack("changed.zip", files | {ROWS: "\n".join(map(as_json, rows)).encode()})
    status, out, err = daebench("reproduce", "changed.zip", "--trust")
    assert err == ""
    return status, out


def test_one_file_has_data_definitions_pictures_certificate_and_how_it_was_made(archived):
    files = parts(archived / "s.zip")
    assert files["definitions/2-ring/ring.py"].decode() == RING
    assert {"definitions/1-planar_pendulum/planar_pendulum.py", "rows.csv", "pictures/ring-turning.svg"} <= set(files)
    certificate = json.loads(files["references/planar_pendulum-rotating/certificate.json"])
    digits = files["references/planar_pendulum-rotating/planar_pendulum-rotating.csv"]
    assert certificate["data"]["sha256"] == hashlib.sha256(digits).hexdigest()
    words = files["README.txt"].decode()
    for said in ("was made by daebench 0.1.0 on 20", "numpy ", "Machine: ", "daebench reproduce s.zip", "rattle", "(case rotating)"):
        assert said in words
    assert str(archived) not in "".join(each.decode(errors="replace") for each in files.values())
    assert len(pd.read_csv(io.BytesIO(files["rows.csv"]))) == 4
    assert len(files[ROWS].splitlines()) == 4


def test_it_is_reproduced_to_the_bit_in_another_folder(archived, daebench, monkeypatch):
    (archived / "elsewhere").mkdir()
    (archived / "s.zip").rename(archived / "elsewhere" / "s.zip")
    (archived / "ring.py").unlink()
    monkeypatch.chdir(archived / "elsewhere")
    status, out, err = daebench("reproduce", "s.zip", "--trust", "--json")
    assert (status, err, [row["verdict"] for row in json.loads(out)["rows"]]) == (0, "", [EQUAL] * 4)


def test_a_number_that_is_not_reproduced_is_named_and_ends_with_1(archived, daebench):
    for factor, status, word in ((1 + 1e-9, 0, "within tolerances: 1 runs"), (1.5, 1, "differs: rattle on")):

        def change(each, factor=factor):
            wrong = each.row["problem"] == "planar_pendulum" and each.row["value"] == 1 / 8
            return replace(each, row={**each.row, "error_q": each.row["error_q"] * factor}) if wrong else each

        found, out = reproduced(daebench, change)
        assert found == status
        assert all(said in out for said in ("equal to the bit: 3 of 4 runs.", word, "error_q = "))


ROW = {"failure": "", "one": 1, "n_rhs": 100, "steps": 10, "a": 1.0, "tiny": 1e-16, "word": "x", "none": float("nan"), "seconds": 1.0}
PAIRS = {
    "the same": ({}, EQUAL, ""),
    "time": ({"seconds": 2.0}, EQUAL, ""),
    "round-off": ({"tiny": 5e-16}, WITHIN, "tiny"),
    "counts": ({"n_rhs": 101}, WITHIN, "n_rhs"),
    "counts that are far away": ({"n_rhs": 201}, DIFFERS, "n_rhs"),
    "the last digits": ({"a": 1.0 + 1e-9}, WITHIN, "a"),
    "the worst decides": ({"a": 1.1, "tiny": 5e-16, "n_rhs": 101}, DIFFERS, "a"),
    "a number": ({"a": 1.1}, DIFFERS, "a"),
    "no number": ({"a": float("nan")}, DIFFERS, "a"),
    "a number where there was none": ({"none": 1.0}, DIFFERS, "none"),
    "nothing where there was none": ({"none": 0.0}, DIFFERS, "none"),
    "infinite": ({"a": float("inf")}, DIFFERS, "a"),
    "a word": ({"word": "y"}, DIFFERS, "word"),
    "a failure": ({"failure": "stopped"}, DIFFERS, "failure"),
    "true in place of 1": ({"one": True}, DIFFERS, "one"),
    "a column less": ({"a": None}, DIFFERS, "a"),
}


@pytest.mark.parametrize(("change", "verdict", "column"), PAIRS.values(), ids=PAIRS)
def test_two_rows_are_equal_within_or_differ(change, verdict, column):
    for old, new in ((ROW, ROW | change), (ROW | change, ROW)):
        found = compared(old, new, rtol=1e-6, atol=1e-12)
        assert (found.verdict, found.column) == (verdict, column)
        assert not found.difference < 0


@pytest.mark.parametrize("knob", ["h", "tol"], ids=["of a given size", "of their own size"])
def test_another_number_of_steps_differs_where_their_size_is_given(knob):
    verdict = compared(ROW | {"knob": knob}, ROW | {"knob": knob, "steps": 11}, rtol=1e-6, atol=1e-12).verdict
    assert verdict == {"h": DIFFERS, "tol": WITHIN}[knob]


WORDS = "./ring.py, line 3: it stopped at t = 1.25 s"


def test_a_failure_for_another_reason_differs():
    for other, verdict in (
        ("elsewhere/definitions/1-ring/ring.py, line 3: it stopped at t = 1.5 s", WITHIN),
        ("x", DIFFERS),
        (WORDS + " again", DIFFERS),
    ):
        assert compared(ROW | {"failure": WORDS}, ROW | {"failure": other}, rtol=1e-6, atol=1e-12).verdict == verdict


def test_a_row_that_lacks_a_column_differs_unless_another_version_made_it(archived, daebench):
    less = {name: value for name, value in ROW.items() if name != "a"}
    assert compared(less, ROW, rtol=0.0, atol=0.0).column == "a"
    old = compared(less, ROW, rtol=0.0, atol=0.0, complete=False)
    assert (old.verdict, old.absent) == (EQUAL, ("a",))
    for maker, status in (({}, 1), ({"maker": "0" * 64}, 0)):

        def change(each, maker=maker):
            return replace(each, row={name: value for name, value in each.row.items() if name != "energy_law"}, **maker)

        found, out = reproduced(daebench, change)
        assert (found, "energy_law" in out) == (status, True)


def test_a_row_under_the_key_of_another_run_differs(archived, daebench):
    def change(each):  # of no number
        return replace(each, specification={**each.specification, "calls": 10**6})

    status, out = reproduced(daebench, change)
    assert (status, out.count(": key = ")) == (1, 3)  # that of the file that was elsewhere may be another


def test_a_study_whose_problem_file_has_changed_says_so(archived, daebench):
    (archived / "ring.py").write_text(RING.replace("(3 * m, 0)", "(4 * m, 0)"))
    ivp_of.cache_clear()
    assert "3 runs, without 1 of" in daebench("archive", "s.db", "--out", "less.zip", "--trust")[1]
    (archived / "ring.py").unlink()
    ivp_of.cache_clear()
    require_refusals(daebench, ["archive"], ("no-such-file-or-name", "s.db --out none.zip --trust"))
    assert not (archived / "none.zip").exists()


def test_bad_input_is_one_sentence_and_makes_no_file(archived, daebench):
    (archived / "text.db").write_text("no database at all, but long enough to be taken for one" * 20)
    with opened(archived / "empty.db"):
        pass
    before = sorted(archived.iterdir())
    require_refusals(
        daebench,
        (),
        ("no-such-store", "archive missing.db"),
        ("not-a-store", "archive text.db"),
        ("store-not-archived", "archive empty.db"),
        ("zip-file-ending", "archive s.db --out x.tar"),
        ("no-such-parent-folder", "archive s.db --out nowhere/x.zip"),
        ("no-such-archive", "reproduce missing.zip"),
        ("archive-damaged", "reproduce s.db"),
        ("file-not-allowed", "archive s.db --out t.zip"),
        ("code-not-trusted", "reproduce s.zip"),
        ("no-such-file-or-name", "reproduce s.zip --code nowhere.py"),
        ("code-not-trusted", "reproduce s.zip --code empty.db"),
        ("negative-tolerance-option", "reproduce s.zip --rtol -1"),
        ("not-finite", "reproduce s.zip --atol nan"),
    )
    assert sorted(archived.iterdir()) == before


def test_no_damage_of_an_archive_goes_unseen(archived):
    whole, right = (archived / "s.zip").read_bytes(), read(archived / "s.zip", TRUSTED)
    for what, damage in FAMILY.items():
        (archived / "damaged.zip").write_bytes(damage(whole))
        try:
            found = read(archived / "damaged.zip", TRUSTED)
        except BadInput:
            continue
        assert [*map(as_json, found.rows)] == [*map(as_json, right.rows)], what
        assert found.files == right.files, what


SMUGGLED = {
    "a name that leads out": ("archive-path-leads-out", {"../evil.py": b""}, {}),
    "an absolute name": ("archive-path-leads-out", {"/evil.py": b""}, {}),
    "a name of Windows": ("archive-path-leads-out", {"definitions\\..\\..\\evil.py": b""}, {}),
    "a file that is not in the manifest": ("archive-damaged", {"definitions/1-ring/evil.py": b"1"}, {"files": {}}),
    "a newer format": ("archive-of-other-version", {}, {"format": FORMAT + 1}),
    "no format": ("archive-of-other-version", {}, {"format": "x" * 500}),
    "a file of this machine": ("code-lacks-runs", {}, {"own": []}),
    "rows that are none": ("archive-damaged", {ROWS: b'{"key": 1}\n'}, {}),
    "rows that are nested": ("archive-damaged", {ROWS: b"[" * 100_000}, {}),
}


@pytest.mark.parametrize(("code", "more", "manifest"), SMUGGLED.values(), ids=SMUGGLED)
def test_what_was_put_into_an_archive_is_refused_before_anything_is_run(archived, code, more, manifest, monkeypatch):
    monkeypatch.setattr(reproduce, "row_of", lambda specification: pytest.fail("run"))
    pack("evil.zip", parts("s.zip") | more, manifest)
    with refused(code) as said:
        read(archived / "evil.zip")
    assert len(str(said.value)) < 400


BOMBS = {
    "zeros": (bytes(100 * 2**20), "zip-too-large"),
    "lists": (b'{"key": [' + b"[]," * (9 * 2**20) + b"[]]}", "archive-damaged"),
    "columns": (b'{"row": {"a": [' + b"0," * (9 * 2**20) + b"0]}}", "archive-damaged"),
}


@pytest.mark.parametrize(("content", "code"), BOMBS.values(), ids=BOMBS)
def test_an_archive_that_is_huge_when_unpacked_takes_no_memory(archived, content, code):
    pack("bomb.zip", parts("s.zip") | {ROWS: content}, compression=zipfile.ZIP_DEFLATED, compresslevel=1)
    tracemalloc.start()
    with refused(code):
        read(archived / "bomb.zip")
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 250e6
