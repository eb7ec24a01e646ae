"""Lifted methods: the discrete Moser-Veselov algorithm of HLW VII.5.3 against its own definition, and what a lifted run reports."""

from dataclasses import replace

import numpy as np
import pytest
from measures import differences, error_of
from poisson_runs import ivp
from refusals import refused
from scipy.linalg import expm

from daebench.diagnostics.poisson import poisson_defect
from daebench.errors import BadInput, RunFailed
from daebench.methods.fixed_step.lifted import Lifted
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.runs.request import Request

BODY = "free_rigid_body"
MOMENTS = np.array([0.6, 0.8, 1.0])
D = np.diag(MOMENTS.sum() / 2 - MOMENTS)


def method(name):
    return Lifted.of(replace(parse(name), compiled=False))


def run(name, h, steps, case=None, **more):
    return method(name).solve(ivp(BODY, case), Request(value=h, steps=steps, **more))


def hat(y):
    return np.array([[0, -y[2], y[1]], [y[2], 0, -y[0]], [-y[1], y[0], 0]])


def vee(Y):
    return np.array([Y[2, 1], Y[0, 2], Y[1, 0]])


def moser_veselov(y, h):
    """Return the next angular momentum: W D - D W^T = h hat(y) for a rotation W, and then hat(y1) = W^T hat(y) W.

    W = exp(hat(w)) by Newton's iteration with differences, from the rotation of the exact motion to first order.
    """
    w = h * y / MOMENTS

    def residual(w):
        W = expm(hat(w))
        return vee(W @ D - D @ W.T) - h * y

    for _ in range(12):
        w = w - np.linalg.solve(differences(residual, w), residual(w))
    W = expm(hat(w))
    return vee(W.T @ hat(y) @ W)


def test_rattle_on_the_rotation_matrix_is_the_discrete_moser_veselov_algorithm():
    found = run("rattle", 0.25, 30).complete()
    y = [ivp(BODY).y0]
    for _ in range(30):
        y.append(moser_veselov(y[-1], 0.25))
    assert error_of(found.y, y) < 1e-13


@pytest.mark.sampled(by=lambda case: case in ("rattle", "rattle/suzuki4", "rk4"))
@pytest.mark.parametrize("name", ["rattle", "lobatto3", "rattle/suzuki4", "symplectic_euler", "rk4", "implicit_euler"])
def test_a_lifted_method_is_a_poisson_map_where_it_claims_to_be(name):
    own, where = method(name), ivp(BODY)
    defect = poisson_defect(own.flow(where, 0.1, 2), where.y0, lambda y: where.value("B", y))
    claimed = name not in ("rk4", "implicit_euler")
    assert own.is_poisson(where) == claimed
    assert own.keeps(where) == (("C",) if claimed else ())
    assert (defect < 1e-14) == claimed
    assert claimed or defect > 1e-8


def test_a_lifted_run_reports_the_system_below_and_the_work_above():
    found, where = run("rattle", 0.1, 6, "middle", every=2), ivp(BODY, "middle")
    assert (found.problem, found.case, found.method, found.maxima_over) == (BODY, "middle", "lifted:rattle", "outputs")
    assert found.parameters == where.parameters
    assert found.t.tolist() == pytest.approx([0, 0.2, 0.4, 0.6])
    assert np.array_equal(found.y[0], where.y0)
    assert (found.steps, list(found.maxima)) == (6, ["energy", "C"])
    assert found.work["newton"] > 6
    energies = (found.y**2 / MOMENTS).sum(axis=1) / 2
    assert found.maxima["energy"] == pytest.approx(error_of(energies, energies[0]), abs=1e-16)


def test_a_run_that_stops_above_says_so_below_with_what_was_computed():
    found = run("rattle", 5.0, 3)
    words = "lifted:rattle on free_rigid_body, case hlw: rattle on rigid_body_rotation, case free"
    with pytest.raises(RunFailed, match=words):
        found.complete()
    assert found.y.shape == (1, 3)
    with pytest.raises(RunFailed, match=words):
        method("rattle").flow(ivp(BODY), 5.0, 1)(ivp(BODY).y0)


def test_what_cannot_be_lifted_is_refused_in_words():
    request, pendulum = Request(value=0.1, steps=2), initial_value_problem("planar_pendulum")
    for name, where in (("rattle", ivp("lotka_volterra")), ("strang", ivp(BODY)), ("rattle", pendulum)):
        with pytest.raises(BadInput, match=f"lifted:{name}.* {where.problem}"):
            method(name).check(where, request)
    for code, change in (
        ("poisson-lacks-request", {"multipliers": True}),
        ("poisson-has-no-constraints", {"watch": ("manifold",)}),
        ("run-without-steps", {"steps": 0}),
    ):
        with refused(code):
            method("rattle").check(ivp(BODY), replace(request, **change))
    with refused("lifted-needs-fixed-step"):
        Lifted.of(parse("ida:index2"))
    flat = initial_value_problem(BODY, None, {"I1": 0.4, "I2": 0.6, "I3": 1.0})
    assert "not finite" in method("rattle").refusal(flat)
