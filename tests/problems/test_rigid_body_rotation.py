"""The rotation matrix of a rigid body against Euler's equations written out by hand, published numbers, and its chart."""

import numpy as np
import pytest
from integrating import by_dop853
from measures import error_of

from daebench.diagnostics.manifold import constraint_jacobian
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.solvers.scipy_ode import ScipyOde
from daebench.runs.local_flow import enter, leave
from daebench.runs.request import Request

CASES = ("free", "heavy_top")


def ivp(case, **parameters):
    return initial_value_problem("rigid_body_rotation", case, parameters)


def hat(w):
    return np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])


def numbers(where):
    values = where.parameters
    return np.array([values[f"I{k}"] for k in (1, 2, 3)]), values["mass"] * values["gravity"] * np.array(
        [values[f"r{k}"] for k in (1, 2, 3)]
    )


def body(p, q):
    """Return the angular momentum in the body."""
    Y = q.reshape(3, 3).T @ p.reshape(3, 3)
    return np.array([Y[2, 1] - Y[1, 2], Y[0, 2] - Y[2, 0], Y[1, 0] - Y[0, 1]])


def euler(where, t):
    """Return Q and omega at the times t: Q' = Q hat(omega), I omega' = I omega x omega + Gamma x (mass gravity r), Gamma the third row."""
    moments, weight = numbers(where)

    def f(_, x):
        Q, w = x[:9].reshape(3, 3), x[9:]
        return np.concatenate([(Q @ hat(w)).ravel(), (np.cross(moments * w, w) + np.cross(Q[2], weight)) / moments])

    x0 = np.concatenate([where.q0, body(where.p0, where.q0) / moments])
    return np.split(by_dop853(f, x0, t), [9], axis=1)


def test_the_free_body_starts_as_eulers_and_the_top_with_the_published_energy():
    free, top = ivp("free"), ivp("heavy_top")
    assert error_of(body(free.p0, free.q0), [np.cos(1.1), 0, np.sin(1.1)]) < 1e-15
    assert error_of(body(top.p0, top.q0) / numbers(top)[0], [0, 150, -4.61538]) < 1e-13
    assert float(top.value("H", top.p0, top.q0)) == pytest.approx(5435.696790865546875, rel=1e-15)


@pytest.mark.sampled(left_out=("free",))
@pytest.mark.parametrize(("case", "t"), [("free", 1.0), ("heavy_top", 0.04)], ids=CASES)
def test_the_constrained_motion_is_that_of_eulers_equations(plain_functions, case, t):
    where = ivp(case)
    found = ScipyOde("DOP853").solve(where, Request(value=1e-11, t_end=t, points=3)).complete()
    Q, w = euler(where, found.t)
    assert error_of(found.q, Q) < 1e-8
    moments = numbers(where)[0]
    D = np.diag(moments.sum() / 2 - moments)
    P = np.array([(q.reshape(3, 3) @ hat(each) @ D).ravel() for q, each in zip(Q, w, strict=True)])
    assert error_of(found.p, P) < 1e-8 * np.abs(P).max()


# ---- the chart -----------------------------------------------------------------------------------------------------------


@pytest.mark.sampled(left_out=("free",))
@pytest.mark.parametrize("case", CASES)
def test_the_chart_leads_to_the_manifold_and_back(case, random):
    where = ivp(case)
    for _ in range(2):
        eta, xi = random.uniform(-2, 2, 3), random.uniform(-1.4, 1.4, 3)
        p, q = leave(where)(eta, xi)
        again = enter(where)(p, q)
        assert error_of(np.concatenate([*again]), np.concatenate([eta, xi])) < 1e-13
        Q, P = np.array(q).reshape(3, 3), np.array(p).reshape(3, 3)
        assert error_of(Q.T @ Q, np.eye(3)) < 1e-15
        assert np.linalg.det(Q) == pytest.approx(1)
        moments = numbers(where)[0]
        assert error_of(P, Q @ hat(eta) @ np.diag(moments.sum() / 2 - moments)) < 1e-13
        C = constraint_jacobian(where, P.reshape(1, 9), Q.reshape(1, 9))[0]
        assert np.linalg.matrix_rank(C) == 12
