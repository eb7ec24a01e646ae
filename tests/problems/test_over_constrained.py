"""Bricard's mechanism, the ring of cyclohexane, rigid water and the four-bar linkage with a spring against truths made otherwise."""

import numpy as np
import pytest
import sympy as sp
from integrating import by_dop853
from measures import error_of
from runs import method
from scipy.integrate import quad
from scipy.optimize import brentq

from daebench.diagnostics.freedom import freedom
from daebench.diagnostics.unit_rows import unit_rows
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.problems import bricard, cyclohexane_ring
from daebench.reference.keep.store import load
from daebench.runs.request import Request

# ---- Bricard's mechanism, by rotations about its joints ------------------------------------------------------------------

ROD, WIDTH, GRAVITY = 1.0, 0.1, 9.81
BETWEEN = 1.4, 2.2
"""Angles a, about 90 to 120 degrees where b is within 100, between which there is one that closes the loop."""


def rotated(vector, axis, angle):
    """Return a vector turned about a unit axis, by Rodrigues' formula."""
    return vector * np.cos(angle) + np.cross(axis, vector) * np.sin(angle) + axis * (axis @ vector) * (1 - np.cos(angle))


def assembled(b):
    """Return joints P_0, ..., P_5 and axes u_0, ..., u_5 for an angle b of the joints of even number; the other angle closes the loop.

    Rods are put together from P_0 as a serial chain, and the angle of the joints of odd number is found as the one at which P_5 is where it
    has to be: nothing of the mechanism's closed form is in it.
    """

    def chain(a):
        P, u, r = [np.zeros(3)], [np.array([0.0, 1.0, 0.0])], rotated(np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0]), -b)
        for k in range(1, 6):
            P.append(P[-1] + ROD * r)
            u.append((-1) ** (k + 1) * np.cross(r, u[-1]))
            r = rotated(r, u[-1], -(a if k % 2 else b))
        return P, u

    a = brentq(lambda a: np.linalg.norm(chain(a)[0][5]) ** 2 - ROD**2, *BETWEEN, xtol=1e-15)
    P, u = chain(a)
    assert error_of(P[5], [0, 0, ROD]) < 1e-12
    assert error_of(u[5], [1, 0, 0]) < 1e-12
    return P, u


def flat(b):
    P, u = assembled(b)
    return np.concatenate([u[1][[0, 2]], P[2], u[2], P[3], u[3], u[4][[1, 2]]])


def energies(b, step=1e-4):
    """Return twice the kinetic energy at unit rate, and the potential energy: rods by their centres and their angular velocities."""
    (P, _), (ahead, u_ahead), (behind, u_behind) = assembled(b), assembled(b + step), assembled(b - step)
    v, w = (np.array(ahead) - behind) / (2 * step), (np.array(u_ahead) - u_behind) / (2 * step)
    _, u = assembled(b)
    inertia, height = 0.0, 0.0
    for k in range(1, 6):
        frame = np.array([u[k - 1], u[k], (P[k] - P[k - 1]) / ROD])
        rates = np.array([w[k - 1], w[k], (v[k] - v[k - 1]) / ROD])
        omega = sum(np.cross(axis, rate) for axis, rate in zip(frame, rates, strict=True)) / 2
        across, along = (ROD**2 + WIDTH**2) / 12, WIDTH**2 / 6
        inertia += np.sum((v[k] + v[k - 1]) ** 2) / 4 + across * (omega @ frame[0]) ** 2 + across * (omega @ frame[1]) ** 2
        inertia += along * (omega @ frame[2]) ** 2
        height += (P[k] + P[k - 1])[1] / 2
    return inertia, GRAVITY * height


def test_the_rods_close_the_loop_all_along_the_motion():
    for b in (-1.5, -0.4, 0.0, 0.7, np.pi / 2, 1.7):
        q = np.array([float(x) for x in bricard.placed(sp.Float(b, 30), 1)])
        assert error_of(q, flat(b)) < 1e-12


def test_g_has_rank_15_of_16_all_along_the_motion_and_16_beside_it(random):
    where = initial_value_problem("bricard", "iftomm")
    for b in (-1.5, -0.4, 0.0, 0.7, 1.7):
        singular = np.linalg.svd(unit_rows(where, flat(b)), compute_uv=False)
        assert singular[15] < 1e-12 < 1e-2 < singular[14]
    assert np.linalg.svd(unit_rows(where, flat(0.7) + 0.1 * random.normal(size=16)), compute_uv=False)[15] > 1e-4


