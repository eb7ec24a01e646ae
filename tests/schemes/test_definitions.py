"""Steps satisfy the equations that define them, written out for the planar pendulum: H = |p|^2 / 2 + q2 and G(q) = 2 q^T."""

import numpy as np
import pytest
from ivps import ivp
from measures import error_of
from runs import run

H = 0.05
WEIGHT = np.array([0.0, 1.0])


def steps(scheme, **more):
    """Return a run, and the states (p0, q0, p1, q1) before and after each of its steps."""
    found = run(scheme, ivp("planar"), H, 12, **more)
    assert error_of(np.sum(found.q**2, axis=1), 1) < 1e-14
    return found, list(zip(found.p[:-1], found.q[:-1], found.p[1:], found.q[1:], strict=True))


def along(x, q):
    """Return how far a vector is from a multiple of G(q)^T."""
    return abs(x[0] * q[1] - x[1] * q[0])


def symplectic_euler(p0, q0, p1, q1):
    return along((q1 - q0) / H - p0 + H * WEIGHT, q0), along(p1 - (q1 - q0) / H, q1)


def symplectic_euler_adjoint(p0, q0, p1, q1):
    return along((q1 - q0) / H - p0, q0), along(p1 - (q1 - q0) / H + H * WEIGHT, q1)


def implicit_euler(p0, q0, p1, q1):
    return along((q1 - q0) / H - p0 + H * WEIGHT, q1), along(p1 - (q1 - q0) / H, q1)


def rattle(p0, q0, p1, q1):
    half = (q1 - q0) / H
    return along(half - p0 + H / 2 * WEIGHT, q0), along(p1 - half + H / 2 * WEIGHT, q1)


@pytest.mark.parametrize("residuals", [symplectic_euler, symplectic_euler_adjoint, implicit_euler, rattle], ids=lambda x: x.__name__)
def test_a_step_differs_from_free_motion_by_forces_and_normals_alone(residuals):
    for p0, q0, p1, q1 in steps(residuals.__name__)[1]:
        assert max(residuals(p0, q0, p1, q1)) < 1e-12
        assert abs(q1 @ p1) < 1e-14


def test_shake_is_its_recursion_with_its_multipliers_and_a_central_difference():
    found, _ = steps("shake", raw=True)
    t, lam = found.raw["lam_n"]
    assert np.allclose(t[:10], H * np.arange(1, 11))
    for n in range(1, 11):
        q0, q1, q2 = found.q[n - 1 : n + 2]
        assert np.abs((q2 - 2 * q1 + q0) / H**2 + WEIGHT + 2 * q1 * lam[n - 1]).max() < 1e-10
        assert error_of(found.p[n], (q2 - q0) / (2 * H)) < 1e-13


@pytest.mark.parametrize("scheme", ["symplectic_euler", "rattle"])
def test_the_largest_error_of_one_step_is_that_of_the_state_after_it(scheme):
    found = run(scheme, ivp("planar"), H, 1)
    energies = np.sum(found.p**2, axis=1) / 2 + found.q[:, 1]
    assert found.maxima["energy"] == pytest.approx(abs(energies[1] - energies[0]), rel=1e-9)
    assert found.maxima["energy"] > 1e-6


def test_the_energy_momentum_scheme_keeps_h_and_g_where_neither_is_quadratic():
    found = run("energy_momentum", ivp("stretched-M"), 0.1, 20)
    assert found.maxima["energy"] < 1e-13
    assert found.maxima["g"] < 1e-13
