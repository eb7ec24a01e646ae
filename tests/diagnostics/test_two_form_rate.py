"""d(dq ^ dp)/dt = - sum dg ^ dlam on the flow of (1.18): against SciPy's flow and SymPy's derivatives, on the manifold and off it."""

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

from daebench.diagnostics.symplecticity import areas, tangent_basis
from daebench.diagnostics.two_form_rate import two_form_rate
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.problems.double_pendulum import problem

SEED = 7


def reduced(model):
    """Return the index-reduced field (1.18) and the right side - sum dg_i ^ dlam_i of a model, as functions of numbers: SymPy's own."""
    q, p = sp.Matrix(model.q), sp.Matrix(model.p)
    x = sp.Matrix([*p, *q])
    g = sp.Matrix(model.g)
    H = (p.T * sp.Matrix(model.M).inv() * p)[0] / 2 + model.U
    lam = sp.symbols(f"lam:{len(g)}")
    velocity = sp.Matrix([H]).jacobian(p).T
    force = -sp.Matrix([H]).jacobian(q).T - g.jacobian(q).T * sp.Matrix(lam)
    rate = (g.jacobian(q) * velocity).jacobian(q) * velocity + g.jacobian(q) * sp.Matrix(model.M).inv() * force
    size = -rate.jacobian(lam)
    multipliers = size.adjugate() * rate.subs(dict.fromkeys(lam, 0)) / size.det()
    numbers = model.parameters
    field = sp.Matrix([*force.subs(dict(zip(lam, multipliers, strict=True))), *velocity]).subs(numbers)
    dg, dlam = (part.subs(numbers).jacobian(x) for part in (g, multipliers))
    wedge = sum((dg[i, :].T * dlam[i, :] - dlam[i, :].T * dg[i, :] for i in range(len(g))), sp.zeros(len(x)))
    return tuple(sp.lambdify([x], part, cse=True) for part in (field, field.jacobian(x), -wedge))


@pytest.fixture(scope="module")
def double():
    return initial_value_problem("double_pendulum"), *reduced(problem())


def off(ivp, by):
    rng = np.random.default_rng(SEED)
    return ivp.p0 + by * rng.normal(size=ivp.d), ivp.q0 + by * rng.normal(size=ivp.d)


@pytest.mark.parametrize("by", [0.0, 0.05], ids=["on the manifold", "off it"])
def test_rate_is_that_of_the_two_form_along_the_flow(double, by):
    ivp, field, jacobian, wedge = double
    p, q = off(ivp, by)
    X = np.random.default_rng(SEED).normal(size=(2 * ivp.d, 2))
    rate = two_form_rate(ivp, p, q, X)
    assert rate == pytest.approx(X.T @ wedge(np.concatenate([p, q])) @ X, rel=1e-11, abs=1e-11)

    def variation(_, y):
        x, carried = y[: 2 * ivp.d], y[2 * ivp.d :].reshape(-1, 2)
        return np.concatenate([np.ravel(field(x)), np.ravel(jacobian(x) @ carried)])

    s = 1e-3
    ends = [
        solve_ivp(variation, (0, t), np.concatenate([p, q, np.ravel(X)]), method="DOP853", rtol=1e-13, atol=1e-13).y[2 * ivp.d :, -1]
        for t in (-s, s)
    ]
    before, after = (areas(end.reshape(-1, 2)).sum() for end in ends)
    assert rate[0, 1] == pytest.approx((after - before) / (2 * s), rel=1e-4)
    assert abs(rate[0, 1]) > 1


def test_rate_is_zero_on_tangents_of_the_manifold_and_not_across_it(double):
    ivp, *_ = double
    along = tangent_basis(ivp, ivp.p0, ivp.q0)
    assert np.abs(two_form_rate(ivp, ivp.p0, ivp.q0, along)).max() < 1e-12
    across = np.concatenate([np.zeros(ivp.d), ivp.q0])
    assert np.abs(two_form_rate(ivp, ivp.p0, ivp.q0, np.column_stack([along, across]))).max() > 1
