"""Errors of positions in a comparison: the number against motions that are known, and what it says it was taken against."""

import math
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

import daebench as package
from daebench.methods.fixed_step.poisson import PoissonStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.reference.solution import certified_for, own_run

pytestmark = pytest.mark.usefixtures("plain_functions", "uncompiled_schemes")


@pytest.fixture(autouse=True)
def _plain(monkeypatch):
    monkeypatch.setattr("daebench.methods.names.PoissonStep", lambda *a, **k: PoissonStep(*a, **k | {"compiled": False}))


def oscillator():
    """Return a canonical system in disguise, B = 2 J and H = (u^2 + v^2)/4: (u, v) = (cos t, -sin t)."""
    u, v = sp.symbols("u v", real=True)
    case = package.PoissonCase(y=(1, 0))
    return package.PoissonSystem(y=(u, v), B=sp.Matrix([[0, 2], [-2, 0]]), H=(u**2 + v**2) / 4, cases={"one": case})


def ring(t):
    """Return where the bead of the ring is: it turns with 2 radians a second."""
    return np.stack([1.5 * np.sin(2 * t), -1.5 * np.cos(2 * t)], axis=1)


def circle(t):
    return np.stack([np.cos(t), -np.sin(t)], axis=1)


KNOWN = {
    **{name: ("./ring.py", ring, name) for name in ("symplectic_euler", "rattle", "rattle/suzuki4")},
    **{f"poisson {name}": (None, circle, name) for name in ("symplectic_euler", "midpoint")},
}

KEPT = ("symplectic_euler-closed form or DOP853", "rattle-own finer runs", "poisson midpoint-closed form or DOP853")
"""Cases of the gate: each order, kind of problem and reference."""

AGAINST = {"closed form or DOP853": 400_000, "own finer runs": 0}


@pytest.mark.sampled(by=lambda case: case in KEPT)
@pytest.mark.parametrize("calls", AGAINST.values(), ids=AGAINST)
@pytest.mark.parametrize(("problem", "motion", "method"), KNOWN.values(), ids=KNOWN)
def test_the_error_is_that_of_the_motion_that_is_known(folder, monkeypatch, problem, motion, method, calls):
    """Of order 1, h against h/4 shows three quarters of the error, of order 2 all but a sixteenth."""
    if not calls and problem:
        text = (folder / "ring.py").read_text()
        (folder / "ring.py").write_text(text.replace("        closed_form=closed_form,\n", ""))
    monkeypatch.setattr("daebench.studies.comparison.position_error.own_run", lambda ivp, times: own_run(ivp, times, calls))
    problem, h, t_end = problem or oscillator(), 1 / 32, 2.0
    (row,) = package.compare(problem, methods=[method], h=h, t_end=t_end).to_dict("records")
    run = package.run(problem, method=method, h=h, t_end=t_end)
    true = np.max(np.abs((run.q if hasattr(run, "q") else run.y) - motion(run.t)))
    assert row["position_error"] == pytest.approx(true, rel=1e-6 if calls else 0.26)
    assert abs(row["position_error"] - true) <= row["position_bound"] < row["position_error"]
    assert ("own run with h/4" in row["position_reference"]) == (not calls)


def test_a_method_by_tolerance_is_held_against_its_own_with_smaller_ones_if_there_are_some(monkeypatch):
    monkeypatch.setattr("daebench.studies.comparison.position_error.own_run", lambda ivp, times: own_run(ivp, times, 0))
    loose, tight = (package.compare(oscillator(), methods=["scipy:RK45"], tol=tol, t_end=5.0).iloc[0] for tol in (1e-5, 1e-13))
    run = package.run(oscillator(), method="scipy:RK45", tol=1e-5, t_end=5.0)
    assert loose["position_reference"] == "own run with tol/100"
    assert loose["position_error"] == pytest.approx(np.max(np.abs(run.y - circle(run.t))), rel=0.26)
    assert math.isnan(tight["position_error"])
    assert tight["position_reference"].startswith("unknown: own run with tol/100 is refused")


