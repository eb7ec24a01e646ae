"""One integrator in five languages: the files of the page compile by its commands, and take the steps of the one in Python."""

import re
import shutil

import numpy as np
import pytest
import said

import daebench

PAGE = (said.DOCS / "how-to" / "own-integrator.md").read_text(encoding="utf-8")
COMPILED = {"c": ("mine.c", "cc"), "cpp": ("mine.cpp", "c++"), "fortran": ("mine.f90", "gfortran")}


def needs(tool):
    if shutil.which(tool) is None:
        pytest.skip(f"{tool} is not installed")


@pytest.fixture
def folder(tmp_path, monkeypatch, uncompiled_schemes):
    """A reader's folder with the bead and the integrator in Python."""
    for name in ("bead.py", "mine.py"):
        (tmp_path / name).write_text(said.block(name), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def compiled(folder, language):
    """Compile a file of the page by the command below it."""
    file, tool = COMPILED[language]
    needs(tool)
    (folder / file).write_text(said.block(file, language), encoding="utf-8")
    (command,) = re.findall(rf"^{re.escape(tool)} .* {re.escape(file)}$", PAGE, re.MULTILINE)
    done = said.call(command, folder)
    assert (done.returncode, done.stderr) == (0, "")


def end(method):
    return daebench.run("./bead.py", method=method, h=0.01, t_end=1, every=50).complete()


@pytest.mark.parametrize("language", COMPILED)
def test_a_library_takes_the_steps_of_the_one_in_python(folder, language):
    compiled(folder, language)
    ours, theirs = end("./libmine.so:step"), end("./mine.py:step")
    assert np.abs(ours.q - theirs.q).max() < 1e-13
    assert np.abs(ours.p - theirs.p).max() < 1e-12


def test_the_program_in_julia_takes_the_steps_of_the_one_in_python(folder):
    needs("julia")
    program = folder / "mine.jl"
    program.write_text(said.block("mine.jl", "julia"), encoding="utf-8")
    program.chmod(0o755)
    assert np.abs(end("exec:./mine.jl").q - end("./mine.py:step").q).max() < 1e-12


def test_the_question_is_the_one_that_the_page_shows(folder):
    program = folder / "program"
    program.write_text("#!/bin/sh\nhead -n 1 > asked.json\n", encoding="utf-8")
    program.chmod(0o755)
    daebench.run("./bead.py", method="exec:./program", h=0.01, steps=3)
    assert (folder / "asked.json").read_text() == re.search(r"^```json\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)[1]


LINES = [line for line in said.commands() if line.startswith("daebench ") and "./libmine.so:step" in line]


@pytest.mark.slow
@pytest.mark.sampled(by=lambda case: case.startswith("diagnose"))
@pytest.mark.parametrize("line", LINES, ids=lambda line: line.split()[1])
def test_a_command_of_the_page_says_what_it_shows(folder, line):
    compiled(folder, "c")
    done = said.call(line, folder)
    assert done.returncode == (1 if "diagnose" in line else 0), done.stderr
    assert (said.printed_by(line) or "") in done.stdout
