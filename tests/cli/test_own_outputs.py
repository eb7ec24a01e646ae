"""Every command with an output: files that it did not write are kept, and after an interruption at any moment it can be given again."""

import os
import shutil
import typing
from pathlib import Path

import pytest
import typer
from refusals import refused

from daebench.cli.app import app
from daebench.errors import DaebenchError
from daebench.pages.report import gallery
from daebench.pages.report.reports import Report
from daebench.records.store import opened
from daebench.runs import files
from daebench.runs.files import atomic, atomic_folder
from daebench.runs.outputs import described, writing
from daebench.studies.ensemble.run import ensemble

PENDULUM = "planar_pendulum --case horizontal"
RATTLE = f"{PENDULUM} --method rattle --h 0.1"
STUDIED = "--t-end 1 --repeat 0 --workers 1"

FAST = {
    "run": (f"run {RATTLE} --t-end 1 --raw", "a.csv"),
    "run --reactions": (f"run {RATTLE} --t-end 1 --reactions", "a.csv"),
    "run --steps-out": (f"run {PENDULUM} --method ida:index2 --tol 1e-4 --t-end 1", "a.csv"),
    "compare": (f"compare {RATTLE} --t-end 1", "o"),
    "compare, one picture": (f"compare {RATTLE} --t-end 1", "a.pdf"),
    "order": (f"order {PENDULUM} --method rattle --t-end 1 --halvings 2", "o"),
    "ensemble": (f"ensemble {RATTLE} --steps 3 --members 4", "o"),
    "shadow": (f"shadow {RATTLE} --t-end 1 --orders 2", "o"),
    "animate": (f"animate {PENDULUM} --methods rattle --h 0.1 --t-end 1", "a.svg"),
    "reference export": ("reference export planar_pendulum-horizontal --times 0,1", "a.csv"),
    "export": ("export STORE", "a.csv"),
    "archive": ("archive STORE", "a.zip"),
}
"""Commands with an output, and its name, which follows --out, except in the second and in export."""

SLOW = {
    "work-precision": (f"work-precision {RATTLE} {STUDIED}", "o"),
    "precision": (f"precision {PENDULUM} --methods rattle --h 0.1 {STUDIED} --ways float64,compensated", "o"),
    "stability": (f"stability {RATTLE} --t-end 1 --only round-off --workers 1", "o"),
    "long": (f"long {RATTLE} --steps 2000 --workers 1", "o"),
    "chaos": (f"chaos {RATTLE} --steps 40 --cells 2", "o"),
    "step-for": (f"step-for {RATTLE} --t-end 1 --statistic energy --margin 9 --members 64", "o"),
    "advise": (f"advise {PENDULUM} --accuracy 1e-2 --t-end 1 --methods rattle --ensemble 4", "o"),
    "modes": ("modes planar_pendulum", "o"),
    "baumgarte": (f"baumgarte {PENDULUM} --methods rk4 --h 0.1 --t-end 1", "o"),
}
"""Those that take seconds."""

ELSEWHERE = {"report", "lesson", "certify", "reference build", "generate", "import"}
"""Commands that need MuJoCo, or whose outputs are folders, of pages with a mark of their own, say: see the tests at the end, and those of
each."""

INPUTS = {"pages", "store", "tls_ca_file", "tls_cert", "tls_key", "include", "file", "folder", "certificates", "theirs"}
"""Names of arguments that are read, and of stores, which are refused where they are something else."""

KEPT = (".db", ".db-wal", ".db-shm", ".npz")
"""What commands leave beside their outputs to go on from."""


def commands(group, path=()):
    """Give all commands, as they are called, with their functions."""
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from commands(command, (*path, name))
        else:
            yield " ".join((*path, name)), command


def outputs_of(function):
    """Return the names of a command's arguments that are paths, without those that are read."""
    hints = typing.get_type_hints(function)
    return {name for name, kind in hints.items() if kind in (Path, Path | None)} - INPUTS


