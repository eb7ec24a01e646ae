"""The Poisson problems are those of the books: their equations typed out by hand, their exact motion, their published facts."""

from fractions import Fraction
from itertools import permutations

import mpmath as mp
import numpy as np
import pytest
import sympy as sp

from daebench.problems import free_rigid_body, heavy_top_lie_poisson, lotka_volterra, lotka_volterra_3d

BODY = {"I1": 0.7, "I2": 1.9, "I3": 1.3}
TOP = {"I1": 1.7, "I2": 0.9, "I3": 2.3, "mass": 1.2, "gravity": 9.81, "r1": 0.2, "r2": -0.5, "r3": 0.7}


def values_of(system, expression, y, parameters=None):
    """Return an expression or matrix of a system at a state, with the system's parameters or others by name."""
    known = {symbol: (parameters or {}).get(symbol.name, value) for symbol, value in system.parameters.items()}
    names = [*system.y, *known]
    return np.array(sp.lambdify(names, expression, "numpy")(*y, *known.values()), dtype=float)


def field(system, y):
    H_y = sp.Matrix([system.H]).jacobian(list(system.y)).T
    return values_of(system, (system.B * H_y).tolist(), y).ravel()


def start(system, name):
    case = system.cases[name]
    known = {symbol: case.parameters.get(symbol.name, value) for symbol, value in system.parameters.items()}
    return [sp.sympify(component).subs(known) for component in case.y]


# ---- the equations -------------------------------------------------------------------------------------------------------


def lotka_volterra_by_hand(y, a=1.0, b=2.0):
    u, v = y
    return [u * (v - b), v * (a - u)]


def three_species_by_hand(y):
    y1, y2, y3 = y
    return [y1 * (y2 + y3), y2 * (y1 - y3 + 1), y3 * (y1 + y2 + 1)]


def body_by_hand(y, I1, I2, I3):
    y1, y2, y3 = y
    return [(1 / I3 - 1 / I2) * y2 * y3, (1 / I1 - 1 / I3) * y3 * y1, (1 / I2 - 1 / I1) * y1 * y2]


def top_by_hand(state, I1, I2, I3, mass, gravity, r1, r2, r3):
    y, Gamma = state[:3], state[3:]
    omega = np.array(y) / [I1, I2, I3]
    return [*(np.cross(y, omega) + mass * gravity * np.cross(Gamma, [r1, r2, r3])), *np.cross(Gamma, omega)]


@pytest.mark.parametrize(
    ("module", "parameters", "by_hand"),
    [
        (lotka_volterra, {}, lotka_volterra_by_hand),
        (lotka_volterra, {"a": 0.7, "b": 1.6}, lotka_volterra_by_hand),
        (lotka_volterra_3d, {}, three_species_by_hand),
        (free_rigid_body, BODY, body_by_hand),
        (heavy_top_lie_poisson, TOP, top_by_hand),
    ],
    ids=["HLW (2.13)", "with parameters", "HLW (2.14)", "Euler", "heavy top"],
)
def test_the_field_is_that_of_the_published_equations(module, parameters, by_hand, random):
    system = module.problem(**parameters)
    for _ in range(5):
        y = random.uniform(0.2, 2, system.n)
        np.testing.assert_allclose(field(system, y), by_hand(y, **parameters), rtol=1e-13, atol=1e-13)


# ---- Lotka-Volterra ------------------------------------------------------------------------------------------------------


def test_the_strang_splitting_of_lotka_volterra_is_the_printed_method():
    """HLW (4.6) with K_u = 1 - 1/u, L_v = 1 - 2/v, step by step."""
    system, h = lotka_volterra.problem(), 0.25
    u, v = 4.0, 2.5
    u_half = np.exp(h / 2 * v * (1 - 2 / v)) * u
    v1 = np.exp(-h * u_half * (1 - 1 / u_half)) * v
    u1 = np.exp(h / 2 * v1 * (1 - 2 / v1)) * u_half
    first, second = system.splittings["LK"]
    state = (u, v)
    for name, step in ((first, h / 2), (second, h), (first, h / 2)):
        part = system.parts[name]
        state = values_of(system, [sp.sympify(component).subs(part.t, step) for component in part.y], state)
    np.testing.assert_allclose(state, [u1, v1], rtol=1e-14)


# ---- the free rigid body -------------------------------------------------------------------------------------------------


AXES = ((1, 2), (2, 0), (0, 1))


def taylor(y, moments, t, order=42):
    """Return the solution of Euler's equations at time t by Taylor series of the quadratic field, in mpmath numbers.

    The steps are a small part of the radius of convergence, which is some 1/|y| for the moments used here.
    """
    rates = [1 / moments[k] - 1 / moments[j] for j, k in AXES]
    steps = int(mp.ceil(abs(t) * 4 * mp.norm(y, 1))) or 1
    for _ in range(steps):
        series = [[component] for component in y]
        for n in range(order):
            products = [mp.fdot(series[j], series[k][::-1]) / (n + 1) for j, k in AXES]
            for row, rate, product in zip(series, rates, products, strict=True):
                row.append(rate * product)
        y = [mp.polyval(row[::-1], t / steps) for row in series]
    return y