def test_energies_of_bricards_mechanism_are_those_of_its_rods():
    where = initial_value_problem("bricard", "iftomm")
    for b in (0.3, 1.2):
        inertia, potential = energies(b)
        velocity = (flat(b + 1e-4) - flat(b - 1e-4)) / 2e-4
        p = where.value("mass", where.p0, flat(b)) @ velocity
        assert float(where.value("H", p, flat(b))) == pytest.approx(inertia / 2 + potential, rel=1e-7)


def fallen(t):
    """Return b of the mechanism at a time after its release at b = 90 degrees, by quadrature of dt = db sqrt(I / 2 (E - U))."""
    start = np.pi / 2
    _, E = energies(start)

    def rate(b):
        inertia, U = energies(b)
        return np.sqrt(inertia / (2 * (E - U)))

    def elapsed(b):
        return quad(lambda x: 2 * x * rate(start - x * x), 0, np.sqrt(start - b), epsabs=1e-9, epsrel=1e-9)[0]

    return brentq(lambda b: elapsed(b) - t, 0.2, start - 1e-3, xtol=1e-9)


@pytest.mark.slow
def test_bricards_mechanism_falls_as_its_single_degree_of_freedom_says():
    where, b = initial_value_problem("bricard", "iftomm"), fallen(1.0)
    coarse, fine = (method("rattle").solve(where, Request(value=1 / n, steps=n, every=0)).complete().q[-1] for n in (20, 40))
    errors = [error_of(q, flat(b)) for q in (coarse, fine)]
    assert errors[1] < 0.3 * errors[0]
    assert error_of((4 * fine - coarse) / 3, flat(b)) < 2e-5


@pytest.mark.exhaustive
def test_the_certified_reference_of_bricards_mechanism_falls_as_its_single_degree_of_freedom_says():
    reference = load("bricard-iftomm")
    for t in (0.5, 1.0):
        assert error_of(reference.values["q"][list(reference.t).index(t)], flat(fallen(t))) < 2e-8


@pytest.mark.exhaustive
@pytest.mark.usefixtures("plain_functions")
def test_ida_takes_combinations_of_constraints_through_the_whole_motion_and_back():
    run = parse("ida:index1").solve(initial_value_problem("bricard", "iftomm"), Request(value=1e-7, t_end=5.0, points=51)).complete()
    assert error_of(run.q[-1], run.q[0]) < 2e-2
    assert run.maxima["g"] < 1e-4


# ---- cyclohexane ---------------------------------------------------------------------------------------------------------


def test_the_chair_is_rigid_and_the_boat_is_not():
    counted = {case: freedom(initial_value_problem("cyclohexane_ring", case)) for case in ("boat", "twist", "chair")}
    assert {case: found.degrees for case, found in counted.items()} == {"boat": 7, "twist": 7, "chair": 6}
    assert [found.permanent for found in counted.values()] == [True, True, False]


def ring(q):
    return np.reshape(q, (6, 3))


@pytest.mark.parametrize("case", ["boat", "twist", "chair"])
def test_bonds_and_angles_of_the_ring_are_rigid_and_its_energy_is_that_of_six_torsions(case):
    where = initial_value_problem("cyclohexane_ring", case)
    r, C = ring(where.q0), [9.28, 12.16, -13.12, -3.06, 26.24, -31.50]
    total = 0.0
    for i in range(6):
        a, b, c = (r[(i + k + 1) % 6] - r[(i + k) % 6] for k in range(3))
        assert np.linalg.norm(a) == pytest.approx(1.53, rel=1e-13)
        assert np.degrees(np.arccos(-a @ b / 1.53**2)) == pytest.approx(109.47, rel=1e-12)
        one, two = np.cross(a, b), np.cross(b, c)
        trans = -(one @ two) / (np.linalg.norm(one) * np.linalg.norm(two))
        total += sum(x * trans**k for k, x in enumerate(C))
    assert float(where.value("H", 0 * where.p0, where.q0)) == pytest.approx(total, rel=1e-10)


