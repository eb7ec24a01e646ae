"""Commands and programs of README and documentation run from what a reader has: their files, and what earlier commands have written."""

import ast
import importlib
import inspect
import re
import runpy
import shlex
import subprocess
import sys

import pytest
import said
import typer

import daebench as package
from daebench.cli.app import app

ELSEWHERE = {
    "daebench report all": "tests of the gallery and of each report",
    "daebench report index-reduction": "the main job of the gate",
    "daebench lesson": "tests of lessons in a browser",
    "daebench open": "tests of that command",
    "python -m sphinx": "tests of the site",
    **dict.fromkeys(("make -C ", "cc -std=c99", "./wheel", "python lecture/", "daebench certify suspension "), "tests of generated code"),
    **dict.fromkeys(("cc -O2", "c++ -O2", "gfortran -O2"), "tests of the page in five languages"),
}
"""Beginnings of commands that are not run here, and where they are; the two below markers are the gate's."""

QUICK = (
    "daebench list",
    "daebench show",
    "daebench reference list",
    "daebench reference show",
    "daebench reference at",
)
"""Beginnings of commands that compile nothing."""

STUDIES = ("daebench work-precision", "daebench precision", "daebench stability", "daebench long")
"""Beginnings of commands that have grids: the gate asks what they would run."""

STOPS = (
    "daebench run spherical_pendulum --case fig1.2 --method se ",
    "daebench run ./excavator.py --method ida:index3:none ",
    "daebench run rigid_water --case tumbling --method rattle_gauss_seidel --h 0.3 ",
    "daebench diagnose ./faulty.py:step ",
    "daebench check ./co2.py",
)
"""Beginnings of the commands that end with 1: a run that stops, a fault that is found."""

TYPICAL = (
    "daebench run planar_pendulum --case rotating --method rk4 ",
    "daebench run spherical_pendulum --case fig1.2 --method se ",
    "daebench check ./bead.py",
    "daebench check ./co2",
    "daebench compare ./bead.py",
    "daebench order lotka_volterra ",
    "daebench animate spherical_pendulum --case fig1.1 --methods se,rattle --h 0.03 --t-end 20 ",
    "daebench shadow spherical_pendulum --case fig1.1 --method ",
    "daebench diagnose ./faulty.py:step ",
    "daebench import ",
    "daebench generate spherical_pendulum ",
    "daebench reference export",
    "daebench reference compare",
)
"""Beginnings of commands of different kinds that compile little: of others, the gate reads the words."""

COMPILED = "./libmine.so:step"
"""A library that a compiler makes: commands with it are in the tests of the page in five languages."""

HERE = [command for command in said.commands() if not command.startswith(tuple(ELSEWHERE)) and COMPILED not in command]


def marked(command):
    """Return a command as a parameter, with the mark that its cost asks for."""
    mark = pytest.mark.slow if command.startswith(TYPICAL) else pytest.mark.exhaustive
    return pytest.param(command, id=command, marks=() if command.startswith(QUICK) else mark)


def named_after(command, option):
    words = shlex.split(command)
    return words[words.index(option) + 1] if option in words else None


def makers(command):
    """Return the earlier commands that write a file or folder which a command reads, in their order, with those that they need."""
    reads = [word for word in shlex.split(command) if word != named_after(command, "--out")]
    before = [(each, named_after(each, "--out")) for each in HERE[: HERE.index(command)]]
    own = [
        each for each, made in before if made and any(f"{word}/".startswith(f"{made}/") or made.startswith(f"{word}/") for word in reads)
    ]
    return list(dict.fromkeys(needed for each in own for needed in (*makers(each), each)))


