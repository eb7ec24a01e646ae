"""``daebench run --reactions``: a table, JSON, files with curves, and what is refused."""

import json

import numpy as np
import pandas as pd
import pytest

PENDULUM = ("run", "planar_pendulum", "--case", "horizontal", "--method", "rattle", "--h", "0.01", "--t-end", 2, "--reactions")
PENDULUM += ("--param", "gravity=9.81", "--param", "mass=2")

pytestmark = pytest.mark.usefixtures("uncompiled_schemes", "plain_functions")

DOOR = """
from daebench import ConstrainedHamiltonian
from daebench.joints import Body, Mechanism, Spherical


def problem() -> ConstrainedHamiltonian:
    return Mechanism(
        points={"P": (0, 0, 0), "R": (0, 0, 1)},
        bodies={"door": Body("P", "R", mass=12, centre=("0.4", 0, 1), inertia=(5, 5, 1))},
        joints=[Spherical("door", "ground", "P"), Spherical("door", "ground", "R")],
        gravity=(0, 0, "-9.81"),
    ).problem()
"""


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_constraint_pulls_the_pendulum_along_its_rod(daebench):
    status, out, _ = daebench(*PENDULUM, "--json")
    printed = json.loads(out)
    (load,) = printed["reactions"]["loads"]
    x, y = printed["q"]
    # Released from the horizontal on a rod of 1 m: v^2 = 2 g (-y).
    tension = 3 * 2 * 9.81 * -y
    assert status == 0
    assert load["force"]["at_end"] == pytest.approx([-tension * x, -tension * y], abs=0.05)
    assert load["force"]["largest"] == pytest.approx(3 * 2 * 9.81, abs=0.05)


def test_files_have_the_curves_and_how_they_were_made(daebench, here):
    assert daebench(*PENDULUM, "--out", "run.npz")[0] == 0
    table = pd.read_csv("run.reactions.csv")
    assert len(table) == 201
    assert np.hypot(table["force q1"], table["force q2"]).max() == pytest.approx(3 * 2 * 9.81, abs=0.05)
    assert (here / "run.reactions.png").read_bytes().startswith(b"\x89PNG")
    assert "force in the coordinates" in (here / "run.reactions.svg").read_text()
    assert "Method: rattle" in (here / "run.reactions.csv.txt").read_text()


def test_what_redundant_joints_share_is_said_to_be_open(daebench, here):
    (here / "door.py").write_text(DOOR)
    command = ("run", "./door.py", "--method", "rattle", "--h", "0.01", "--steps", 2, "--on-singular", "least-squares", "--reactions")
    status, out, _ = daebench(*command, "--out", "run.csv")
    assert status == 0
    assert out.count("z not determined by rigid bodies") == 2
    table = pd.read_csv("run.reactions.csv")
    assert table["force z [N]"].isna().all()
    assert np.abs(table["force x [N]"]).to_numpy() == pytest.approx(12 * 9.81 * 0.4)
    assert "[N]" in (here / "run.reactions.svg").read_text()


def test_a_file_of_somebody_else_is_not_replaced(daebench, here):
    (here / "run.reactions.csv").write_text("mine")
    status, _, err = daebench(*PENDULUM, "--out", "run.csv")
    assert status == 2
    assert "run.reactions.csv: the file exists" in err
    assert not (here / "run.csv").exists()