@pytest.mark.exhaustive
def test_the_boat_turns_into_another_one_and_keeps_what_is_conserved():
    where = initial_value_problem("cyclohexane_ring", "boat")
    run = method("rattle").solve(where, Request(value=0.05, t_end=20.0, watch=("energy", "manifold", "integrals"))).complete()
    outer = [np.linalg.norm(run.q[:, 3 * i : 3 * i + 3] - run.q[:, 3 * i + 9 : 3 * i + 12], axis=1) for i in range(3)]
    assert max(np.ptp(each) for each in outer) > 0.1
    assert max(run.maxima[name] for name in ("g", "Gv", "L1", "L2", "L3", "P1", "P2", "P3")) < 1e-10
    assert freedom(where.at(run.p[-1], run.q[-1])).permanent


def test_six_atoms_are_on_the_flexible_ring_for_any_angle_that_has_one():
    first, second = 1.0, 8 / 3
    for part in (0.72, 0.8, 0.9):
        r = np.array([[float(x) for x in atom] for atom in cyclohexane_ring.boat(sp.Float(first), sp.Float(second), sp.Float(part))])
        for i in range(6):
            assert np.sum((r[(i + 1) % 6] - r[i]) ** 2) == pytest.approx(first, rel=1e-12)
            assert np.sum((r[(i + 2) % 6] - r[i]) ** 2) == pytest.approx(second, rel=1e-12)


# ---- the four-bar linkage with a spring ----------------------------------------------------------------------------------


def slope(theta):
    """Return -U_theta / I for the default numbers: two bar weights at the height of the coupler, spring from A to C."""
    across = 2 * np.cos(theta / 2)
    return -(2 * 9.81 * np.cos(theta) - 25 * (across - np.sqrt(2)) * np.sin(theta / 2)) / (5 / 3)


@pytest.mark.sampled(left_out=("hanging--1.5",))
@pytest.mark.parametrize(("case", "theta"), [("released", -0.3), ("hanging", -1.5)])
@pytest.mark.usefixtures("plain_functions")
def test_the_four_bar_linkage_moves_as_its_angle_says(case, theta):
    run = parse("scipy:DOP853").solve(initial_value_problem("four_bar_spring", case), Request(value=1e-11, t_end=2.0, points=3)).complete()
    truth = by_dop853(lambda _, x: [x[1], slope(x[0])], [theta, 0], [1.0, 2.0])[:, 0]
    expected = np.array([[np.cos(x), np.sin(x), 1 + np.cos(x), np.sin(x)] for x in truth])
    assert error_of(run.q[1:], expected) < 1e-8


# ---- water ---------------------------------------------------------------------------------------------------------------


MASSES = np.array([15.9994, 1.008, 1.008])
WELL, PULL = 20.0, 25.0 * 0.41


def newton_and_euler(body):
    """Return the rates of place and velocity of the centre, attitude, and angular momentum about the centre, for atoms at these places."""

    def f(_, x):
        Q, L = np.reshape(x[6:15], (3, 3)), x[15:]
        r = body @ Q.T
        force = np.array([-WELL * (x[:3] + r[0]) - [0, 0, 2 * PULL], [0, 0, PULL], [0, 0, PULL]])
        inertia = sum(m * (a @ a * np.eye(3) - np.outer(a, a)) for m, a in zip(MASSES, r, strict=True))
        omega = np.linalg.solve(inertia, L)
        return np.concatenate([x[3:6], force.sum(axis=0) / MASSES.sum(), np.cross(omega, Q.T).T.ravel(), np.cross(r, force).sum(axis=0)])

    return f


@pytest.mark.sampled(left_out=("libration",))
@pytest.mark.parametrize("case", ["tumbling", "libration"])
@pytest.mark.usefixtures("plain_functions")
def test_rigid_water_moves_as_a_rigid_body_by_newton_and_euler(case):
    where = initial_value_problem("rigid_water", case)
    r, p = where.q0.reshape(3, 3), where.p0.reshape(3, 3)
    centre = MASSES @ r / MASSES.sum()
    body = r - centre
    start = np.concatenate([centre, p.sum(axis=0) / MASSES.sum(), np.eye(3).ravel(), np.cross(body, p).sum(axis=0)])
    run = parse("scipy:DOP853").solve(where, Request(value=1e-10, t_end=2.0, points=2)).complete()
    x = by_dop853(newton_and_euler(body), start, 2)
    expected = x[:3] + body @ np.reshape(x[6:15], (3, 3)).T
    assert error_of(run.q[-1].reshape(3, 3), expected) < 1e-7