@pytest.fixture
def reader(tmp_path, monkeypatch):
    """A reader's folder, in which commands are called."""
    said.write_files(tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("command", [marked(command) for command in HERE])
@pytest.mark.filterwarnings("default")
def test_a_command_does_what_it_is_there_for(reader, daebench, command):
    for each in (*makers(command), command):
        status, printed, err = daebench(*shlex.split(each)[1:])
        assert status == (1 if each.startswith(STOPS) else 0), err
        assert "Traceback" not in err
        assert (shown := said.printed_by(each)) is None or shown in printed
        assert (out := named_after(each, "--out")) is None or (reader / out).exists()


def test_every_command_is_one_and_takes_its_words():
    for words in (shlex.split(command)[1:] for command in said.commands() if command.startswith("daebench ")):
        command = typer.main.get_command(app)
        while hasattr(command, "commands"):
            name, *words = words
            command = command.commands[name]
        command.make_context(name, words)


def test_files_of_the_pages_are_problems(reader):
    shown = [name for name in said.files() if name.endswith(".py") and "def problem(" in said.block(name)]
    assert len(shown) > 5
    for name in shown:
        assert runpy.run_path(name)["problem"]().cases, name


@pytest.mark.slow
@pytest.mark.sampled(by=lambda case: "double_pendulum --case horizontal" not in case and "output/precision" not in case)
@pytest.mark.parametrize("command", [c for c in HERE if c.startswith(STUDIES)], ids=str)
def test_a_study_says_what_it_would_run(reader, daebench, command):
    status, out, err = daebench(*shlex.split(command)[1:], "--dry-run")
    assert status == 0, err
    assert out


def test_no_two_commands_write_the_same_file():
    """A page of an animation has its numbers beside it, under the same name with .csv."""
    written = [out for command in said.commands() if (out := named_after(command, "--out")) and "." in out]
    names = [name for out in written for name in {out, out.rpartition(".")[0] + ".csv"}]
    assert len(set(names)) == len(names)


def test_what_is_compared_with_a_reference_is_no_reference():
    (command,) = (each for each in HERE if each.startswith("daebench reference compare"))
    assert [each.split()[1] for each in makers(command)] == ["run"]


def test_what_is_not_run_here_is_on_a_page():
    for beginning in (*ELSEWHERE, *QUICK, *STUDIES, *STOPS, *TYPICAL):
        assert any(command.startswith(beginning) for command in said.commands()), beginning


def test_programs_name_what_there_is():
    for node in (node for program in said.programs() for node in ast.walk(ast.parse(program))):
        if isinstance(node, ast.ImportFrom) and node.module.startswith("daebench"):
            module = importlib.import_module(node.module)
            assert [each.name for each in node.names if not hasattr(module, each.name)] == [], node.module
        if isinstance(node, ast.Call) and ast.unparse(node.func).startswith("daebench.") and isinstance(node.func.value, ast.Name):
            inspect.signature(getattr(package, node.func.attr)).bind_partial(**{each.arg: None for each in node.keywords if each.arg})


PROGRAMS = [
    pytest.param(program, marks=pytest.mark.slow if re.search('"(planar|spherical)_pendulum"', program) else pytest.mark.exhaustive)
    for program in said.programs()
]
"""Programs of the pages: the gate runs those of a pendulum, and reads the names in all."""


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda text: text.replace("import daebench\n", "").strip().split("\n", 1)[0])
def test_a_program_runs_and_prints_what_the_page_shows(reader, program):
    (reader / "program.py").write_text(program, encoding="utf-8")
    done = said.call("python program.py", reader)
    assert done.returncode == 0, done.stderr
    assert (printed := said.printed_by(program)) is None or printed == done.stdout


def test_the_readme_shows_what_its_program_prints():
    assert [program for program in said.programs() if program in said.README.read_text(encoding="utf-8") and said.printed_by(program)]


@pytest.mark.slow
def test_the_tests_of_the_documentation_pass_with_a_code_that_is_right(reader):
    """The reader's code here is RATTLE for the planar pendulum, written from (1.25), and steps of it that are small enough."""
    (reader / "mycode.py").write_text(MYCODE, encoding="utf-8")
    done = subprocess.run([sys.executable, "-m", "pytest", "-q", "test_mine.py"], cwd=reader, capture_output=True, text=True, check=False)
    assert "2 passed" in done.stdout, done.stdout


MYCODE = '''"""RATTLE, (1.25), for the planar pendulum with unit mass, length and gravity as of the case horizontal."""

import numpy as np

from daebench.methods.initial_value_problem import initial_value_problem

gravity = initial_value_problem("planar_pendulum", "horizontal").parameters["gravity"]
down = np.array([0.0, gravity])


def rattle(p, q, h):
    free = q + h * (p - h / 2 * down)
    a, b = q @ q, free @ q
    nu = (b - np.sqrt(b * b - a * (free @ free - 1.0))) / a
    q1 = free - nu * q
    p1 = (q1 - q) / h - h / 2 * down
    return p1 - (p1 @ q1) / (q1 @ q1) * q1, q1


def simulate(q, p, t):
    states, substeps = [(q, p)], 400
    for h in np.diff(t) / substeps:
        for _ in range(substeps):
            p, q = rattle(p, q, h)
        states.append((q, p))
    return tuple(np.array(part) for part in zip(*states))
'''
