"""What the study of orders leaves behind: its picture and tables, and what the command prints and refuses."""

import json
from dataclasses import replace

import pytest
from ivps import ivp
from studies import plain

import daebench.methods.formulations.constrained
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.names import several
from daebench.studies.orders.study import study

pytestmark = pytest.mark.usefixtures("plain_functions")

COMMAND = ("order", "planar_pendulum", "--case", "rotating", "--methods", "rattle")


@pytest.fixture
def daebench(daebench, monkeypatch):
    """Run the command line, uncompiled."""

    def uncompiled_methods(methods, options=None, **kind):
        return [replace(each, compiled=False) if isinstance(each, FixedStep) else each for each in several(methods, options, **kind)]

    monkeypatch.setattr("daebench.studies.orders.study.several", uncompiled_methods)
    return daebench


def test_a_picture_of_nothing_but_failures_is_drawn(tmp_path):
    study(ivp("spherical-fast"), [plain("rattle")], t_end=32.0, h=4.0, halvings=2).write(tmp_path)
    assert (tmp_path / "order.png").stat().st_size > 10000


def test_the_command_prints_a_row_for_each_component_and_writes_its_files(daebench, tmp_path):
    status, out, err = daebench(*COMMAND, "--t-end", 1, "--h", 0.03125, "--halvings", 4, "--out", tmp_path / "deep" / "er")
    assert (status, err) == (0, "")
    assert [line.split()[1] for line in out.splitlines() if line.startswith(" rattle")] == ["q", "p", "lam", "lam_n", "mu_n", "mean"]
    assert "5/5" in out
    assert "t = T k/8" in out
    assert {path.name for path in (tmp_path / "deep" / "er").iterdir()} == {
        "orders.csv",
        "orders.csv.txt",
        "order.csv",
        "order.csv.txt",
        "order.svg",
        "order.png",
    }


def test_the_command_gives_everything_as_one_json_object(daebench):
    status, out, err = daebench(*COMMAND, "--t-end", 4, "--h", 0.5, "--halvings", 6, "--param", "gravity=3", "--json")
    found = json.loads(out)
    assert (status, err) == (0, "")
    assert found["parameters"]["gravity"] == 3
    assert found["times"] == [0.5 * k for k in range(1, 9)]
    assert found["reference"]["kind"] == "closed form"
    series = found["series"][0]
    assert (series["method"], series["component"], series["claimed"], len(series["points"])) == ("rattle", "q", 2, 7)
    for point in series["points"]:
        assert point["steps"] * point["h"] == 4
        assert point["used"] == (point["reason"] == "")
        assert (point["error"] is None) == (point["reason"] == "failed") == bool(point["failure"])
    assert abs(series["order"] - 2) < 0.1


def test_the_command_exits_with_1_where_nothing_could_be_run(daebench):
    status, out, _ = daebench("order", "spherical_pendulum", "--case", "fig1.2b", *COMMAND[4:], "--t-end", 32, "--h", 4, "--halvings", 2)
    assert status == 1
    assert "3 failed" in out
    assert "rattle on spherical_pendulum, case fig1.2b, stopped at t = 0" in out
