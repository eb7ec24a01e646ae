"""A problem file of the user's own is used like a name; what it imports from beside it counts, and the cache knows it."""

import importlib.metadata
import json
import os
import re
import sys

import numpy as np
import planting
import pytest
from own_files import HELPED, PLAIN, RING
from refusals import refused, unsaid

import daebench as package
from daebench.diagnostics.problem.check import held
from daebench.errors import InvalidProblem
from daebench.methods import catalogue
from daebench.methods.initial_value_problem import declared_ivps, initial_value_problem
from daebench.systems.files.imports import TAKEN

# ---- a file is used like a name --------------------------------------------------------------------------------------------


def test_a_file_is_run_by_its_path_and_follows_its_closed_form(daebench, folder, plain_functions):
    words = ("./ring.py", "--case", "turning", "--method", "scipy:DOP853", "--tol", 1e-10, "--t-end", 0.2, "--json")
    status, out, err = daebench("run", *words)
    found = json.loads(out)
    assert (status, err) == (0, "")
    assert (found["problem"], found["case"]) == ("./ring.py", "turning")
    assert np.allclose(found["q"], (1.5 * np.sin(0.4), -1.5 * np.cos(0.4)), rtol=0, atol=1e-8)


COMMANDS = {
    "run": ("run", "./ring.py", "--method", "rattle", "--h", 0.01, "--steps", 100),
    "compare": ("compare", "./ring.py", "--methods", "rattle,strang", "--h", 0.01, "--t-end", 1),
    "order": ("order", "./ring.py", "--methods", "rattle", "--halvings", 2),
    "check": ("check", "./ring.py", "--method", "rattle"),
    "bench": ("bench", "--problem", "./ring.py", "--methods", "rattle", "--steps", 1000, "--repeat", 1),
    "poisson": ("run", "./orbit.py", "--method", "midpoint", "--anyway", "--h", 0.01, "--steps", 100),
}


@pytest.mark.sampled(left_out=("bench", "check", "compare", "run"))
@pytest.mark.slow
@pytest.mark.parametrize("words", COMMANDS.values(), ids=COMMANDS)
def test_every_command_that_takes_a_problem_takes_a_file(daebench, folder, words, monkeypatch, request):
    if words[0] != "bench":  # which times what is compiled
        request.getfixturevalue("uncompiled_schemes")
    monkeypatch.setattr(importlib.import_module("daebench.cli.bench"), "STARTS", 1)  # daebench.cli.bench is the command
    status, out, err = daebench(*words)
    assert (status, err) == (0, "")
    assert out


@pytest.mark.parametrize(
    "words", [("ring.py",), ("./ring.py",), ("{folder}/ring.py",), ("sub/../ring.py",)], ids=["bare", "dot", "whole", "way"]
)
def test_a_path_ends_in_py_or_has_a_separator(daebench, folder, words):
    (folder / "sub").mkdir()
    (folder / "ring.py").write_text(PLAIN)
    path = words[0].format(folder=folder)
    status, out, _ = daebench("show", path, "--json")
    assert status == 0
    assert json.loads(out)["problem"] == path
    assert json.loads(out)["parameters"] == {"mass": 2.0, "radius": 1.5}


def test_a_file_of_a_poisson_system_is_checked_by_its_path(daebench, folder):
    status, out, _ = daebench("check", "./orbit.py", "--json")
    checked = {"case": "even", "what": "twice differentiable at the start", "fault": "", "note": ""}
    assert (status, json.loads(out)["checks"]) == (0, [checked])


def test_the_library_takes_paths_too(folder):
    ivp = package.initial_value_problem(folder / "ring.py", case="resting", parameters={"radius": 2.0})
    assert ivp.q0.tolist() == [2.0, 0.0]
    assert initial_value_problem("ring.py", "turning").p0.tolist() == [6.0, 0.0]
    assert package.initial_value_problem("./orbit.py").y0.tolist() == [1.0, 3.0]


