"""Every formulation of every kind of problem, uncompiled, against equations of motion written by hand; and planted faults."""

import dataclasses

import numpy as np
import pytest
from ivps import ivp, swept
from measures import derivative_defect, error_of, jacobian_defect, multiplier_defect, residual, right_side, somewhere, start_defect
from oracles import solution
from refusals import refused

from daebench.compiler.definition import source_of
from daebench.errors import DaebenchError
from daebench.methods.formulations.constrained import FORMULATIONS, pose
from daebench.methods.solvers.ida import Ida
from daebench.runs.make_ivp import make_ivp
from daebench.runs.request import Request

pytestmark = pytest.mark.usefixtures("plain_functions")

POSED = [(f, "plain") for f in FORMULATIONS] + [(f, "derivative") for f in FORMULATIONS if f != "ode"]
POSED_IDS = ["-".join(posed) for posed in POSED]
OTHERS, INDEX3 = 1e-4, 2e-2
"""Bounds of the state error at t = 2 and tol = 1e-8, about three times the worst that was measured: on spherical-fast, where p is 7."""

TOLERANCES = {"double_wishbone": 1e-11}
"""Where the motion amplifies errors more, so that these bounds do not hold at 1e-8: p is 32 there, and index 3 is off by 0.67."""


@pytest.fixture(params=FORMULATIONS, ids=FORMULATIONS)
def formulation(request):
    return request.param


@pytest.fixture(params=POSED, ids=POSED_IDS)
def posed(request):
    return request.param


def state_error(name, formulation, tol=1e-8):
    trajectory = Ida(formulation).solve(ivp(name), Request(value=tol, t_end=2.0, points=3, watch=())).complete()
    q, p = solution(name, 2.0)
    return max(error_of(trajectory.q[-1], q), error_of(trajectory.p[-1], p))


# ---- the sweep -----------------------------------------------------------------------------------------------------------


def covering(case):
    """Return whether the gate takes a problem in a formulation: one problem in all, and four in those with most in them."""
    if case.startswith(("stretched-M", "relativistic")):
        return case.endswith(("ggl-derivative", "index1-plain", "baumgarte-plain", "ode-plain"))
    return case.startswith("spherical-fast") or (case.endswith("ggl-derivative") and case.startswith(("slider_crank", "torus")))


@pytest.mark.sampled(by=covering)
def test_residual_vanishes_at_the_start(each_ivp, posed):
    assert start_defect(pose(each_ivp, posed[0], multipliers=posed[1])) < 1e-13


@pytest.mark.sampled(by=covering)
def test_multiplier_at_the_start_is_that_of_the_hidden_constraint(each_ivp, posed):
    if posed[0] != "ode":
        assert multiplier_defect(pose(each_ivp, posed[0], multipliers=posed[1])) < 1e-14


@pytest.mark.sampled(by=covering)
def test_jacobian_is_the_derivative_of_the_residual(each_ivp, posed):
    assert jacobian_defect(pose(each_ivp, posed[0], multipliers=posed[1])) < 1e-10


@pytest.mark.sampled(by=lambda case: case in ("stretched-M", "relativistic", "torus"))
def test_right_side_of_the_ode_has_the_jacobian_that_is_claimed(each_ivp):
    dae = pose(each_ivp, "ode")
    y, _ = somewhere(dae)
    JJ = np.full((dae.n, dae.n), np.nan)
    dae.rhs_jacobian(0.0, y, JJ, dae.par)
    assert derivative_defect(lambda x: right_side(dae, x), y, JJ) < 1e-10


@pytest.mark.sampled(by=lambda case: "spherical-fast" in case or case in ("ggl-slider_crank", "ggl-torus"))
@pytest.mark.parametrize("name", swept())
def test_ida_follows_the_motion_written_by_hand(name, formulation):
    assert state_error(name, formulation, TOLERANCES.get(name, 1e-8)) < (INDEX3 if formulation == "index3" else OTHERS)


def test_mass_matrix_and_hamiltonian_give_the_same_motion(formulation):
    request = Request(value=1e-10, t_end=2.0, points=5)
    one, other = (Ida(formulation).solve(ivp(name), request).complete() for name in ("stretched-M", "stretched-H"))
    bound = 5e-6 if formulation == "index3" else 1e-7
    assert max(error_of(one.q, other.q), error_of(one.p, other.p)) < bound


# ---- what the record holds -----------------------------------------------------------------------------------------------


@pytest.mark.sampled(by=lambda case: case in ("stretched-M", "relativistic", "torus"))
def test_momenta_of_the_start_come_back(each_ivp):
    dae = pose(each_ivp, "ggl")
    q, p = dae.unpack(dae.y0[None])
    assert np.array_equal(q[0], each_ivp.q0)
    assert np.allclose(dae.momenta(q, p)[0], each_ivp.p0, rtol=0, atol=1e-14 * np.abs(each_ivp.p0).max())


def baumgarte_defect():
    """Return the error of the rows that Baumgarte's numbers, each 10, add to index 1: 20 G v + 100 g."""
    index1, default = (pose(ivp("coupled-rods"), name) for name in ("index1", "baumgarte"))
    y, yp = somewhere(index1)
    q, v = y[: index1.d], y[index1.d : 2 * index1.d]
    added = 20 * index1.ivp.value("G", q) @ v + 100 * index1.ivp.value("g", q)
    return error_of((residual(default, y, yp) - residual(index1, y, yp))[-2:], added) / np.abs(added).max()


def test_baumgarte_adds_both_constraints_to_the_hidden_one():
    assert baumgarte_defect() < 1e-14


def test_baumgarte_numbers_are_run_time_data():
    weak, default = (pose(ivp("coupled-rods"), "baumgarte", options) for options in ({"alpha": 0, "beta": 0}, None))
    index1 = pose(ivp("coupled-rods"), "index1")
    y, yp = somewhere(index1)
    assert weak.module is default.module
    assert np.allclose(residual(weak, y, yp), residual(index1, y, yp), rtol=0, atol=1e-13)


def test_unknown_names_are_refused_with_the_nearest():
    with refused("unknown-name", name="indx2", says=("index2",)):
        pose(ivp("planar"), "indx2")
    with refused("unknown-name", name="alpha", says=("index1",)):
        pose(ivp("planar"), "index1", {"alpha": 1.0})
    with refused("number-negative-or-infinite"):
        pose(ivp("planar"), "baumgarte", {"alpha": -1.0})


def changed(**parts):
    problem = dataclasses.replace(ivp("spherical-slow").source.define(), **parts)
    return make_ivp(source_of(problem, "changed"), "fig1.1")


def test_redundant_constraints_and_a_massless_coordinate_are_errors_at_the_start(formulation):
    definition = ivp("spherical-slow").source.define()
    g, M = definition.g[0], definition.M.copy()
    with refused("constraints-dependent", kind=DaebenchError):
        pose(changed(g=[g, 3 * g], chart=None), formulation)
    M[0, 0] = 0
    with refused("mass-matrix-singular", kind=DaebenchError):
        pose(changed(M=M), formulation)