def test_no_command_with_an_output_is_without_a_test_and_a_way_to_overwrite():
    from daebench.cli.commands import Command

    tested = {name.split(",")[0].split(" --")[0] for name in (*FAST, *SLOW)} | ELSEWHERE
    found = dict(commands(typer.main.get_command(app)))
    assert all(type(command) is Command for command in found.values())
    named = ("export", "reference build")
    with_output = {name: command.callback for name, command in found.items() if name in named or outputs_of(command.callback)}
    assert with_output.keys() == tested
    for name, function in with_output.items():
        assert "overwrite" in typing.get_type_hints(function), name


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    """Return a store of runs."""
    path = tmp_path_factory.mktemp("store") / "studies.db"
    with opened(path) as runs:
        ensemble("planar_pendulum", case="horizontal", method="rattle", h=0.1, steps=3, members=4, store=runs)
    return path


@pytest.fixture
def call(daebench, tmp_path, monkeypatch, store):
    """Return what calls a command in a folder of its own, its pictures being words."""
    monkeypatch.setattr("daebench.draw.figures.part_labels", lambda figure: None)
    monkeypatch.setattr("daebench.draw.figures._draw", lambda figure, path: path.write_text("a picture"))

    def called(name, folder, *more):
        (tmp_path / folder).mkdir(exist_ok=True)
        monkeypatch.chdir(tmp_path / folder)
        words, out = (FAST | SLOW)[name]
        option = {"run --steps-out": "--steps-out", "export": ""}.get(name, "--out")
        return daebench(*words.replace("STORE", str(store)).split(), *option.split(), out, *more)

    return called


def written(folder):
    """Return the files below a folder but what commands go on from, by their paths there."""
    paths = [path for path in folder.rglob("*") if path.is_file() and not (path.suffix in KEPT and path.name != "a.npz")]
    return {str(path.relative_to(folder)): path.read_bytes() for path in paths}


def slowly(names, quick):
    """Return names as parameters: those that take seconds are slow, and most of them left to the day of a release."""
    slow = [pytest.mark.slow]
    marks = {name: [] if name in quick else slow if name in TYPICAL else [*slow, pytest.mark.exhaustive] for name in names}
    return [pytest.param(name, id=name, marks=marks[name]) for name in names]


QUICK = ("reference export", "export", "archive")
TYPICAL = ("ensemble", "work-precision", "compare")


@pytest.mark.parametrize("name", slowly([*FAST, *SLOW], (*QUICK, "run", "animate", "ensemble")))
def test_a_file_of_somebody_else_is_named_and_kept_whichever_it_is(call, tmp_path, name):
    status, _, error = call(name, "first")
    assert status == 0, error
    outputs = written(tmp_path / "first")
    assert outputs
    for k, file in enumerate(outputs):
        theirs = tmp_path / str(k) / file
        theirs.parent.mkdir(parents=True)
        theirs.write_text("mine")
        status, _, error = call(name, str(k))
        assert (status, len(error.splitlines())) == (2, 1), file
        assert theirs.name in error
        assert "--overwrite" in error
        assert written(tmp_path / str(k)) == {file: b"mine"}  # refused before the work
    assert call(name, "0", "--overwrite")[0] == 0
    assert written(tmp_path / "0").keys() == outputs.keys()
    assert b"mine" not in written(tmp_path / "0").values()
    assert call(name, "0")[0] == 0  # its own now


class Killed(BaseException):
    """The end of a process that nothing outlives."""


@pytest.fixture
def dying(monkeypatch):
    """Return what calls a function that is killed before the k-th file or folder gets its name; True where it came to its end."""

    def called(function, k):
        left = [k]

        def counted(original):
            def rename(self, target):
                left[0] -= 1
                if left[0] < 0:
                    raise Killed
                return original(self, target)

            return rename

        with monkeypatch.context() as patch:
            for name in ("replace", "rename"):
                patch.setattr(Path, name, counted(getattr(Path, name)))
            patch.setattr(Path, "unlink", lambda self, missing_ok=False: None)  # a process that is killed removes nothing
            patch.setattr(shutil, "rmtree", lambda *_, **__: None)
            try:
                function()
            except Killed:
                return False
        return True

    return called


