"""A start of one's own in every command: the numbers of a file whose case it is, and no reference of the case beside it."""

import csv
import itertools
import json

import pytest
from questions import SHOWN, WORDS, alike

import daebench as package
from daebench.reference.solution import certified_for
from daebench.studies.grid.run_specification import GridRun
from daebench.studies.grid.specification import key_of
from daebench.studies.stability.extreme import asked_of

BEAD = '''"""A bead of mass 2 on a circle."""

import sympy as sp

from daebench import Case, ConstrainedHamiltonian, Picture


def problem() -> ConstrainedHamiltonian:
    x, y = q = sp.symbols("x y", real=True)
    return ConstrainedHamiltonian(
        q=q,
        p=sp.symbols("p_x p_y", real=True),
        M=2 * sp.eye(2),
        U=y,
        g=[(x**2 + y**2 - 1) / 2],
        cases={"start": Case(q=START_Q, p=START_P)},
        picture=Picture(rods=[[(0, 0), (x, y)]]),
    )
'''
AWAY, MINE = "away.py", "mine.py"
OWN = ("--q0", "0.6,-0.8", "--v0", "0.4,0.3")
"""The start of the second file, by velocities: p = 2 v."""

WITHOUT = ("bench", "certify")
"""Commands that take a start by its name only, as --problem PROBLEM:CASE."""

GATE = ("run", "compare", "animate", "precision")
"""A run, a table, frames and a store of runs; of the others the gate asks whether they read the start."""


@pytest.fixture
def ask(daebench, tmp_path, monkeypatch):
    """Return a function that calls a command on a problem, in a folder of its own, and returns its JSON."""
    monkeypatch.chdir(tmp_path)
    for name, q, p in ((AWAY, "(1, 0)", "(0, 0)"), (MINE, '("3/5", "-4/5")', '("4/5", "3/5")')):
        (tmp_path / name).write_text(BEAD.replace("START_Q", q).replace("START_P", p))

    def call(command, problem, *more):
        folder = tmp_path / f"{command}-{problem}"
        folder.mkdir()
        words = [{"PROBLEM": problem, "METHOD": "rattle"}.get(word, word.replace("OUT", str(folder))) for word in WORDS[command]]
        status, out, err = daebench(command, *words, *more, "--json")
        assert status in (0, 1), err  # 1 where no tolerance is small enough
        return json.loads(out)

    return call


@pytest.mark.sampled(by=lambda case: case in GATE, slow=("precision",))
@pytest.mark.parametrize("command", [name for name in WORDS if name not in WITHOUT], ids=str)
def test_a_start_of_ones_own_gives_the_numbers_of_a_file_whose_case_it_is(ask, request, tmp_path, command):
    if command != "chaos":
        request.getfixturevalue("uncompiled_schemes")
        request.getfixturevalue("plain_functions")
    expected, shown = ask(command, MINE), ask(command, AWAY, *OWN)
    assert shown["start"] == {"coordinates": ["q1", "q2"], "q0": [0.6, -0.8], "v0": [0.4, 0.3], "p0": [0.8, 0.6]}
    assert "start" not in expected
    if command == "animate":
        one, other = (list(csv.reader((tmp_path / f"animate-{name}" / "motion.frames.csv").open())) for name in (MINE, AWAY))
        assert len(one) > 10
        assert one == other
    else:
        assert alike(SHOWN[command](shown), SHOWN[command](expected), 1e-13)


@pytest.mark.usefixtures("ask")
def test_every_command_reads_the_start_and_takes_the_path_of_a_file_for_the_name_of_a_problem(daebench, tmp_path):
    for command, problem in itertools.product(WORDS.keys() - {*WITHOUT}, ("planar_pendulum", AWAY)):
        names = {"PROBLEM": problem, "METHOD": "rattle"}
        words = [names.get(word, word.replace("OUT", str(tmp_path))) for word in WORDS[command]]
        status, out, _ = daebench(command, *words, "--q0", "1,2,3")
        assert (status, out, daebench.error.code) == (2, "", "initial-value-length"), (command, problem)


