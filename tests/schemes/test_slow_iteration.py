"""Newton's iteration where derivatives are left out: slow convergence is followed to its end, and what does not converge is refused."""

import numpy as np
import pytest
from runs import method
from scipy.optimize import root

import daebench.schemes.kernels.newton as kernel
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.request import Request


def ending(rate, wanders=False):
    """Return the report of an iteration whose increments shrink by a rate, or go up and down; in its usual form."""
    sizes = iter(rate**k * (1.0 if not wanders or k % 7 else 3.0) for k in range(1, 10**5))
    return kernel.newton(lambda x, data: (x, next(sizes), 1.0, 1e-16, 1.0), 0.0, None)[1]


@pytest.fixture
def numbers(monkeypatch):
    for name, value in {"EPS": 2.0**-52, "INF": np.inf, "ROUNDINGS": 4.0, "AGAIN": 1, "TANGENTS": False}.items():
        monkeypatch.setattr(kernel, name, value)
    monkeypatch.setattr(kernel, "tally", lambda update, count: count)


@pytest.mark.usefixtures("numbers")
@pytest.mark.parametrize("rate", [0.1, 0.5, 0.77, 0.85, 0.9, 0.95])
def test_an_iteration_that_shrinks_steadily_is_followed_to_round_off(rate):
    report = ending(rate)
    assert report[0] == kernel.OK
    assert rate ** report[3] <= 4 * 2.0**-52 * (1 + 1e-9)


@pytest.mark.usefixtures("numbers")
@pytest.mark.parametrize(("rate", "wanders"), [(1.01, False), (0.999, False), (0.98, True), (1.0, True)], ids=str)
def test_one_that_does_not_is_refused(rate, wanders):
    report = ending(rate, wanders)
    assert report[0] == kernel.NOT_CONVERGED
    assert report[3] == -report[2] == (1000 if rate == 0.999 else 100)


def test_a_symmetric_projection_that_converges_slowly_goes_on():
    pendulum = initial_value_problem("double_pendulum", "horizontal")
    run = method("midpoint+symproj").solve(pendulum, Request(value=0.03, steps=712, every=0, watch=())).complete()
    assert run.steps == 712


# ---- symmetric projections whose corrections overshoot -------------------------------------------------------------------

UNSTABLE = (
    (-1.67295446275683, 1.00965519709478, 6.78055132280678, 1.92949481843808),
    (-0.516707626373469, -0.856161917424207, -0.408534509565809, -1.85029398953541),
)
"""Momenta and positions of a double pendulum, about 12 ms before it is fastest."""


def normals(p, q):
    """Return the derivative of (g, G p) with respect to (p, q) of a double pendulum with masses and lengths 1, twice that of |q|^2 - 1."""
    G, Gv = (np.array([[x[0], x[1], 0 * x[0], 0 * x[0]], [x[0] - x[2], x[1] - x[3], x[2] - x[0], x[3] - x[1]]]) for x in (q, p))
    return np.block([[0 * G, G], [G, Gv]])


def rate(p, q):
    """Return p', q' of the index-reduced pendulum."""
    C = normals(p, q)
    G, Gv, weight = C[:2, 4:], C[2:, 4:], 9.81 * np.array([0, 1, 0, 1])
    return np.concatenate([-weight - G.T @ np.linalg.solve(G @ G.T, Gv @ p - G @ weight), p])


def residual(z, x0, h):
    """Return the residual of the midpoint rule with its symmetric projection, for x1, the four multipliers and the increment."""
    x1, nu, k = z[:8], z[8:12], z[12:]
    shifted, C = x0 + normals(x0[:4], x0[4:]).T @ nu, normals(x1[:4], x1[4:])
    middle = shifted + k / 2
    q, r = x1[4:6], x1[6:] - x1[4:6]
    manifold = [q @ q - 1, r @ r - 1, *(C[2:, :4] @ x1[:4])]
    return np.concatenate([k - h * rate(middle[:4], middle[4:]), x1 - shifted - k - C.T @ nu, manifold])


def derivative(z, x0, h):
    return np.array([residual(z + 1e-30j * e, x0, h).imag for e in np.eye(20)]).T / 1e-30


def continued(x0, h, parts=24):
    """Return x1 on the branch of solutions that begins at h = 0."""
    z = np.concatenate([x0, np.zeros(12)])
    for part in range(1, parts + 1):
        z = root(residual, z, (x0, part * h / parts), jac=derivative, tol=1e-13).x
    z = z - np.linalg.solve(derivative(z, x0, h), residual(z, x0, h))
    assert np.abs(residual(z, x0, h)).max() < 1e-13
    return z[:8]


@pytest.mark.sampled(by=lambda case: case in ("0.026-1.08", "0.03-1.04", "0.032-0.9"))
@pytest.mark.parametrize("faster", [0.9, 1.0, 1.02, 1.04, 1.06, 1.08], ids=str)
@pytest.mark.parametrize("h", [0.026, 0.03, 0.032], ids=str)
def test_a_symmetric_projection_reaches_the_solution_where_corrections_overshoot(faster, h):
    p0, q0 = (np.array(x) for x in UNSTABLE)
    pendulum = initial_value_problem("double_pendulum", "horizontal", p0=faster * p0, q0=q0, project=True)
    x0 = np.concatenate([pendulum.p0, pendulum.q0])
    run = method("midpoint+symproj").solve(pendulum, Request(value=h, steps=1, every=1, watch=())).complete()
    assert np.abs(np.concatenate([run.p[-1], run.q[-1]]) - continued(x0, h)).max() < 1e-12
