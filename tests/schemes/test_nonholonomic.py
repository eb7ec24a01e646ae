"""Schemes for constraints on velocities: orders against DOP853, structure, steps written out in NumPy, and faults that these catch."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
import sympy as sp
from measures import error_of
from nonholonomic import BODIES, STEPS, exact, ivp, nonholonomic_newmark
from runs import method, run

from daebench.compiler.definition import source_of
from daebench.diagnostics.order import fit_order
from daebench.diagnostics.reversibility import reversibility_defect
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.runs.make_ivp import make_ivp
from daebench.runs.request import Request
from daebench.systems.constrained import Case, ConstrainedHamiltonian

SECOND = ["dla", "nonholonomic_leapfrog", "gni", "nonholonomic_newmark", "nonholonomic_newmark_pair"]
SPARK = ["spark_lobatto2", "spark_lobatto3", "spark_lobatto4"]
OTHERS = ["dla/suzuki4", "nonholonomic_leapfrog/suzuki4", "rk4+proj", "gauss2+proj", "gauss3"]
PLACES = ["particle", "knife_edge", "heavier", "bead", "heavier_bead", "driven"]
SYMMETRIC = ["dla", "nonholonomic_leapfrog", "nonholonomic_newmark_pair", *SPARK, "dla/suzuki4"]
COUNTS = {2: (20, 40, 80), 4: (6, 9, 13), 6: (5, 7, 10)}


def fits(name, place):
    why = method(name).refusal(ivp(place))
    return why is None or "constant M" not in why


def pairs(of=lambda name, place: True):
    """Return the parameters of a sweep of schemes over problems: two problems a scheme, and all on the day of a release."""
    marked = []
    for number, name in enumerate(SECOND + SPARK + OTHERS):
        taken = [place for place in PLACES if fits(name, place) and of(name, place)]
        now = {taken[number % len(taken)], taken[(number + 2) % len(taken)]} if taken else ()
        marked += [pytest.param(name, at, id=f"{name}-{at}", marks=[pytest.mark.exhaustive] * (at not in now)) for at in taken]
    return pytest.mark.parametrize(("name", "place"), marked)


def error(name, place, n, T=1.0):
    """Return the error after T; that of p_t of a system in time, which is no part of the motion, is left out."""
    q, p = exact(place, T)
    last = run(name, ivp(place), T / n, n, watch=())
    return max(error_of(last.q[-1, : len(q)], q), error_of(last.p[-1, : len(p)], p))


@cache
def order(name, place):
    counts = COUNTS[method(name).claims.order]
    return fit_order([1.0 / n for n in counts], [error(name, place, n) for n in counts]).slope


@pairs()
def test_the_order_is_the_one_claimed(name, place):
    claimed = method(name).claims.order
    assert claimed == {"gauss3": 6, "spark_lobatto4": 6, **dict.fromkeys([*SECOND, "spark_lobatto2"], 2)}.get(name, 4)
    assert abs(order(name, place) - claimed) < 0.2, [error(name, place, n) for n in COUNTS[claimed]]


@pairs(lambda name, place: name != "gauss3")
def test_velocities_at_the_ends_of_steps_are_allowed_to_round_off(name, place):
    maxima = run(name, ivp(place), 0.05, 20).maxima
    assert maxima["Gv"] < 4e-15
    claims = method(name).claims_on(ivp(place))
    assert claims.keeps_Gv
    assert maxima["g"] < 1e-15 if claims.keeps_g else maxima["g"] > 1e-10


@pairs(lambda name, place: place != "driven")
def test_reversal_returns_where_that_is_claimed_and_nowhere_else(name, place):
    where, claims = ivp(place), method(name).claims
    assert claims.symmetric == (name in SYMMETRIC or name in OTHERS[1:2] + OTHERS[4:])
    defect = reversibility_defect(method(name).flow(where, 0.05, 4), where.p0, where.q0)
    if claims.symmetric:
        assert defect < 2e-15
    elif name in SECOND:
        assert defect > 1e-9


@pytest.mark.parametrize("name", SYMMETRIC)
def test_a_step_back_returns_where_the_constraint_is_affine_and_depends_on_time(name):
    where = ivp("driven")
    p, q = method(name).flow(where, 0.05, 4)(where.p0, where.q0)
    back_p, back_q = method(name).flow(where, -0.05, 4)(p, q)
    assert max(error_of(back_p, where.p0), error_of(back_q, where.q0)) < 3e-15


# ---- steps, written out --------------------------------------------------------------------------------------------------


def written(name, place, h, steps):
    """Return states after each step of a scheme in NumPy."""
    where, memory = ivp(place), None
    p, q, states = where.p0, where.q0, []
    for _ in range(steps):
        p, q, memory = STEPS[name](BODIES[place], p, q, h, memory)
        states.append(np.concatenate([p, q]))
    return np.array(states)


@pytest.mark.parametrize("place", BODIES)
@pytest.mark.parametrize("name", STEPS)
def test_steps_are_those_of_the_equations_solved_by_minpack(name, place):
    found = run(name, ivp(place), 0.1, 6)
    assert error_of(np.hstack([found.p, found.q])[1:], written(name, place, 0.1, 6)) < 2e-13


@pytest.mark.parametrize("place", BODIES)
def test_half_a_step_of_newmark_and_its_adjoint_meet_in_the_middle(place):
    where, body = ivp(place), BODIES[place]
    found = run("nonholonomic_newmark_pair", where, 0.2, 1, options={"beta": 0.1})
    there = nonholonomic_newmark(body, where.p0, where.q0, 0.1, None, beta=0.1)
    back = nonholonomic_newmark(body, found.p[1], found.q[1], -0.1, None, beta=0.1)
    assert max(error_of(a, b) for a, b in zip(there[:2], back[:2], strict=True)) < 1e-14


@pytest.mark.parametrize("beta", [0.0, 0.1, 0.5])
def test_newmark_is_of_order_2_for_any_beta(beta):
    q, counts = exact("particle", 1.0)[0], (20, 40, 80)
    ends = [run("nonholonomic_newmark", ivp("particle"), 1 / n, n, options={"beta": beta}).q[-1] for n in counts]
    assert abs(fit_order([1 / n for n in counts], [error_of(end, q) for end in ends]).slope - 2) < 0.1


# ---- where the constraint holds ------------------------------------------------------------------------------------------


def test_dla_has_the_constraint_in_the_middle_of_steps_and_gni_for_the_mean_of_velocities_on_either_side():
    A = BODIES["particle"].A
    q = run("dla", ivp("particle"), 0.1, 20).q
    assert max(np.abs(A((q0 + q1) / 2) @ (q1 - q0)).max() for q0, q1 in pairwise(q)) < 1e-15
    q = run("gni", ivp("particle"), 0.1, 20).q
    assert max(np.abs(A(q1) @ (q2 - q0)).max() for q0, q1, q2 in zip(q[:-2], q[1:-1], q[2:], strict=True)) < 1e-15
    assert max(np.abs(A(q0) @ (q1 - q0)).max() for q0, q1 in pairwise(q)) > 1e-3


def posed_by_velocities(name, case):
    """Return a problem of the catalogue with the derivative of g, halved, in place of g."""
    of = initial_value_problem(name, case).source.derivation.definition
    v = sp.symbols(f"v1:{of.d + 1}", real=True)
    rows = [sum(sp.diff(g, x) * rate for x, rate in zip(of.q, v, strict=True)) / 2 for g in of.g]
    start = of.cases[case]
    problem = ConstrainedHamiltonian(
        q=of.q,
        p=of.p,
        v=v,
        M=of.M,
        U=of.U,
        g=[],
        velocity=rows,
        parameters=of.parameters,
        cases={case: Case(q=start.q, p=start.p, about="")},
    )
    return make_ivp(source_of(problem, f"{name} by velocities"), case), of


def test_where_g_is_quadratic_and_gravity_constant_dla_has_the_positions_of_shake():
    where, _ = posed_by_velocities("spherical_pendulum", "fig1.2b")
    by_velocities = parse("dla").solve(where, Request(value=0.01, steps=1000)).complete()
    by_positions = parse("shake").solve(initial_value_problem("spherical_pendulum", "fig1.2b"), Request(value=0.01, steps=1000)).complete()
    assert error_of(by_velocities.q, by_positions.q) < 1e-12
    assert error_of(np.sum(by_velocities.q**2, axis=1), 1) < 1e-13


def test_where_g_is_quadratic_two_stages_of_spark_are_rattle():
    where, _ = posed_by_velocities("spherical_pendulum", "fig1.2b")
    by_velocities, by_positions = (run(name, place, 0.01, 50) for name, place in (("spark_lobatto2", where), ("rattle", "spherical-fast")))
    assert error_of(by_velocities.q, by_positions.q) < 1e-13
    assert error_of(by_velocities.p, by_positions.p) < 1e-12


DRIFTS = {"dla": 2, "gni": 2, "nonholonomic_leapfrog": 2, "nonholonomic_newmark": 2, "spark_lobatto3": 4}


def drift_order(name, where, drift):
    """Return the order in h of a drift at the end of runs of a second."""
    counts = (20, 40, 80)
    return fit_order([1 / n for n in counts], [drift(run(name, where, 1.0 / n, n)) for n in counts]).slope


@pytest.mark.parametrize(("name", "claimed"), DRIFTS.items(), ids=str)
def test_where_g_is_not_quadratic_it_drifts_with_the_order_of_the_scheme(name, claimed):
    where, of = posed_by_velocities("torus", next(iter(initial_value_problem("torus").source.derivation.definition.cases)))
    g = sp.lambdify([of.q], of.g[0].subs(of.parameters))
    assert abs(drift_order(name, where, lambda found: abs(g(found.q[-1]))) - claimed) < 0.15
    assert abs(g(run(name, where, 1.0 / 20, 20).q[-1])) > 1e-7


@pytest.mark.parametrize("name", ["nonholonomic_leapfrog", "nonholonomic_newmark", "nonholonomic_newmark_pair"])
def test_a_constraint_on_positions_that_is_imposed_on_velocities_drifts_with_the_square_of_h(name):
    assert abs(drift_order(name, ivp("bead"), lambda found: found.maxima["g"]) - 2) < 0.1


# ---- multipliers ---------------------------------------------------------------------------------------------------------

MULTIPLIERS = {"dla": ("mean", 2), "nonholonomic_leapfrog": ("lam_mid", 2), "gni": ("lam_n", 2), "spark_lobatto2": ("mean", 2)}
MULTIPLIERS |= {"spark_lobatto3": ("Lam_2", 2), "spark_lobatto4": ("Lam_4", 3)}


def multiplier_error(name, n):
    """Return the error of the last stage multiplier of a run on the particle."""
    t, lam = run(name, ivp("particle"), 1.0 / n, n, raw=True).raw[MULTIPLIERS[name][0]]
    q, p = exact("particle", float(t[-1]))
    return abs(lam[-1] - BODIES["particle"].lam(p, q))[0]


@pytest.mark.parametrize(("name", "claimed"), [(name, order) for name, (_, order) in MULTIPLIERS.items()], ids=str)
def test_multipliers_are_those_of_the_motion(name, claimed):
    fit = fit_order([1 / 20, 1 / 40, 1 / 80], [multiplier_error(name, n) for n in (20, 40, 80)])
    assert abs(fit.slope - claimed) < 0.15, fit