CODE = """import numpy as np

def step(p, q, h):
    down = np.array([0.0, 1.0])
    free = q + h / 2 * (p - h / 2 * down)
    inner = q @ free
    q1 = free - (inner - np.sqrt(inner**2 - free @ free + 1)) * q
    return 2 * (q1 - q) / h - h / 2 * down, q1
"""
"""RATTLE for the bead, without the projection of the momentum at its end."""


@pytest.mark.exhaustive
def test_a_diagnosis_of_steps_from_a_start_of_ones_own_names_it(ask, daebench, tmp_path):
    (tmp_path / "code.py").write_text(CODE)
    status, out, err = daebench("diagnose", "./code.py:step", "--problem", AWAY, *OWN, "--h", "0.1", "--json")
    assert status in (0, 1), err
    shown = json.loads(out)
    assert (shown["case"], shown["faults"]) == ("start[q0=0.6,-0.8;v0=0.4,0.3]", ["velocity_not_projected"])


def test_the_state_of_a_Poisson_system_is_given_in_the_same_way(daebench):
    _, out, _ = daebench("compare", "lotka_volterra", "--y0", "3,2.5", "--methods", "strang", "--h", "0.1", "--t-end", "1", "--json")
    run = package.run("lotka_volterra", y0=[3, 2.5], method="strang", h=0.1, t_end=1)
    shown = json.loads(out)
    assert shown["start"] == {"coordinates": ["y1", "y2"], "y0": [3, 2.5]}
    assert shown["rows"][0]["energy_error"] == run.maxima["energy"]


def test_a_start_of_ones_own_has_no_certified_reference_even_with_the_numbers_of_the_case():
    case = package.initial_value_problem("planar_pendulum", "rotating")
    own = package.initial_value_problem("planar_pendulum", "rotating", q0=case.q0, p0=case.p0)
    assert (certified_for(case, 1.0) is None, certified_for(own, 1.0)) == (False, None)
    asked = [asked_of("planar_pendulum", "rotating", None, None, None, start=start, on_singular=None) for start in ({}, {"q0": case.q0})]
    assert [question.reference is None for question in asked] == [False, True]
    common = {"methods": ["rattle"], "h": 0.125, "t_end": 1, "case": "rotating"}
    tables = [package.compare("planar_pendulum", **common, **start) for start in ({}, {"q0": case.q0, "p0": case.p0})]
    assert [table["position_reference"].iloc[0] for table in tables] == ["certified planar_pendulum-rotating", "closed form"]


def test_a_stored_run_has_its_start_in_its_key():
    run = {"problem": "planar_pendulum", "method": "rattle", "value": 0.1, "t_end": 1.0, "metrics": ("energy",)}
    names = ["horizontal", "horizontal[q0=1,0]", "horizontal[q0=0.6,-0.8]", "horizontal[q0=0.8,-0.6]"]
    assert len({key_of(GridRun(case=name, **run)) for name in names}) == 4


@pytest.mark.usefixtures("uncompiled_schemes", "plain_functions")
@pytest.mark.parametrize("command", ["run", "compare"])
def test_a_projected_start_says_how_far_it_moved(daebench, command):
    words = f"{command} planar_pendulum --q0 0,-2 --v0 1,0 --h 0.1 --t-end 1 --method{'s' * (command == 'compare')} rattle"
    status, out, _ = daebench(*words.split(), "--project")
    assert (status, out.count("by 1 in q0, 0 in p0")) == (0, 1)
    assert json.loads(daebench(*words.split(), "--project", "--json")[1])["projected"] == pytest.approx({"q0": 1, "p0": 0})
    assert (daebench(*words.split())[0], daebench.error.code) == (2, "off-the-manifold")