@pytest.mark.parametrize("name", slowly([name for name in (*FAST, *SLOW) if name not in ("long", "advise", "baumgarte", "modes")], QUICK))
def test_a_command_that_is_killed_at_any_moment_can_be_given_again(call, dying, tmp_path, name):
    every = 1 if name in (*QUICK, "run", "animate") else 3
    for k in range(0, 99, every):
        if dying(lambda k=k: call(name, str(k)), k):
            break
        for _ in range(2):
            status, _, error = call(name, str(k))
            assert (status, error) == (0, ""), k
        names = [path.name for path in (tmp_path / str(k)).rglob("*") if not path.name.startswith(".")]
        assert {*names} == {path.name for path in _whole(call, tmp_path, name)}
    assert k > 0


def _whole(call, tmp_path, name):
    if not (tmp_path / "whole").exists():
        assert call(name, "whole")[0] == 0
    return [path for path in (tmp_path / "whole").rglob("*") if not path.name.startswith(".")]


@pytest.mark.parametrize("old", ["", "empty", "other"])
def test_a_folder_appears_whole_or_not_at_all(tmp_path, dying, old):
    def write(path):
        with atomic_folder(path) as folder:
            (folder / "a").mkdir()
            (folder / "a" / "b").write_text("new")
            (folder / "c").write_text("new")

    for k in range(9):
        path = tmp_path / str(k) / "out"
        if old:
            path.mkdir(parents=True)
        if old == "other":
            (path / "a").mkdir()
            for name in ("a/b", "a/notes", "notes"):
                (path / name).write_text("old")
        before, done = written(path), dying(lambda path=path: write(path), k)
        assert written(path) in ({}, before) or done
        write(path)
        rest = {"a/notes": b"old", "notes": b"old"} if old == "other" and (done or before == written(path)) else {}
        assert written(path).items() >= {"a/b": b"new", "c": b"new", **rest}.items()
        if done:
            break
    assert k == (2 if old else 1)


def test_a_folder_that_cannot_be_written_is_named_and_the_old_one_kept(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "a").write_text("old")

    def write_half():
        with atomic_folder(tmp_path / "out") as folder:
            (folder / "a").write_text("half")
            raise OSError(28, os.strerror(28))

    with refused("file-not-writable", DaebenchError):
        write_half()
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    assert (tmp_path / "out" / "a").read_text() == "old"


def put(folder, *, overwrite=False):
    """Have a report that writes two files put its page into a gallery."""

    def make(out, progress):
        out.mkdir(parents=True, exist_ok=True)
        for file in ("index.html", "data.csv"):
            with atomic(out / file) as scratch:
                scratch.write_text("<title>made</title>")
        return out / "index.html"

    with writing("daebench report", overwrite=overwrite):
        gallery.put(Report("pages", "about", "daebench report pages", make, list), folder)


@pytest.mark.parametrize(
    ("theirs", "code"),
    [("pages/index.html", "folder-of-other-files"), ("pages/notes.txt", "folder-of-other-files"), ("index.html", "output-file-taken")],
)
def test_pages_replace_no_folder_of_somebody_else(tmp_path, theirs, code):
    (tmp_path / theirs).parent.mkdir(exist_ok=True)
    (tmp_path / theirs).write_text("mine")
    with refused(code):
        put(tmp_path)
    assert written(tmp_path) == {theirs: b"mine"}
    put(tmp_path, overwrite=True)
    put(tmp_path)
    put(tmp_path)
    assert (tmp_path / "pages" / "index.html").read_text() == "<title>made</title>"


def test_a_page_that_is_killed_at_any_moment_can_be_made_again(tmp_path, dying):
    for k in range(99):
        if dying(lambda k=k: put(tmp_path / str(k)), k):
            break
        assert not (tmp_path / str(k) / "index.html").exists()
        put(tmp_path / str(k))
        assert (tmp_path / str(k) / "pages" / "data.csv").exists()
    assert k > 3


def test_from_python_the_caller_answers_for_the_paths(tmp_path):
    (tmp_path / "a.csv").write_text("mine")
    with described([tmp_path / "a.csv"], {"Columns": "t"}), files.atomic(tmp_path / "a.csv") as scratch:
        scratch.write_text("t\n")
    assert (tmp_path / "a.csv").read_text() == "t\n"
    assert "Made by" not in (tmp_path / "a.csv.txt").read_text()
