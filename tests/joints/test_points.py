"""Named points of a mechanism at the end of a run, in JSON."""

import json

import numpy as np

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


def test_a_run_tells_in_json_where_the_named_points_are_at_its_end(daebench, tmp_path):
    (tmp_path / "crank.py").write_text(OWN)
    run = ("run", str(tmp_path / "crank.py"), "--param", "reach=3", "--method", "ida:index2", "--tol", "1e-8", "--t-end", "0.3")
    status, out, err = daebench(*run, "--json")
    assert (status, err) == (0, "")
    found = json.loads(out)
    x, y, slid = found["q"]
    expected = {"O": [0, 0], "A": [x, y], "B": [slid, 0], "C": [(x + slid) / 2, y / 2]}
    assert found["points"].keys() == expected.keys()
    for name, place in expected.items():
        assert np.abs(np.subtract(found["points"][name], place)).max() < 1e-15
    assert abs(np.hypot(slid - x, y) - 3) < 1e-6
    assert "points" not in daebench(*run)[1]


def test_a_problem_without_named_points_has_none_in_json(daebench):
    status, out, _ = daebench("run", "planar_pendulum", "--method", "ida:index2", "--tol", "1e-6", "--t-end", "0.1", "--json")
    assert status == 0
    assert "points" not in json.loads(out)