@pytest.mark.parametrize("path", ["~nobody_of_this_name/ring.py", "r" * 300 + ".py"], ids=["no such user", "too long"])
def test_a_path_that_cannot_be_is_no_file(daebench, path):
    status, _, err = daebench("show", path)
    assert (status, err.count("\n")) == (2, 1)
    assert daebench.error.code == "no-such-file-or-name"


IDLE = {"h": ("--h", 0), "steps": ("--steps", 200), "option": ("--option", "a=1"), "anyway": ("--anyway",)}


@pytest.mark.parametrize("words", IDLE.values(), ids=IDLE)
def test_what_only_a_method_is_checked_with_is_refused_without_one(daebench, folder, words):
    status, out, err = daebench("check", "./ring.py", *words)
    assert (status, out) == (2, "")
    assert (daebench.error.code, unsaid([words[0]], err)) == ("check-option-of-method", [])


def test_a_file_without_cases_starts_from_what_is_given(daebench, folder):
    (folder / "ring.py").write_text(RING[: RING.index("        cases=")] + RING[RING.index("        integrals=") :])
    assert (daebench("show", "./ring.py")[0], daebench.error.code) == (2, "problem-without-cases")
    assert package.initial_value_problem("./ring.py", q0=(0, 1.5), p0=(1, 0)).case == "[q0=0,1.5;p0=1,0]"


# ---- files beside it, and the cache ----------------------------------------------------------------------------------------


def momentum(path):
    return initial_value_problem(str(path), "turning").p0[0]


def test_files_of_one_name_in_two_folders_are_not_mixed_up(tmp_path):
    for name, speed in (("a", 3), ("b", 4)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "ring.py").write_text(HELPED)
        (tmp_path / name / "helper_of_ring.py").write_text(f"SPEED = {speed}\n")
    before = list(sys.path), set(sys.modules)
    assert [momentum(tmp_path / name / "ring.py") for name in "abab"] == [6, 8, 6, 8]
    assert sys.path == before[0]
    assert "helper_of_ring" not in sys.modules


def test_what_a_name_meant_before_is_put_back(tmp_path, monkeypatch):
    mine = type(sys)("helper_of_ring")
    monkeypatch.setitem(sys.modules, "helper_of_ring", mine)
    (tmp_path / "ring.py").write_text(HELPED)
    (tmp_path / "helper_of_ring.py").write_text("SPEED = 5\n")
    assert momentum(tmp_path / "ring.py") == 10
    assert sys.modules["helper_of_ring"] is mine


EDITS = {
    "the file": ("ring.py", HELPED.replace("(3", "(4").replace("SPEED * m", "SPEED * m * 2"), 12),
    "a helper": ("helper_of_ring.py", "SPEED = 7\n", 14),
    "a helper of a helper": ("deep_of_ring/inner.py", "SPEED = 8\n", 16),
}


@pytest.mark.parametrize(("file", "text", "expected"), EDITS.values(), ids=EDITS)
def test_an_edited_file_is_never_served_from_the_cache_of_the_old_one(tmp_path, monkeypatch, file, text, expected):
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    (tmp_path / "ring.py").write_text(HELPED)
    (tmp_path / "deep_of_ring").mkdir()
    (tmp_path / "deep_of_ring" / "__init__.py").write_text("")
    (tmp_path / "deep_of_ring" / "inner.py").write_text("SPEED = 3\n")
    (tmp_path / "helper_of_ring.py").write_text("from deep_of_ring.inner import SPEED\n")
    stamp = (tmp_path / file).stat()
    assert momentum(tmp_path / "ring.py") == 6
    (tmp_path / file).write_text(text)
    os.utime(tmp_path / file, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))  # as within one tick of the clock
    assert momentum(tmp_path / "ring.py") == expected


