"""The Poisson defect, on maps known to be Poisson or not.

Lotka-Volterra is HLW (2.13): u' = u (v - 2), v' = v (1 - u), H_u = 1 - 1/u, H_v = 1 - 2/v.
"""

import numpy as np
import pytest

from daebench.diagnostics.order import fit_order
from daebench.diagnostics.poisson import poisson_defect

PLACES = [(6.0, 2.0), (0.5, 3.0), (1.0, 1e-3)]


def lotka_volterra(y):
    u, v = y
    return np.array([[0, u * v], [-u * v, 0]])


def symplectic_euler(y, h):
    u, v = y
    u1 = u / (1 - h * (v - 2))
    return np.array([u1, v - h * v * (u1 - 1)])


def adjoint(y, h):
    u, v = y
    v1 = v / (1 + h * (u - 1))
    return np.array([u * (1 + h * (v1 - 2)), v1])


def splitting(y, h):
    u, v = y
    u_half = u * np.exp(h / 2 * (v - 2))
    v1 = v * np.exp(-h * (u_half - 1))
    return np.array([u_half * np.exp(h / 2 * (v1 - 2)), v1])


def midpoint(y, h):
    y1 = np.array(y)
    for _ in range(20):
        u, v = (y + y1) / 2
        f = np.array([u * (v - 2), v * (1 - u)])
        f_y = np.array([[v - 2, u], [-v, 1 - u]])
        y1 = y1 - np.linalg.solve(np.eye(2) - h / 2 * f_y, y1 - y - h * f)
    return y1


@pytest.mark.parametrize("place", PLACES, ids=str)
@pytest.mark.parametrize("step", [symplectic_euler, adjoint, splitting], ids=lambda step: step.__name__)
def test_poisson_maps_have_no_defect(step, place):
    # 64 roundings of the largest entry of B, before or after
    size = max(np.prod(place), np.prod(step(np.array(place), 0.1)))
    assert poisson_defect(lambda y: step(y, 0.1), place, lotka_volterra) < 64 * 2.0**-52 * max(1.0, size)


@pytest.mark.parametrize("place", [(2.0, 2.0), (0.7, 1.2)], ids=str)
def test_implicit_midpoint_is_not_poisson_and_misses_it_by_the_third_power_of_h(place):
    steps = 0.05 * 0.5 ** np.arange(6)
    fit = fit_order(steps, [poisson_defect(lambda y, h=h: midpoint(y, h), place, lotka_volterra) for h in steps])
    assert abs(fit.slope - 3) < 0.03
    assert all(fit.used)


def test_the_defect_of_a_linear_map_is_what_was_planted():
    B = np.array([[0.0, 2.0], [-2.0, 0.0]])
    assert poisson_defect(lambda y: 3.0 * y, [0.3, 0.7], lambda y: B) == pytest.approx(2 * 9 - 2, rel=1e-15)


def test_a_rotation_is_a_poisson_map_of_the_rigid_body_and_a_reflection_is_not():
    def cross(y):
        return np.array([[0, -y[2], y[1]], [y[2], 0, -y[0]], [-y[1], y[0], 0]])

    c, s = np.cos(0.4), np.sin(0.4)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    y = np.array([0.3, -0.8, 0.5])
    assert poisson_defect(lambda y: turn @ y, y, cross) < 1e-15
    assert poisson_defect(lambda y: -turn @ y, y, cross) == pytest.approx(2 * np.max(np.abs(turn @ y)), rel=1e-14)


def test_a_map_that_gives_no_number_has_no_poisson_defect():
    assert np.isnan(poisson_defect(lambda y: y * np.nan, [1.0, 2.0], lotka_volterra))
