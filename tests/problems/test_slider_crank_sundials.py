"""SUNDIALS' slider crank against its printed numbers, and against one equation of motion in the crank's angle, written by hand."""

from functools import cache

import numpy as np
import pytest
from integrating import by_dop853
from measures import error_of
from published import SLIDER_CRANK, SLIDER_CRANK_G, SLIDER_CRANK_GRADIENT
from scipy.integrate import simpson

import daebench
from daebench.diagnostics.nearby import rates
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.reference.solution import reference_solution

A, J1, M2, J2 = 0.5, 1.0, 1.0, 2.0
TINY = 1e-20


def pull(q, x, p, l0=1.0):
    """Return l and its derivatives by q, x and p, as the example writes them."""
    s1, c1, s2, c2 = np.sin(q), np.cos(q), np.sin(p), np.cos(p)
    s21 = s2 * c1 - c2 * s1
    length = np.sqrt(x**2 - x * (c2 + A * c1) + (1 + A**2) / 4 + A * (c2 * c1 + s2 * s1) / 2)
    return length, np.array([A * (s21 / 2 + x * s1) / 2, x - c2 / 2 - A * c1 / 2, (x * s2 - A * s21 / 2) / 2]) / length


def mechanism(phi):
    """Return (q, x, p) and its first two derivatives by the crank's angle."""
    s, c = np.sin(phi), np.cos(phi)
    cp = np.sqrt(1 - (A * s) ** 2)
    p1 = -A * c / cp
    p2 = A * s / cp + s * c * A**2 * p1 / cp**2
    place = np.array([phi, cp + A * c, -np.arcsin(A * s)])
    slope = np.array([1, A * s * p1 - A * s, p1])
    return place, slope, np.array([0, A * c * p1 + A * s * p2 - A * c, p2])


def by_hand(z, k, c):
    """Return the rates of the crank's angle, of its rate, of the integral of T, and of the energy that the damper takes."""
    phi, omega = z[:2]
    place, by_phi, twice = mechanism(phi)
    length, slope = pull(*place)
    stretch = slope @ by_phi * omega
    Q = -(k * (length - 1) + c * stretch) * slope + np.array([0, 1, -np.sin(place[2])])
    M = np.array([J1, M2, J2])
    inertia, change = M * by_phi @ by_phi, M * by_phi @ twice
    return np.array([omega, (Q @ by_phi - change * omega**2) / inertia, inertia * omega**2 / 2, c * stretch**2])


@cache
def solved(t, name=""):
    """Return the state of ``by_hand`` at a time, and its derivative by k, c or the crank's angle at the start, by complex step."""
    step = {each: 1j * TINY * (each == name) for each in ("k", "c", "phi0")}

    def f(_, z):
        rate = by_hand(z[:4] + 1j * z[4:], 1 + step["k"], 1 + step["c"])
        return np.concatenate([rate.real, rate.imag])

    start = np.concatenate([[np.pi / 2, 0, 0, 0], [step["phi0"].imag, 0, 0, 0]])
    atol = np.repeat([1e-14, 1e-14 * TINY], 4)
    z = by_dop853(f, start, t, atol=atol)
    return z[:4], z[4:] / TINY


def test_the_forces_are_those_of_the_example(random):
    where = initial_value_problem("slider_crank_sundials", "ida", {"k": 0.7, "c": 0.3, "load": 1.9, "rest_length": 0.8})
    for phi, omega in random.uniform(-2, 2, (4, 2)):
        q, by_phi, _ = mechanism(phi)
        v = by_phi * omega
        state = np.append([J1, M2, J2] * v, 0.0), np.append(q, 0.0)
        length, slope = pull(*q)
        Q = -(0.7 * (length - 0.8) + 0.3 * slope @ v) * slope + [0, 1.9, -1.9 * np.sin(q[2])]
        G = np.array([[A * np.sin(phi), 1, np.sin(q[2])], [-A * np.cos(phi), 0, -np.cos(q[2])]])
        p_rate, q_rate = rates(where, *state)
        assert np.abs(where.value("g", state[1])).max() < 1e-15
        assert error_of(q_rate, [*v, 1]) < 1e-15
        assert np.abs(p_rate[:3] - Q + G.T @ where.value("lam", *state)).max() < 1e-13
        assert p_rate[3] == pytest.approx(0.3 * (slope @ v) ** 2, rel=1e-12)


def test_the_motion_is_the_printed_one_and_that_of_the_crank_angle():
    where = initial_value_problem("slider_crank_sundials", "ida")
    states = reference_solution(where, list(SLIDER_CRANK)).states
    assert error_of(where.q0[:3], mechanism(np.pi / 2)[0]) < 1e-15
    for (t, printed), q, p in zip(SLIDER_CRANK.items(), states["q"], states["p"], strict=True):
        assert q[:3] == pytest.approx(printed, rel=6e-5)
        phi, omega, _, lost = solved(t)[0]
        place, by_phi, _ = mechanism(phi)
        assert error_of(q, [*place, t]) < 1e-11
        assert error_of(p, [*([J1, M2, J2] * by_phi * omega), lost]) < 1e-11


def integral(t, q, p):
    """Return the integral of kinetic energy over time."""
    return simpson((p[:, :3] ** 2 / [J1, M2, J2]).sum(axis=1) / 2, x=t)


def require_gradient(method, **settings):
    """Hold the integral of kinetic energy and its gradient in k, c and q0 against the print and against the equation by hand."""
    found = daebench.gradient(integral, "slider_crank_sundials", method=method, t_end=10, sensitivities=["k", "c", "q0"], **settings)
    assert found.value == pytest.approx(SLIDER_CRANK_G, abs=5e-5)
    assert found.value == pytest.approx(solved(10.0)[0][2], abs=1e-7)
    for name, printed in SLIDER_CRANK_GRADIENT.items():
        assert found.derivatives[name] == pytest.approx(printed, abs=5e-5)
        assert found.derivatives[name] == pytest.approx(solved(10.0, name)[1][2], abs=1e-7)
    by_phi = mechanism(np.pi / 2)[1]
    along = np.array([J1, M2, J2]) * by_phi / (np.array([J1, M2, J2]) * by_phi @ by_phi)  # of each entry, what is along the manifold
    assert found.derivatives["q0"] == pytest.approx([*(along * solved(10.0, "phi0")[1][2]), 0], abs=1e-7)
    assert found.trajectory.sensitivities["q0"]["p"].shape == (*found.trajectory.p.shape, 4)


def test_the_gradient_of_the_integral_of_kinetic_energy_is_the_published_one():
    require_gradient("gauss4", h=0.02, every=1)
