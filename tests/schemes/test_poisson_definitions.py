"""Maps of schemes for Poisson systems: what they tend to, what undoes them, and areas, on the equations of Lotka and Volterra."""

import numpy as np
import pytest
from poisson_runs import ivp, method

Y = np.array([1.3, 2.4])
SCHEMES = ("explicit_euler", "lie", "lie_adjoint", "midpoint", "rk4", "strang", "symplectic_euler", "symplectic_euler_adjoint", "verlet")


def field(u, v):
    return np.array([u * (v - 2), v * (1 - u)])


def after(scheme, h, y=Y):
    return np.real(np.asarray(method(scheme).flow(ivp("lotka_volterra"), h, 1)(np.array(y))))


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_small_step_is_that_of_the_field(scheme):
    assert np.abs(after(scheme, 1e-4) - Y - 1e-4 * field(*Y)).max() < 1e-7


ADJOINT = {
    "midpoint": "midpoint",
    "strang": "strang",
    "verlet": "verlet",
    "lie_adjoint": "lie",
    "symplectic_euler_adjoint": "symplectic_euler",
}


@pytest.mark.parametrize("scheme", ADJOINT)
def test_a_step_is_undone_by_the_adjoint_the_other_way(scheme):
    assert after(ADJOINT[scheme], -0.2, after(scheme, 0.2)) == pytest.approx(Y, abs=1e-13)


@pytest.mark.parametrize("scheme", ["lie", "lie_adjoint", "strang", "symplectic_euler", "symplectic_euler_adjoint", "verlet"])
def test_areas_over_u_v_are_kept(scheme):
    step = 1e-5 * np.eye(2)
    derivative = np.stack([(after(scheme, 0.2, Y + s) - after(scheme, 0.2, Y - s)) / 2e-5 for s in step], axis=1)
    assert np.linalg.det(derivative) == pytest.approx(np.prod(after(scheme, 0.2)) / np.prod(Y), rel=1e-8)


def test_the_midpoint_rule_has_the_field_in_the_middle():
    y1 = after("midpoint", 0.2)
    assert y1 - Y == pytest.approx(0.2 * field(*(y1 + Y) / 2), rel=1e-13)
