"""``daebench run --steps-out``: a table with all digits, a picture, how they were made, and what is refused."""

import numpy as np
import pytest

import daebench as package

RUN = "run planar_pendulum --case horizontal --method ida:index2 --tol 1e-5 --t-end 2 --out run.csv --steps-out steps.csv"


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_table_and_picture_are_written_beside_each_other(daebench, here):
    assert daebench(*RUN.split())[0] == 0
    table = np.genfromtxt("steps.csv", delimiter=",", names=True)
    steps = package.run("planar_pendulum", case="horizontal", method="ida:index2", tol=1e-5, t_end=2.0, solver_steps=True).solver_steps
    for name, column in steps.columns.items():
        assert np.array_equal(table[name], column)
    assert {"t", "h", "order", "iterations", "share_Lam", "q2", "estimate_v1", "weight_Lam1"} <= set(table.dtype.names)
    assert (here / "steps.png").read_bytes().startswith(b"\x89PNG")
    assert all((here / f"steps.{ending}.txt").exists() for ending in ("csv", "svg", "png"))


def test_a_run_that_fails_at_its_start_has_its_attempts_drawn(daebench, here):
    command = "run spherical_pendulum --case fig1.2 --method ida:index3:none --tol 1e-3 --t-end 1 --steps-out steps.csv"
    assert daebench(*command.split())[0] == 1
    assert set(np.genfromtxt("steps.csv", delimiter=",", names=True)["accepted"]) == {0.0}
    assert (here / "steps.png").exists()