def test_equal_files_in_two_folders_may_read_what_is_beside_them(tmp_path):
    text = PLAIN.replace("(3 * m, 0)", "(int((Path(__file__).parent / 'speed.txt').read_text()) * m, 0)").replace(
        "import mpmath", "from pathlib import Path\n\nimport mpmath", 1
    )
    for name, speed in (("a", 3), ("b", 4)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "ring.py").write_text(text)
        (tmp_path / name / "speed.txt").write_text(str(speed))
    assert [momentum(tmp_path / name / "ring.py") for name in "ab"] == [6, 8]


def test_an_import_that_cannot_be_seen_is_refused(tmp_path):
    text = HELPED.replace("import helper_of_ring", 'helper_of_ring = __import__("importlib").import_module("helper_of_ring")')
    (tmp_path / "ring.py").write_text(text)
    (tmp_path / "helper_of_ring.py").write_text("SPEED = 3\n")
    for _ in range(2):
        with refused("import-not-visible", InvalidProblem, ["helper_of_ring.py"]):
            initial_value_problem(str(tmp_path / "ring.py"))


def test_names_of_what_daebench_stands_on_are_taken():
    providers = importlib.metadata.packages_distributions()
    lines = [
        line
        for line in importlib.metadata.requires("daebench") or ()
        if "extra" not in line or re.search("certify|scale|lessons|video", line)
    ]
    needed = {re.match(r"[\w-]+", line)[0].lower() for line in lines} - {"daebench"}
    brought = {name for name, by in providers.items() if needed & {each.lower() for each in by} and name.isidentifier()}
    assert {name for name in brought if not name.startswith("_")} <= TAKEN
    assert len(brought) >= len(needed)


LONG = {"folders": ("d" * 100, "e" * 100, "ring.py"), "file": ("ring" * 50 + ".py",)}


@pytest.mark.parametrize("parts", LONG.values(), ids=LONG)
def test_a_path_of_any_length_has_its_files_in_the_cache(tmp_path, monkeypatch, parts):
    monkeypatch.setenv("DAEBENCH_CACHE", str(tmp_path / "kept"))
    path = tmp_path.joinpath(*parts)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(PLAIN)
    ivp = initial_value_problem(str(path), "turning")
    assert ivp.value("g", ivp.q0).tolist() == [0.0]
    kept = [each.stem for each in (tmp_path / "kept").glob("*.py")]
    assert len(kept) >= 3
    assert max(map(len, kept)) <= 120  # object files add a function's name and a key, and 255 is the limit


def test_a_file_beside_it_takes_no_name_that_daebench_stands_on(tmp_path, monkeypatch):
    (tmp_path / "ring.py").write_text(PLAIN.replace("import sympy as sp\n", "import colorsys\nimport random\n\nimport sympy as sp\n", 1))
    monkeypatch.delitem(sys.modules, "colorsys", raising=False)
    for name in ("sympy", "random", "colorsys"):
        (tmp_path / f"{name}.py").write_text("raise RuntimeError('hijacked')\n")
    assert momentum(tmp_path / "ring.py") == 6


def test_what_a_file_prints_does_not_spoil_json(daebench, folder):
    (folder / "ring.py").write_text(RING.replace("    m, r", '    print("made")\n    m, r', 1))
    status, out, err = daebench("check", "./ring.py", "--case", "resting", "--json")
    assert (status, json.loads(out)["ok"], err) == (0, True, "made\n")


GATE = {"four_bar", "free_rigid_body", "kepler", "knife_edge", "torus"}
"""One problem of each kind. No run checks what daebench's own declare, so that the gate tries three more: others in each tree."""

LONG = ("ablowitz_ladik", "andrews_squeezer", "butane", "cyclohexane_ring", "watt_six_bar")
GATE |= set(planting.drawn(set(catalogue.problems()) - {*GATE, *LONG}, planting.digest(), 3))


@pytest.mark.sampled(by=GATE.__contains__)
@pytest.mark.slow
@pytest.mark.parametrize("name", catalogue.problems())
def test_what_the_problems_of_the_catalogue_declare_is_so(name):
    found = [each for ivp in declared_ivps(name) for each in held(ivp)]
    assert found
    assert [each for each in found if each.fault] == []