THREE = ("0.6", "0.8", "1.0")
ORDERS = list(permutations(range(3)))
ORDER_IDS = ["".join(str(i + 1) for i in order) for order in ORDERS]
STATES = {
    "hlw": (mp.cos(mp.mpf("1.1")), 0, mp.sin(mp.mpf("1.1"))),
    "about 1": ("0.9", "-0.3", "-0.2"),
    "about -1": ("-0.9", "0.1", "0.4"),
    "about 3": ("0.1", "-0.05", "1"),
    "about -3": ("0.1", "0.3", "-1"),
    "near middle": ("-0.001", "0.9", "0.0015"),
    "near -middle": ("0.001", "-0.9", "0.0015"),
    "plane 23": ("0", "0.7", "0.7"),
    "plane 12": ("0.7", "0.7", "0"),
    "fast": ("8", "-9", "7"),
}


def exact(numbers):
    return [mp.mpf(number) for number in numbers]


def check(y0, moments, t):
    parameters = dict(zip(("I1", "I2", "I3"), moments, strict=True))
    found = free_rigid_body.closed_form(t, y0, parameters)
    for a, b in zip(found, taylor(y0, moments, t), strict=True):
        assert abs(a - b) < mp.mpf("1e-30") * (1 + max(map(abs, y0)))


