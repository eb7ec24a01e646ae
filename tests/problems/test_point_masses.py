"""Point masses on rods and surfaces, and butane, against their equations of motion written out by hand and against closed forms."""

from functools import cache
from importlib import import_module

import numpy as np
import pytest
import sympy as sp
from integrating import by_dop853
from measures import error_of
from scipy.special import ellipe

from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.reference.solution import integrated
from daebench.runs.request import Request

pytestmark = pytest.mark.usefixtures("plain_functions")

PROBLEMS = ("double_spherical_pendulum", "two_bodies_on_sphere", "ellipsoid_geodesic", "torus", "butane")
AXES = np.array([1.8, 1.5, 0.7])


@cache
def definition(name):
    return import_module(f"daebench.problems.{name}").problem()


def numbers(name, expressions, arguments, **values):
    """Return expressions as a function of their arguments, with the default parameters unless others are given."""
    at = {s: sp.Rational(repr(values.get(str(s), value))) for s, value in definition(name).parameters.items()}
    return sp.lambdify(arguments, [sp.sympify(x).subs(at) for x in expressions], modules="numpy", cse=True)


# ---- motions in minimal coordinates ----------------------------------------------------------------------------------------


def direction(a, b):
    """Return n = (cos b cos a, cos b sin a, sin b), its derivatives by a and b, and those of second order by aa, ab, bb."""
    (ca, sa), (cb, sb), zero = (np.cos(a), np.sin(a)), (np.cos(b), np.sin(b)), 0 * a
    return (
        np.array([cb * ca, cb * sa, sb]),
        np.array([[-cb * sa, -sb * ca], [cb * ca, -sb * sa], [zero, cb]]),
        np.array([[-cb * ca, sb * sa, -cb * ca], [-cb * sa, -sb * ca, -cb * sa], [zero, zero, -sb]]),
    )