def test_a_long_chain_is_held_against_its_own_finer_runs():
    """Its index-reduced equation is not written for DOP853."""
    asked = {"case": "hanging", "parameters": {"links": 10}, "methods": ["rattle"], "t_end": 0.25}
    coarse, fine = (package.compare("pendulum_chain", h=h, **asked).iloc[0] for h in (1 / 32, 1 / 64))
    assert coarse["position_reference"] == fine["position_reference"] == "own run with h/4"
    assert coarse["position_error"] / fine["position_error"] == pytest.approx(4, rel=0.1)


PENDULUM = ("planar_pendulum", "rotating")


def test_a_certified_reference_is_taken_where_it_fits():
    asked = {"case": "rotating", "h": 1 / 16, "t_end": 2.0}
    (row,) = package.compare("planar_pendulum", methods=["rattle"], **asked).to_dict("records")
    own = own_run(initial_value_problem(*PENDULUM), [k / 16 for k in range(1, 33)])
    run = package.run("planar_pendulum", method="rattle", **asked)
    assert row["position_reference"] == "certified planar_pendulum-rotating"
    assert row["position_error"] == pytest.approx(np.max(np.abs(run.q[1:] - own.states["q"])), rel=1e-6)


def test_it_fits_this_definition_start_and_parameters_alone():
    ivp = initial_value_problem(*PENDULUM)
    assert certified_for(ivp, 4.0).name == "planar_pendulum-rotating"
    assert certified_for(initial_value_problem(*PENDULUM, {"gravity": 9.0}), 4.0) is None
    assert certified_for(ivp, 1e6) is None
    assert certified_for(replace(ivp, p0=2 * ivp.p0), 4.0) is None
    assert certified_for(initial_value_problem("torus", "inner"), 1.0) is None
    assert certified_for(initial_value_problem(oscillator()), 1.0) is None


def test_another_definition_of_the_same_name_is_another_problem(folder):
    text = (folder / "ring.py").read_text()
    (folder / "planar_pendulum.py").write_text(text.replace('"turning"', '"rotating"'))
    assert certified_for(initial_value_problem("./planar_pendulum.py", "rotating"), 1.0) is None
    catalogued = initial_value_problem("planar_pendulum").source.derivation.problem
    heavier = replace(catalogued, U=2 * catalogued.U, closed_form=None)
    assert certified_for(initial_value_problem(heavier, "rotating"), 1.0) is None


def test_a_motion_that_no_run_can_follow_has_no_error_and_says_so():
    """Of a pendulum that stands on its top to 1e-14, how long it does is known to nobody in double precision."""
    u, v = sp.symbols("u v", real=True)
    case = package.PoissonCase(y=(math.pi - 1e-14, 0))
    upright = package.PoissonSystem(y=(u, v), B=sp.Matrix([[0, 1], [-1, 0]]), H=v**2 / 2 - sp.cos(u), cases={"top": case})
    (row,) = package.compare(upright, methods=["midpoint"], h=0.25, t_end=200.0).to_dict("records")
    assert math.isnan(row["position_error"])
    assert row["position_reference"].startswith("unknown: own finer run (DOP853, tol 2.5e-14) may itself be wrong by")


def test_a_run_that_stops_has_no_position_error():
    table = package.compare("spherical_pendulum", case="fig1.2", methods=["se", "rattle"], h=0.02, t_end=1.0).set_index("method")
    assert table["failure"]["se"]
    assert math.isnan(table["position_error"]["se"])
    assert table["position_error"]["rattle"] > 0


def test_a_finer_run_that_loses_its_energy_is_no_reference(monkeypatch):
    """As one that has stepped over a collision: here each energy along the run is off by a part."""
    ivp = initial_value_problem("planar_pendulum", "rotating", {"gravity": 9.0})
    along = type(ivp).along
    monkeypatch.setattr(type(ivp), "along", lambda self, name, *x: along(self, name, *x) * (1.01 if name == "H" else 1))
    with pytest.raises(package.RunFailed, match="does not conserve the energy"):
        own_run(ivp, [0.5, 1.0])
