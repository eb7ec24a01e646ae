"""Sentences of mathematics in the pages, each held against numbers: where they fail here, the pages are wrong."""

import numpy as np
import pytest
from ivps import ivp
from runs import method, run

from daebench.methods.fixed_step.forms import FORMS
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.pages.report.exact_motion import exact_motion
from daebench.reports.index_reduction.schemes import period
from daebench.runs.request import Request

ROUND_OFF = 1e-12

KINDS = ("spherical-fast", "planar", "coupled-rods", "stretched-M", "relativistic")


def fixed_point(update, x):
    """Return the solution of x = update(x)."""
    for _ in range(200):
        x = update(x)
    return x


# ---- RATTLE and symplectic Euler ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("place", KINDS)
def test_rattle_is_half_a_step_of_symplectic_euler_and_of_its_adjoint_with_no_constraint_between(place):
    """(1.26) written as two half steps that share one multiplier: the state between them is off g = 0."""
    where, h = ivp(place), 0.02
    p0, q0 = where.p0, where.q0
    found = method("rattle").solve(where, Request(value=h, steps=1, raw=True))
    lam, mu = (found.raw[name][1][0] for name in ("lam_n", "mu_n"))
    G0, G1 = where.value("G", q0), where.value("G", found.q[-1])

    p_half = fixed_point(lambda p: p0 - h / 2 * (where.value("H_q", p, q0) + G0.T @ lam), p0)
    q_half = q0 + h / 2 * where.value("H_p", p_half, q0)
    q1 = fixed_point(lambda q: q_half + h / 2 * where.value("H_p", p_half, q), q_half)
    p1 = p_half - h / 2 * (where.value("H_q", p_half, q1) + G1.T @ mu)
    assert np.abs(q1 - found.q[-1]).max() < ROUND_OFF
    assert np.abs(p1 - found.p[-1]).max() < ROUND_OFF * max(1.0, np.abs(p1).max())
    assert np.abs(where.value("g", q_half)).max() > 1e-6


# ---- SHAKE --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("place", ["spherical-fast", "coupled-rods"])  # others start at a turning point, which hides it
def test_the_recursion_of_shake_is_symmetric_and_its_map_from_the_manifold_is_not(place):
    where, h, n = ivp(place), 0.04, 10
    there = run("shake", place, h, n)
    p, q = np.real(method("shake").flow(where, h, n)(-there.p[-1], there.q[-1]))
    assert np.abs(q - where.q0).max() < 1e-10
    miss = -p - where.p0
    assert np.abs(miss).max() > 1e-8
    G = where.value("G", where.q0)
    assert np.abs(miss - G.T @ np.linalg.lstsq(G.T, miss, rcond=None)[0]).max() < 1e-9
    for k in range(n - 1):
        assert np.abs(_shaken(where, h, there.q[k + 2], there.q[k + 1]) - there.q[k]).max() < 1e-10


def _shaken(where, h, q0, q1):
    """Return q2 of (1.23) from q0 and q1, by Newton's iteration for the multiplier, written from the book."""
    G, still = where.value("G", q1), np.zeros_like(q1)
    M = np.linalg.inv(np.array([where.value("H_p", e, q1) for e in np.eye(len(q1))]))
    lam = np.zeros(len(G))
    for _ in range(50):
        q2 = 2 * q1 - q0 - h**2 * np.linalg.solve(M, where.value("H_q", still, q1) + G.T @ lam)
        slope = -(h**2) * where.value("G", q2) @ np.linalg.solve(M, G.T)
        lam = lam - np.linalg.solve(slope, where.value("g", q2))
    return q2


# ---- the swing of Fig. 1.2 ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("case", "said"), [("fig1.2", 0.872449), ("fig1.2b", 0.881554)], ids=["fig1.2", "fig1.2b"])
def test_the_period_of_a_swing_is_that_of_the_closed_form(case, said):
    """After one period, and two, the height and its velocity are those of the start; after half of one they are not."""
    where = initial_value_problem("spherical_pendulum", case)
    T = period(where)
    q, p = exact_motion(where.source, case, [T / 2, T, 2 * T])
    assert q[1:, 2] == pytest.approx(where.q0[2], abs=1e-11)
    assert p[1:, 2] == pytest.approx(where.p0[2], abs=1e-11)
    assert abs(p[0, 2] - where.p0[2]) > 0.1
    assert pytest.approx(said, abs=5e-7) == T


@pytest.mark.parametrize("name", [f"{form}:{scheme}" for form in FORMS for scheme in ("rk4", "midpoint", "gauss2")])
def test_a_form_of_the_system_is_not_said_to_be_the_reduced_one(name):
    assert "(1.18)" not in parse(name).claims.source
