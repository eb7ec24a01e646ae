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

SEPARABLE = ("spherical-fast", "planar", "coupled-rods")
KINDS = (*SEPARABLE, "stretched-M", "relativistic")


def fixed_point(update, x):
    """Return the solution of x = update(x)."""
    for _ in range(200):
        x, before = update(x), x
        if np.abs(x - before).max() < 1e-16:
            break
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

    def euler(p):
        return p0 - h / 2 * (where.value("H_q", p, q0) + G0.T @ lam)

    p_half = fixed_point(euler, p0)
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
    end, before = there.q[-1], there.q[-2]
    for k in range(n - 2, -1, -1):
        end, before = before, _shaken(where, h, end, before)
        assert np.abs(before - there.q[k]).max() < 1e-10


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


# ---- the two-form off the manifold --------------------------------------------------------------------------------------


@pytest.mark.parametrize("place", ["spherical-fast", "coupled-rods"])
def test_the_two_form_changes_along_the_reduced_system_as_in_1_17(place, random):
    """d/dt xi1^T J xi2 = sum_i (dg_i xi1) (dlam_i xi2) - (dlam_i xi1) (dg_i xi2): zero on tangent vectors, and not on others."""
    where = ivp(place)
    d, e = len(where.q0), 1e-6

    def field(x):
        p, q = x[:d], x[d:]
        return np.concatenate([-where.value("H_q", p, q) - where.value("G", q).T @ where.value("lam", p, q), where.value("H_p", p, q)])

    def derivative(function, x):
        return np.array([(function(x + e * u) - function(x - e * u)) / (2 * e) for u in np.eye(2 * d)]).T

    x = np.concatenate([where.p0, where.q0])
    J = np.block([[np.zeros((d, d)), np.eye(d)], [-np.eye(d), np.zeros((d, d))]])
    A = derivative(field, x)
    change = A.T @ J + J @ A
    dlam = derivative(lambda x: where.value("lam", x[:d], x[d:]), x)
    dg = np.hstack([np.zeros((len(dlam), d)), where.value("G", where.q0)])
    said = dg.T @ dlam - dlam.T @ dg
    assert np.abs(change - said).max() < 1e-6 * np.abs(said).max()
    from daebench.diagnostics.symplecticity import tangent_basis

    X = tangent_basis(where, where.p0, where.q0)
    assert np.abs(X.T @ said @ X).max() < 1e-10 * np.abs(said).max()
    assert np.abs(said).max() > 0.1


# ---- the swing of Fig. 1.2 ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("case", ["fig1.2", "fig1.2b"])
def test_the_period_of_a_swing_is_that_of_the_closed_form(case):
    """After one period, and two, the height and its velocity are those of the start; after half of one they are not."""
    where = initial_value_problem("spherical_pendulum", case)
    T = period(where)
    q, p = exact_motion(where.source, case, [T / 2, T, 2 * T])
    assert q[1:, 2] == pytest.approx(where.q0[2], abs=1e-11)
    assert p[1:, 2] == pytest.approx(where.p0[2], abs=1e-11)
    assert abs(p[0, 2] - where.p0[2]) > 0.1
    assert f"{T:.6f}" == {"fig1.2": "0.872449", "fig1.2b": "0.881554"}[case]


# ---- methods ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [f"{form}:{scheme}" for form in FORMS for scheme in ("rk4", "midpoint", "gauss2")])
def test_a_form_of_the_system_is_not_said_to_be_the_reduced_one(name):
    assert "(1.18)" not in parse(name).claims.source
