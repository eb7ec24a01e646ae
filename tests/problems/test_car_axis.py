"""The car axis against the published end of its motion, and against the right side of the test set written by hand."""

import numpy as np
import pytest
import sympy as sp
from measures import error_of
from published import CAR_AXIS_LAM, CAR_AXIS_Q, CAR_AXIS_V

from daebench.diagnostics.nearby import rates
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.reference.solution import reference_solution

OTHERS = {"epsilon": 0.3, "mass": 2.0, "length": 1.3, "rest_length": 0.4, "height": 0.2, "frequency": 3.0, "gravity": 9.81}
MASS = 10 * 0.01**2 / 2


def wheel(t, L, r, w):
    """Return the place, the velocity and the acceleration of the right wheel, by hand."""
    yb, yb1, yb2 = r * np.sin(w * t), r * w * np.cos(w * t), -r * w**2 * np.sin(w * t)
    xb = np.sqrt(L**2 - yb**2)
    xb1 = -yb * yb1 / xb
    return np.array([[xb, yb], [xb1, yb1], [-(yb1**2 + yb * yb2 + xb1**2) / xb, yb2]])


def published_rates(t, q, v, lam, epsilon, mass, length, rest_length, height, frequency, gravity):
    """Return k v' of the test set, with its sign of the multipliers."""
    xl, yl, xr, yr = q
    (xb, yb), *_ = wheel(t, length, height, frequency)
    left, right = np.hypot(xl, yl), np.hypot(xr - xb, yr - yb)
    weight = mass * epsilon**2 / 2 * gravity
    return [
        (rest_length - left) * xl / left + lam[0] * xb + 2 * lam[1] * (xl - xr),
        (rest_length - left) * yl / left + lam[0] * yb + 2 * lam[1] * (yl - yr) - weight,
        (rest_length - right) * (xr - xb) / right - 2 * lam[1] * (xl - xr),
        (rest_length - right) * (yr - yb) / right - 2 * lam[1] * (yl - yr) - weight,
    ]


def placed(t, s, phi, s_rate, phi_rate, L, r, w):
    """Return positions and velocities that keep both constraints: the left spring's length and the axle's angle, and their rates."""
    (xb, yb), (xb1, yb1), _ = wheel(t, L, r, w) / L
    up, up_rate = np.array([-yb, xb]), np.array([-yb1, xb1])
    along, across = np.array([np.cos(phi), np.sin(phi)]), np.array([-np.sin(phi), np.cos(phi)])
    left, left_rate = s * up, s_rate * up + s * up_rate
    return np.concatenate([left, left + L * along]), np.concatenate([left_rate, left_rate + L * phi_rate * across])


@pytest.mark.parametrize("parameters", [{}, OTHERS], ids=["declared", "others"])
def test_the_car_axis_moves_as_the_test_set_says(parameters, random):
    where = initial_value_problem("car_axis", "bari", parameters)
    at = where.parameters
    size = at["length"], at["height"], at["frequency"]
    mass = at["mass"] * at["epsilon"] ** 2 / 2
    for t, s, phi, s_rate, phi_rate in random.uniform(0.3, 1.0, (4, 5)):
        q, v = placed(t, s, phi, s_rate, phi_rate, *size)
        state = np.append(mass * v, 0.0), np.append(q, t)
        assert np.abs(where.value("g", state[1])).max() < 1e-14
        assert np.abs(where.value("Gv", *state)).max() < 1e-13
        p_rate, q_rate = rates(where, *state)
        lam = where.value("lam", *state)
        assert error_of(q_rate, [*v, 1]) < 1e-14
        assert error_of(p_rate[:4], published_rates(t, q, v, -lam, **at)) < 1e-13 * np.abs(p_rate).max()


def test_the_car_axis_ends_where_the_test_set_says():
    where = initial_value_problem("car_axis", "bari")
    states = reference_solution(where, [3.0]).states
    assert error_of(states["q"][-1, :4], CAR_AXIS_Q) < 3e-13
    assert error_of(states["p"][-1, :4] / MASS, CAR_AXIS_V) < 5e-12
    assert np.abs(states["lam"][-1] + CAR_AXIS_LAM).max() < 1e-13


def test_the_energy_of_the_axle_is_what_the_moving_wheel_has_put_in():
    """Power of the wheel: the right spring pulls at it, and the first constraint with lam1 (xl xb + yl yb) does where it is moved."""
    where = initial_value_problem("car_axis", "bari")
    nodes, weights = np.polynomial.legendre.leggauss(24)
    t, part = (nodes + 1) / 10, weights / 10
    exact = reference_solution(where, [*t, 0.2])
    q, power = exact.states["q"], []
    for time, (xl, yl, xr, yr, _), lam in zip(t, q, exact.states["lam"], strict=False):
        place, rate, _ = wheel(time, 1.0, 0.1, 10.0)
        gap = place - [xr, yr]
        length = np.linalg.norm(gap)
        power.append(((length - 0.5) * gap / length + lam[0] * np.array([xl, yl])) @ rate)
    assert -exact.states["p"][-1, 4] == pytest.approx(part @ power, rel=1e-9)


def test_the_chart_of_the_car_axis_is_a_length_and_an_angle(random):
    where = initial_value_problem("car_axis", "bari", OTHERS)
    declared = where.source.define()
    chart = declared.chart
    values = {symbol: where.parameters[str(symbol)] for symbol in declared.parameters}
    mass = OTHERS["mass"] * OTHERS["epsilon"] ** 2 / 2
    size = OTHERS["length"], OTHERS["height"], OTHERS["frequency"]
    forth = sp.lambdify([declared.t, *chart.xi, *chart.eta], [x.subs(values) for x in (*chart.q, *chart.p)])
    for t, *y in random.uniform(-1, 1, (4, 5)):
        q, v = placed(t, *y, *size)
        assert error_of(np.array(forth(t, *y)), [*q, *(mass * v)]) < 1e-14
        state = {declared.t: t} | dict(zip([*declared.q, *declared.p], [*q, *(mass * v)], strict=True))
        back = [float(x.subs(values).subs(state)) for x in (*chart.inverse_xi, *chart.inverse_eta)]
        assert error_of(np.array(back), y) < 1e-12