class Directions:
    """Points x = B n for directions n stacked, masses and a force: x'' = B (J xi'' + c), so (B J)^T M (B J) xi'' = (B J)^T (F - M B c)."""

    def __init__(self, B, masses, force):
        self.B, self.M, self.force = np.array(B, dtype=float), np.diag(np.repeat(masses, 3)), force

    def split(self, y):
        n = len(y) // 2
        parts = [direction(*y[k : k + 2]) for k in range(0, n, 2)]
        J = np.zeros((3 * len(parts), n))
        for k, (_, each, _) in enumerate(parts):
            J[3 * k : 3 * k + 3, 2 * k : 2 * k + 2] = each
        c = np.concatenate(
            [twice @ [r[0] ** 2, 2 * r[0] * r[1], r[1] ** 2] for (*_, twice), r in zip(parts, y[n:].reshape(-1, 2), strict=True)]
        )
        return np.concatenate([each[0] for each in parts]), J, c

    def field(self, _, y):
        n, J, c = self.split(y)
        D = self.B @ J
        rates = y[len(y) // 2 :]
        return np.concatenate([rates, np.linalg.solve(D.T @ self.M @ D, D.T @ (self.force(self.B @ n) - self.M @ self.B @ c))])

    def start(self, q, p):
        """Return angles and rates of a state."""
        n = np.linalg.solve(self.B, q).reshape(-1, 3)
        y = np.concatenate([[np.arctan2(m[1], m[0]), np.arcsin(m[2])] for m in n])
        D = self.B @ self.split(np.concatenate([y, 0 * y]))[1]
        return np.concatenate([y, np.linalg.lstsq(D, np.linalg.solve(self.M, p), rcond=None)[0]])

    def motion(self, q, p, times):
        y = by_dop853(self.field, self.start(q, p), times)
        states = [(self.split(row)[0], self.split(row)[1] @ row[len(row) // 2 :]) for row in y]
        return np.array([self.B @ n for n, _ in states]), np.array([self.M @ self.B @ rate for _, rate in states])


def attraction(x):
    """Force of U = -1/acos(x1.x2) on both points."""
    c = x[:3] @ x[3:]
    return np.concatenate([x[3:], x[:3]]) / np.arccos(c) ** 2 / np.sqrt(1 - c * c)


def moved_by_directions(name):
    turned = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]])  # the poles of the angles lie on the second axis
    both = np.kron(np.eye(2), turned)
    if name == "two_bodies_on_sphere":
        return Directions(both, [1, 1], attraction)
    if name == "ellipsoid_geodesic":
        return Directions(np.diag(AXES), [1], lambda x: 0 * x)
    return Directions(np.kron([[1, 0], [1, 1]], turned), [1, 1], lambda x: np.array([0, 0, -9.81, 0, 0, -9.81]))


def on_torus(q, p, times, gravity):
    """Return the motion on the torus of radii 2 and 1 by its angles, from a start with phi = 0."""
    theta = np.arctan2(q[2], q[0] - 2)
    x0 = [theta, 0, p[2] * np.cos(theta) - p[0] * np.sin(theta), p[1] / q[0]]

    def f(_, x):
        a, _, rise, turn = x
        rho = 2 + np.cos(a)
        return [rise, turn, -rho * np.sin(a) * turn**2 - gravity * np.cos(a), 2 * np.sin(a) * rise * turn / rho]

    a, b, rise, turn = by_dop853(f, x0, times).T
    rho = 2 + np.cos(a)
    v = [-np.sin(a) * np.cos(b) * rise - rho * np.sin(b) * turn, -np.sin(a) * np.sin(b) * rise + rho * np.cos(b) * turn, np.cos(a) * rise]
    return np.array([rho * np.cos(b), rho * np.sin(b), np.sin(a)]).T, np.array(v).T


# ---- butane by hand: Cartesian, with the torsion force as molecular dynamics has it ---------------------------------------

ATOMS = np.array([15.035, 14.027, 14.027, 15.035])
C = np.array([9.28, 12.16, -13.12, -3.06, 26.24, -31.50])
PAIRS = ((0, 1), (1, 2), (2, 3), (0, 2), (1, 3))


def torsion(q):
    """Return the torsion angle, 0 in trans, and its gradient, shape(4, 3)."""
    r = np.reshape(q, (4, 3))
    a, b, c = np.diff(r, axis=0)
    m, n, size = np.cross(a, b), np.cross(b, c), np.linalg.norm(b)
    first, last = -size / (m @ m) * m, size / (n @ n) * n
    s, t = (a @ b) / size**2, (c @ b) / size**2
    gradient = np.array([first, -first * (1 + s) + t * last, s * first - (1 + t) * last, last])
    return np.arctan2(-size * (a @ n), -(m @ n)), gradient


def torsion_force(q):
    phi, gradient = torsion(q)
    slope = -np.sin(phi) * np.polynomial.Polynomial(C).deriv()(np.cos(phi))
    return (-slope * gradient).ravel()


def by_hand(q, p, times):
    """Return the motion of butane: the five distances are held by forces along them."""
    M = np.repeat(ATOMS, 3)

    def f(_, x):
        q, v = x[:12], x[12:]
        G, hidden = np.zeros((5, 12)), np.zeros(5)
        for k, (i, j) in enumerate(PAIRS):
            a, b = slice(3 * i, 3 * i + 3), slice(3 * j, 3 * j + 3)
            G[k, b], G[k, a], hidden[k] = q[b] - q[a], q[a] - q[b], (v[b] - v[a]) @ (v[b] - v[a])
        force = torsion_force(q)
        lam = np.linalg.solve(G / M @ G.T, G @ (force / M) + hidden)
        return np.concatenate([v, (force - G.T @ lam) / M])

    x = by_dop853(f, np.concatenate([q, p / M]), times).T
    return x[:12].T, (x[12:].T * M)


MOTIONS = {
    "double-swing": ("double_spherical_pendulum", "swing", 1.0),
    "double-horizontal": ("double_spherical_pendulum", "horizontal", 1.0),
    "two-gni": ("two_bodies_on_sphere", "gni", 1.0),
    "two-circling": ("two_bodies_on_sphere", "circling", 1.0),
    "round-short": ("ellipsoid_geodesic", "round_short", 2.0),
    "round-long": ("ellipsoid_geodesic", "round_long", 1.0),
    "umbilic": ("ellipsoid_geodesic", "umbilic", 2.0),
    "torus-hole": ("torus", "through_hole", 2.0),
    "torus-trough": ("torus", "trough", 2.0),
    "torus-inner": ("torus", "inner", 2.0),
}


def independent(where, times):
    """Return q and p, one row a time, by equations that are written out in this file."""
    if where.problem == "torus":
        return on_torus(where.q0, where.p0, times, where.parameters["gravity"])
    if where.problem == "butane":
        return by_hand(where.q0, where.p0, times)
    return moved_by_directions(where.problem).motion(where.q0, where.p0, times)


@pytest.mark.sampled(left_out=("double-horizontal", "two-circling", "round-long", "umbilic", "torus-hole", "torus-trough"))
@pytest.mark.parametrize(("problem", "case", "t"), MOTIONS.values(), ids=MOTIONS)
def test_the_motion_is_that_of_the_equations_written_by_hand(problem, case, t):
    where, times = initial_value_problem(problem, case), np.array([0.5, 1.0]) * t
    found = integrated(where, times)
    q, p = independent(where, times)
    assert error_of(found.states["q"], q) < 3e-10
    assert error_of(found.states["p"], p) < 3e-9


def test_a_scheme_of_order_8_follows_butane_written_by_hand():
    where = initial_value_problem("butane", "tumbling")
    method = FixedStep("rattle", composition="kahan_li8", compiled=False)
    found = method.solve(where, Request(value=0.01, steps=10, watch=("manifold", "integrals"))).complete()
    q, p = independent(where, np.array([0.1]))
    assert error_of(found.q[-1], q) < 1e-11
    assert error_of(found.p[-1], p) < 1e-10
    assert max(found.maxima["g"], found.maxima["Gv"]) < 1e-12
    assert max(found.maxima[name] for name in ("P1", "P2", "P3", "L1", "L2", "L3")) < 1e-10


# ---- starts and integrals ------------------------------------------------------------------------------------------------


def test_the_two_bodies_start_as_in_the_codes_of_hairer():
    def place(a, b):
        return np.array([np.cos(a) * np.sin(b), np.sin(a) * np.sin(b), np.cos(b)])

    where = initial_value_problem("two_bodies_on_sphere")
    starts = ((1.3, 2.1, 1.2, 0.1), (-2.1, -1.1, 0.1, -0.5))
    q = np.array([place(a, b) for a, b, _, _ in starts])
    v = np.array([np.imag(place(a + 1e-30j * turn, b + 1e-30j * rise)) / 1e-30 for a, b, turn, rise in starts])
    assert error_of(where.q0, q.ravel()) < 1e-15
    assert error_of(where.p0, v.ravel()) < 1e-15
    assert float(where.value("H", where.p0, where.q0)) == pytest.approx(np.sum(v**2) / 2 - 1 / np.arccos(q[0] @ q[1]), rel=1e-14)


# ---- charts and pictures ---------------------------------------------------------------------------------------------------


@pytest.mark.sampled(left_out=("butane",))
@pytest.mark.parametrize("name", PROBLEMS)
def test_the_chart_leads_to_the_manifold_and_back(name, random):
    whole, chart = definition(name), definition(name).chart
    y, x = [*chart.eta, *chart.xi], [*whole.p, *whole.q]
    Gv = sp.Matrix(whole.g).jacobian(whole.q) * whole.M.inv() * sp.Matrix(whole.p)
    out, back, off = (
        numbers(name, *each) for each in (([*chart.p, *chart.q], y), ([*chart.inverse_eta, *chart.inverse_xi], x), ([*whole.g, *Gv], x))
    )
    at = random.uniform(-1.4, 1.4, size=(len(y), 20))
    state = out(*at)
    assert error_of(np.array(back(*state)), at) < 1e-12
    assert max(np.abs(each).max() for each in off(*state)) < 1e-12


@pytest.mark.parametrize("name", [*PROBLEMS, "planar_pendulum", "spherical_pendulum", "double_pendulum"])
def test_masses_are_drawn_where_they_are_and_on_the_surface(name, random):
    whole, picture = definition(name), definition(name).picture
    assert [x for mass in picture.masses for x in mass] == list(whole.q)
    assert {tuple(point) for rod in picture.rods for point in rod} <= {*map(tuple, picture.masses), *picture.fixed}
    if picture.surface is not None:
        at = dict(zip(whole.q, tuple(picture.surface) * len(picture.masses), strict=True))
        symbols, *bounds = zip(*picture.over, strict=True)
        off = numbers(name, [g.subs(at, simultaneous=True) for g in whole.g], symbols)
        assert np.abs(off(*random.uniform(*np.array(bounds, dtype=float), size=(50, 2)).T)).max() < 1e-13


# ---- what is known in closed form ------------------------------------------------------------------------------------------


def test_geodesics_from_an_umbilic_meet_in_the_opposite_one_half_the_middle_ellipse_away():
    where = initial_value_problem("ellipsoid_geodesic", "umbilic")
    half = 2 * AXES[0] * ellipe(1 - (AXES[2] / AXES[0]) ** 2)
    assert error_of(where.q0, AXES * [0.6, 0, -0.8]) < 1e-15
    q, _ = independent(where, np.array([half]))
    assert np.abs(q[-1] + where.q0).max() < 1e-10
    assert np.abs(integrated(where, np.array([half])).states["q"][-1] + where.q0).max() < 1e-10