@pytest.mark.usefixtures("forty_digits")
@pytest.mark.parametrize("order", ORDERS, ids=ORDER_IDS)
def test_the_closed_form_solves_eulers_equations_in_every_order_of_the_moments(order):
    """Each state in two orders, one of them run backwards."""
    for k, state in enumerate(STATES):
        if (k - ORDERS.index(order)) % 3 == 0:
            t = "0.2" if state == "fast" else ("1.3", "-0.7")[ORDERS.index(order) // 3]
            check(exact(STATES[state]), [exact(THREE)[i] for i in order], mp.mpf(t))


@pytest.mark.usefixtures("forty_digits")
@pytest.mark.parametrize("moments", [(1, 1, 2), (2, 2, 1), (1, 2, 1), (2, 1, 1), (1, 2, 2), (1, 1, 1)], ids=str)
def test_the_closed_form_holds_for_equal_moments(moments):
    for state in ("hlw", "about -1", "about 3", "near -middle", "plane 12"):
        check(exact(STATES[state]), exact(moments), mp.mpf("0.6"))


@pytest.mark.usefixtures("forty_digits")
@pytest.mark.sampled(by=("(1, 1)-123", "(-1, 1)-132", "(1, -1)-231").__contains__)
@pytest.mark.parametrize("order", ORDERS, ids=ORDER_IDS)
@pytest.mark.parametrize("signs", [(1, 1), (1, -1), (-1, 1), (-1, -1)], ids=str)
def test_the_closed_form_holds_on_and_around_the_separatrix(signs, order):
    """From the separatrix itself, and from 1e-25 to either side of it."""
    moments = exact(THREE)
    e = [1 / moment for moment in moments]
    for aside, t in ((0, "1.9"), (0, "-1.9"), ("1e-25", "1.3"), ("-1e-25", "-1.3")):
        y = [signs[0] * mp.sqrt(e[1] - e[2]) + mp.mpf(aside), mp.mpf("0.4"), signs[1] * mp.sqrt(e[0] - e[1])]
        check([y[i] for i in order], [moments[i] for i in order], mp.mpf(t))


@pytest.mark.sampled(left_out=("('1e-30', '1', '-3e-30')",))
@pytest.mark.parametrize("y0", [("1e-30", "1", "-3e-30"), ("0", "-1", "1e-200")], ids=str)
def test_the_closed_form_holds_however_close_to_the_unstable_axis(y0):
    """At mpmath's 15 digits, each component to its own size, after it has grown by e^12."""
    y0, moments = exact(y0), exact(THREE)
    found = free_rigid_body.closed_form(30, y0, dict(zip(("I1", "I2", "I3"), moments, strict=True)))
    with mp.workdps(60):
        expected = taylor(y0, moments, mp.mpf(30), order=60)
    for a, b in zip(found, expected, strict=True):
        assert abs(a - b) <= mp.mpf("1e-13") * abs(b)


@pytest.mark.parametrize("sign", [1, -1], ids=["to +2", "to -2"])
def test_exactly_on_the_separatrix_a_motion_ends_on_the_middle_axis(sign):
    """With moments 3, 4, 6 it is |y1| = |y3|, and to be told from its neighbourhood for ever."""
    y = free_rigid_body.closed_form(1e4, (1.0, 0.5, sign * 1.0), {"I1": 3.0, "I2": 4.0, "I3": 6.0})
    assert y[1] == sign * mp.mpf("1.5")
    assert 0 < y[0] < mp.mpf("1e-300")


def test_next_to_the_separatrix_a_motion_is_on_the_side_its_start_is_on(random):
    """States rounded from the separatrix: exact fractions tell which of y1 and y3 never changes its sign, and the other one does."""
    for _ in range(6):
        moments = random.uniform([0.5, 0.9, 1.4], [0.7, 1.1, 1.6]).tolist()
        e1, e2, e3 = (1 / Fraction(moment) for moment in moments)
        y0 = [float(e2 - e3) ** 0.5, 0.3, float(e1 - e2) ** 0.5]
        S = (e1 - e2) * Fraction(y0[0]) ** 2 - (e2 - e3) * Fraction(y0[2]) ** 2
        assert 0 < abs(S) < 1e-14
        parameters = dict(zip(("I1", "I2", "I3"), moments, strict=True))
        path = [free_rigid_body.closed_form(t, y0, parameters) for t in range(0, 1000, 40)]
        kept, other = (0, 2) if S > 0 else (2, 0)
        assert all(y[kept] > 0 for y in path)
        assert len({y[other] > 0 for y in path}) == 2


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_steady_rotations_stay_to_the_last_digit(axis):
    y0 = [0.0, 0.0, 0.0]
    y0[axis] = -1.5
    assert free_rigid_body.closed_form(1000, y0, dict(zip(("I1", "I2", "I3"), map(float, THREE), strict=True))) == y0
    assert free_rigid_body.closed_form(7, [0, 0, 0], BODY) == [0, 0, 0]


def test_the_separatrix_case_is_on_the_separatrix():
    system = free_rigid_body.problem()
    moments = sp.symbols("I1:4", positive=True)
    at = dict(zip(system.y, system.cases["separatrix"].y, strict=True))
    assert sp.simplify(2 * moments[1] * system.H.subs(at) - 1) == 0
    assert sp.simplify(2 * system.casimirs["C"].subs(at) - 1) == 0


# ---- the lift to rotation matrices ---------------------------------------------------------------------------------------


def test_the_lift_is_tangent_has_the_energy_of_the_body_and_leads_back(random):
    """Q^T Q' is skew-symmetric and 1/2 tr(Q' D Q'^T) = H(y), with Q' = P D^-1."""
    system = free_rigid_body.problem(**BODY)
    D = sum(BODY.values()) / 2 - np.array(list(BODY.values()))
    for y in random.normal(size=(5, 3)):
        p, q = (values_of(system, list(part), y) for part in (system.lift.p, system.lift.q))
        np.testing.assert_allclose(system.lift.y(p, q, BODY), y, rtol=1e-14, atol=1e-15)
        rate, turned = p.reshape(3, 3) / D, q.reshape(3, 3).T @ (p.reshape(3, 3) / D)
        np.testing.assert_allclose(turned, -turned.T, atol=1e-15)
        assert np.trace(rate @ np.diag(D) @ rate.T) / 2 == pytest.approx(float(values_of(system, system.H, y)), rel=1e-14)


# ---- the heavy top -------------------------------------------------------------------------------------------------------


def test_the_heavy_top_has_the_published_energy():
    system = heavy_top_lie_poisson.problem()
    at = dict(zip(system.y, start(system, "heavy_top"), strict=True))
    assert float(system.H.subs(at).subs(system.parameters)) == pytest.approx(5435.696790865546875, rel=1e-15)


def rate_of(name, integral):
    """Return {integral(y, Gamma), H} with the parameters of a case, expanded."""
    system = heavy_top_lie_poisson.problem()
    known = {symbol: sp.nsimplify(system.cases[name].parameters.get(symbol.name, value)) for symbol, value in system.parameters.items()}
    F = integral(*system.y)
    H_y, F_y = (sp.Matrix([G]).jacobian(list(system.y)) for G in (system.H, F))
    return sp.expand((F_y * system.B * H_y.T)[0].subs(known))


@pytest.mark.parametrize(("top", "other"), [("lagrange", "kovalevskaya"), ("kovalevskaya", "lagrange")])
def test_each_top_keeps_the_integral_that_it_is_named_for(top, other):
    integral = kovalevskaya if top == "kovalevskaya" else lambda y1, y2, y3, *_: y3
    assert rate_of(top, integral) == 0
    assert rate_of(other, integral) != 0


def kovalevskaya(y1, y2, _y3, Gamma1, Gamma2, _Gamma3):
    """Return |(omega1 + i omega2)^2 - 2 (Gamma1 + i Gamma2)|^2 for unit moments I1 = I2 and unit weight."""
    return (y1**2 - y2**2 - 2 * Gamma1) ** 2 + 4 * (y1 * y2 - Gamma2) ** 2
