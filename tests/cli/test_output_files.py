"""Files that are written where others may write too: no name can be foreseen, and no link of theirs is followed."""

import io
import os
import sys
import time

import pytest

from daebench.cli import console
from daebench.cli.console import bar, print_table, printable
from daebench.cli.endings import complain
from daebench.compiler.under_way import compiling, under_way
from daebench.errors import BadInput
from daebench.runs.files import atomic, check_place

HOSTILE = """{}

import sympy as sp

from daebench import Case, ConstrainedHamiltonian


def problem() -> ConstrainedHamiltonian:
    q, p = sp.symbols("q1:3", real=True), sp.symbols("p1:3", real=True)
    cases = {{"on": Case(q=(0, -1), p=(1, 0))}}
    return ConstrainedHamiltonian(q=q, p=p, M=sp.eye(2), U=sp.S.Zero, g=[q[0] ** 2 + q[1] ** 2 - 1], cases=cases)
"""
"""A problem file whose first line is what is shown of it."""

pytestmark = pytest.mark.skipif(not hasattr(os, "geteuid"), reason="links have no owners here")


@pytest.fixture
def precious(tmp_path):
    """Return a file that links lead to, and that must stay as it is."""
    path = tmp_path / "precious"
    path.write_text("precious")
    yield path
    assert path.read_text() == "precious"


@pytest.mark.parametrize("name", ["run.csv", "page.html", "film.mp4", "store.db", ".hidden", "a" * 200 + ".csv"])
def test_no_name_of_a_temporary_file_can_be_foreseen(name, precious, tmp_path):
    folder = tmp_path / "shared"
    folder.mkdir()
    path, seen = folder / name, set()
    for k in range(200):  # the names that were: process and a number
        if len(taken := f".{path.stem}-{os.getpid()}-{k}{path.suffix}") < 255:
            (folder / taken).symlink_to(precious)
    for _ in range(20):
        with atomic(path) as scratch:
            assert scratch.parent == folder
            assert scratch.name.endswith(path.suffix)
            assert not scratch.is_symlink()
            seen.add(scratch.name)
            scratch.write_text("written")
    assert len(seen) == 20
    assert path.read_text() == "written"


@pytest.mark.parametrize("exists", [True, False])
def test_a_link_that_another_has_made_is_not_followed_and_ones_own_is(exists, precious, tmp_path, monkeypatch):
    target, path = (precious if exists else tmp_path / "not-there"), tmp_path / "run.csv"
    path.symlink_to(target)
    me = os.geteuid()
    monkeypatch.setattr(os, "geteuid", lambda: me + 1)
    if me == 0:
        os.lchown(path, 12345, 12345)
    for attempt in (lambda: check_place(path), lambda: atomic(path).__enter__()):
        with pytest.raises(BadInput, match="a link of another user"):
            attempt()
    monkeypatch.setattr(os, "geteuid", lambda: 12345 if me == 0 else me)
    own = tmp_path / "own"
    own.write_text("old")
    path.unlink()
    path.symlink_to(own)
    with atomic(path) as scratch:
        scratch.write_text("new")
    assert own.read_text() == "new"
    assert path.is_symlink()


@pytest.mark.sampled(by=lambda case: case.startswith(("[/red", "[link", "[bold")))
@pytest.mark.parametrize("text", ["[/red]", "[red]x[/blue]", "[bold]", "[link=file:///etc]x", "case [/]", "[", "\\["])
def test_a_name_is_text_in_titles_and_in_bars(text, capsys, monkeypatch):
    print_table([40 * "a"], [["b"]], text)
    assert text in capsys.readouterr().out
    terminal = io.StringIO()
    monkeypatch.setattr(terminal, "isatty", lambda: True, raising=False)
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setattr(console, "PATIENCE", 0.0)
    monkeypatch.setenv("TERM", "xterm")
    with bar("begun") as progress:
        progress(0.5, text)
        until = time.monotonic() + 20
        while "50%" not in terminal.getvalue() and time.monotonic() < until:
            time.sleep(0.01)
    assert f"{text} " in terminal.getvalue()
    assert "50%" in terminal.getvalue()


STEERING = ["\x1b[2J", "\x1b]0;title\x07", "\x9b2J", "\x08\x08", "\r", "\x7f", "\u202ecba", "\u2066", "\u2028", "\x00"]


@pytest.mark.sampled(by=lambda case: any(sign in case for sign in ("x1b[2J", "x9b2J", "u202e")))
@pytest.mark.parametrize("text", STEERING, ids=ascii)
def test_what_is_printed_steers_no_terminal(text, capsys, daebench, tmp_path):
    print_table([f"a{text}b"], [[f"c{text}d"]], f"e{text}f{40 * 'x'}")
    complain(f"g{text}h")
    printed = capsys.readouterr()
    assert all(line.isprintable() for line in (printed.out + printed.err).split("\n"))
    (tmp_path / "hostile.py").write_text(HOSTILE.format(ascii(f"A bead {text}.")), encoding="utf-8")
    status, out, _ = daebench("show", tmp_path / "hostile.py")
    assert status == 0
    assert all(line.isprintable() for line in out.split("\n"))
    assert "A bead" in out


@pytest.mark.parametrize("text", ["a sum \u03a3 \u2202q", "\u00e9t\u00e9", "two\nlines", "back\\slash", "\u2212"], ids=ascii)
def test_letters_of_any_language_are_printed_as_they_are(text):
    assert printable(text) == text


def test_progress_names_what_is_compiled():
    with bar("rattle on planar_pendulum") as progress:
        assert progress._work == "rattle on planar_pendulum"
        with compiling("rattle for ./arm.py"), compiling("Functions of ./arm.py"):
            assert progress._work == "compiling rattle for ./arm.py"
    assert under_way() == ""
