"""``daebench run --reactions``: a table, JSON, files with curves, and what is refused."""

import json

import numpy as np
import pandas as pd
import pytest

PENDULUM = "run planar_pendulum --case horizontal --method rattle --h 0.01 --t-end 2 --reactions --param gravity=9.81 --param mass=2"

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


def test_json_and_files_have_the_force_along_the_rod(daebench, here):
    """Released from the horizontal on a rod of 1 m, v^2 = 2 g (-y) and the tension is 3 m g (-y)."""
    status, out, _ = daebench(*PENDULUM.split(), "--out", "run.npz", "--json")
    printed, table = json.loads(out), pd.read_csv("run.reactions.csv")
    (load,) = printed["reactions"]["loads"]
    x, y = printed["q"]
    assert (status, len(table)) == (0, 201)
    assert load["force"]["at_end"] == pytest.approx([3 * 2 * 9.81 * y * x, 3 * 2 * 9.81 * y * y], abs=0.05)
    largest = np.hypot(table["force q1"], table["force q2"]).max()
    assert [load["force"]["largest"], largest] == pytest.approx([3 * 2 * 9.81] * 2, abs=0.05)
    assert (here / "run.reactions.png").read_bytes().startswith(b"\x89PNG")


def test_what_redundant_joints_share_is_said_to_be_open(daebench, here):
    (here / "door.py").write_text(DOOR)
    command = "run ./door.py --method rattle --h 0.01 --steps 2 --on-singular least-squares --reactions --out run.csv"
    status, out, _ = daebench(*command.split())
    assert (status, out.count("not determined")) == (0, 2)
    table = pd.read_csv("run.reactions.csv")
    assert table["force z [N]"].isna().all()
    assert np.abs(table["force x [N]"]).to_numpy() == pytest.approx(12 * 9.81 * 0.4)
