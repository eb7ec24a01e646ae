"""Named points of a mechanism at the end of a run, in JSON."""

import json

import numpy as np
import pytest

from daebench.draw.scene import layout_of, named_points
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.problems import bricard

OWN = '''"""A slider crank of daebench.joints."""

import sympy as sp

from daebench import ConstrainedHamiltonian
from daebench.joints import Guided, Mechanism, PointMass, Rod, Start


def problem(*, reach: float = 2.0, gravity: float = 9.81) -> ConstrainedHamiltonian:
    """Return it."""
    b, gamma = sp.symbols("reach gravity", positive=True)
    return Mechanism(
        ground={"O": (0, 0)},
        points={"A": (1, 0), "B": Guided((1 + b, 0), (1, 0)), "C": (1 + b / 2, 0)},
        bodies={"crank": Rod("O", "A", mass=1), "rod": Rod("A", "B", "C", mass=1), "slider": PointMass("B", 1)},
        gravity=(0, -gamma),
        parameters={b: reach, gamma: gravity},
        cases={"turning": Start(velocity={"A": (0, 8)})},
    ).problem()
'''


@pytest.mark.usefixtures("uncompiled_schemes")
def test_a_run_tells_in_json_where_the_named_points_are_at_its_end(daebench, tmp_path):
    (tmp_path / "crank.py").write_text(OWN)
    run = ("run", str(tmp_path / "crank.py"), "--param", "reach=3", "--method", "rattle", "--h", "0.01", "--t-end", "0.1")
    status, out, err = daebench(*run, "--json")
    assert (status, err) == (0, "")
    found = json.loads(out)
    x, y, slid = found["q"]
    expected = {"O": [0, 0], "A": [x, y], "B": [slid, 0], "C": [(x + slid) / 2, y / 2]}
    assert found["points"].keys() == expected.keys()
    for name, place in expected.items():
        assert np.abs(np.subtract(found["points"][name], place)).max() < 1e-15
    assert abs(np.hypot(slid - x, y) - 3) < 1e-12
    assert "points" not in daebench(*run)[1]


def test_a_problem_without_named_points_has_none_in_json(daebench):
    status, out, _ = daebench("run", "planar_pendulum", "--method", "ida:index2", "--tol", "1e-6", "--t-end", "0.1", "--json")
    assert status == 0
    assert "points" not in json.loads(out)


NAMED = {
    "andrews_squeezer": "OABCDEFGH",
    "bricard": ("P0", "P1", "P2", "P3", "P4", "P5"),
    "car_axis": ("left", "right", "wheel"),
    "driven_slider_crank": "OABC",
    "four_bar": ("A0", "A1", "A2", "B0", "B1", "B2"),
    "four_bar_spring": "ABCD",
    "slider_crank": "OAB",
    "slider_crank_sundials": "OAB",
}
"""Mechanisms of the catalogue that are written by hand, and the names of their joints."""


@pytest.mark.sampled(left_out=("andrews_squeezer", "bricard", "slider_crank_sundials"))
@pytest.mark.parametrize("name", NAMED)
def test_the_joints_of_mechanisms_have_names_and_are_where_the_picture_has_them(name):
    ivp = initial_value_problem(name, consistent=False)
    points, layout = named_points(ivp, ivp.q0), layout_of(ivp)
    assert {*points} == {*NAMED[name]}
    drawn = layout.at(ivp.q0[None])[0]
    assert all(np.abs(drawn - place).max(axis=1).min() < 1e-14 for place in points.values())


def test_the_wheel_of_the_car_axis_is_where_it_is_at_the_time():
    ivp = initial_value_problem("car_axis", consistent=False)
    wheel = 0.1 * np.sin(3.0)
    assert named_points(ivp, np.array([0.1, 0.5, 1.1, 0.4, 0.3]))["wheel"] == pytest.approx([np.sqrt(1 - wheel**2), wheel], abs=1e-15)


def test_the_third_joint_of_bricards_mechanism_is_the_one_whose_motion_is_published():
    """It starts at (1, -1, 0), the cube's corner, and is at (0, -0.866, -0.5) half way between the ends of its motion."""
    ivp = initial_value_problem("bricard", "iftomm", consistent=False)
    assert named_points(ivp, ivp.q0)["P3"] == pytest.approx([1, -1, 0], abs=1e-15)
    half_way = np.array([float(x) for x in bricard.placed(0, 1)])
    assert named_points(ivp, half_way)["P3"] == pytest.approx([0, -np.sqrt(3) / 2, -0.5], abs=1e-15)


@pytest.mark.slow
def test_a_long_chain_has_names_up_to_a_number_of_nodes():
    short, longer = (initial_value_problem("four_bar", "swing", {"bars": bars}) for bars in (40, 300))
    points = named_points(short, short.q0)
    assert len(points) == 82
    assert points["B40"] == pytest.approx([40 + np.sin(0.1), -np.cos(0.1)], abs=1e-15)
    assert not named_points(longer, longer.q0)
