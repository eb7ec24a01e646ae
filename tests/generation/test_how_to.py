"""The program of the how-to page compiles as it stands, and prints what the wheel does and what the tie rod bears."""

import re
import shutil
import subprocess

import numpy as np
import pytest
from measures import error_of
from said import ROOT

import daebench

COMPILER = shutil.which("gcc") or shutil.which("cc")


def program():
    """Return the program of the page, and the page."""
    page = (ROOT / "docs" / "how-to" / "take-it-home.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"```\{code-block\} c\n:caption: wheel\.c\n\n(.*?)```", page, re.S)
    return text, page


def test_the_program_calls_functions_that_there_are(tmp_path):
    daebench.generate("planar_pendulum", "rattle", tmp_path / "any", h=0.01, name="suspension")
    header = (tmp_path / "any" / "suspension.h").read_text(encoding="utf-8")
    used = set(re.findall(r"\bsuspension\w+|\bSUSPENSION\w+", program()[0]))
    assert len(used) > 3
    assert [name for name in used if not re.search(rf"\b{name}\b", header)] == []


@pytest.mark.exhaustive
@pytest.mark.skipif(COMPILER is None, reason="there is no compiler of C")
def test_the_program_of_the_page_prints_the_motion_of_the_wheel_and_the_force_in_the_tie_rod(tmp_path):
    text, page = program()
    daebench.generate("double_wishbone", "rattle", tmp_path / "suspension", h=0.001, name="suspension")
    (tmp_path / "wheel.c").write_text(text)
    command = next(line for line in page.splitlines() if line.startswith("cc ")).split()
    subprocess.run([COMPILER, "-Wall", "-Wextra", "-Werror", *command[1:]], cwd=tmp_path, check=True)
    out = subprocess.run(["./wheel"], cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    printed = np.array([[float(x) for x in re.findall(r"-?\d+\.\d+", line)] for line in out.splitlines()])
    ivp = daebench.initial_value_problem("double_wishbone", parameters={"wheel_mass": 18.0})
    run = daebench.run(ivp, method="rattle", h=0.001, steps=500, every=50)
    force = 2 * np.sqrt(0.0627) * ivp.along("lam", run.p, run.q)[:, 4]
    assert error_of(printed[:, 0], run.t) < 1e-9
    assert error_of(printed[:, 1], run.q[:, 2]) < 1e-6
    assert error_of(printed[:, 2], force) < 1e-3
    assert np.ptp(force) > 1
