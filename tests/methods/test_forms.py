"""Forms of the index-reduced equation (1.18): Baumgarte's, the stiff one of a penalty, and local coordinates."""

import numpy as np
import pytest
from ivps import ivp
from measures import error_of
from oracles import solution
from runs import method, run, state_error
from scipy.linalg import expm

from daebench.diagnostics.order import fit_order
from daebench.diagnostics.reversibility import reversibility_defect
from daebench.diagnostics.symplecticity import symplecticity_defect
from daebench.errors import BadInput
from daebench.runs.local_flow import enter
from daebench.runs.make_ivp import make_ivp
from daebench.runs.request import Request

# ---- Baumgarte's stabilisation -------------------------------------------------------------------------------------------


def test_baumgarte_draws_the_solution_back_as_a_damped_oscillator():
    where = ivp("spherical-slow")
    off = make_ivp(where.source, "fig1.1", q0=1.005 * where.q0, p0=where.p0 + 0.01 * where.q0)
    t = 0.5
    for alpha, beta in ((10.0, 10.0), (3.0, 8.0)):
        found = run("baumgarte:rk4", off, t / 400, 400, {"alpha": alpha, "beta": beta}, every=0)
        g, Gv = (float(where.value(name, *x)[0]) for name, x in (("g", (found.q[-1],)), ("Gv", (found.p[-1], found.q[-1]))))
        g0, Gv0 = (float(where.value(name, *x)[0]) for name, x in (("g", (off.q0,)), ("Gv", (off.p0, off.q0))))
        A = np.array([[0, 1], [-(beta**2), -2 * alpha]])
        assert error_of(expm(A * t) @ [g0, Gv0], [g, Gv]) < 1e-9
        assert abs(g) < abs(g0) / 3


def test_the_drift_that_grows_without_baumgarte_stays_bounded_with_it():
    grown = {}
    for name in ("rk4", "baumgarte:rk4"):
        found = run(name, "spherical-slow", 0.1, 1200)
        g = np.abs(ivp("spherical-slow").along("g", found.q)[:, 0])
        grown[name] = g[-300:].max() / g[1:301].max()
    assert grown["rk4"] > 3
    assert grown["baumgarte:rk4"] < 1.1


# ---- a stiff penalty -----------------------------------------------------------------------------------------------------


@pytest.mark.sampled(by=("stiff:midpoint-spherical-fast", "stiff:midpoint-stretched-M").__contains__)
@pytest.mark.parametrize("place", ["spherical-fast", "stretched-M", "relativistic"])
@pytest.mark.parametrize("name", ["stiff:midpoint", "stiff:gauss2"])
def test_the_stiff_form_is_integrated_symplectically_with_steps_of_many_periods(name, place):
    where, own = ivp(place), method(name, eps=1e-3)
    assert own.claims.symplectic
    assert own.claims.symmetric
    run(name, where, 0.01, 20, {"eps": 1e-3})
    flow = own.flow(where, 0.01, 5)
    assert symplecticity_defect(flow, where.p0, where.q0, np.eye(2 * where.d)) < 1e-11
    assert reversibility_defect(flow, where.p0, where.q0) < 1e-11


def test_the_stiff_form_tends_to_the_constrained_motion_as_eps_squared():
    where, (q, _) = ivp("spherical-slow"), solution("spherical-slow", 0.5)
    lam = (where.p0 @ where.p0 - where.q0[2]) / 2
    errors, widths, sizes = [], [], (0.04, 0.02, 0.01)
    for eps in sizes:
        at_rest = make_ivp(where.source, "fig1.1", q0=where.q0 * np.sqrt(1 + eps**2 * lam))
        errors.append(error_of(run("stiff:midpoint", at_rest, 0.0025, 200, {"eps": eps}, every=0).q[-1], q))
        widths.append(run("stiff:midpoint", where, 0.0025, 200, {"eps": eps}).maxima["g"])
    for found in (errors, widths):
        assert abs(fit_order(sizes, found).slope - 2) < 0.1, found
    assert np.allclose(widths, [2 * eps**2 * lam for eps in sizes], rtol=0.05)


# ---- local coordinates ---------------------------------------------------------------------------------------------------


def test_local_coordinates_go_round_and_round():
    for place in ("planar", "spherical-fast"):
        assert state_error("local:gauss3", place, 250, 5.0) < 1e-6


def test_a_start_where_the_chart_is_singular_is_refused_with_the_place():
    where = make_ivp(ivp("spherical-slow").source, "fig1.1", q0=[0, 0, -1], p0=[0.1, 0, 0])
    with pytest.raises(BadInput, match="chart of spherical_pendulum is singular at q"):
        method("local:midpoint").solve(where, Request(value=0.01, steps=3))
    run("midpoint", where, 0.01, 3)


def test_a_problem_without_a_chart_refuses_local_coordinates():
    with pytest.raises(BadInput, match="needs a chart"):
        method("local:midpoint").solve(ivp("double-pendulum"), Request(value=0.01, steps=3))
    with pytest.raises(BadInput, match="declares no chart"):
        enter(ivp("double-pendulum"))
