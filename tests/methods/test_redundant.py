"""Redundant constraints: freedom is counted, what is redundant is named, and every method moves as without it."""

import dataclasses
from functools import cache

import definitions
import numpy as np
import pytest
import sympy as sp
from measures import error_of
from runs import method
from scipy.integrate import solve_ivp

from daebench.compiler.definition import source_of
from daebench.diagnostics.freedom import freedom
from daebench.diagnostics.problem.check import RANK, held
from daebench.errors import BadInput, DaebenchError
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.methods.registry import registry
from daebench.runs.make_ivp import make_ivp
from daebench.runs.request import Request
from daebench.systems.constrained import Case, ConstrainedHamiltonian, coordinates

T = 0.4
SPECIAL = ("boris", "lie", "lie_adjoint", "strang", "rattle_conformal", "rattle_lincs", "rattle_settle")
"""Schemes that take a kinetic flow, a damping, a charged particle or distances alone, which the parallelogram does not have."""

SCHEMES = [name for name, (_, member) in registry().items() if name not in SPECIAL and not member.claims.nonholonomic]
SOLVERS = ("ida:index3", "ida:index2", "ida:index1", "ida:ggl", "ida:baumgarte", "ida:ode", "cvode:bdf", "scipy:DOP853")
"""Those that run as Python here; cvode:bdf:projected is compiled always, heyoka may be missing."""


@cache
def ivp(**how):
    return make_ivp(source_of(definitions.parallelogram(**how), "parallelogram"), "thrown")


def swung(t):
    """Return the positions at time t: links in parallel are a pendulum whose angle obeys theta'' = -gravity sin theta."""
    (theta, _) = solve_ivp(lambda _, x: [x[1], -9.81 * np.sin(x[0])], (0, t), [0.0, 2.0], method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
    return np.array([np.sin(theta), -np.cos(theta), 2 + np.sin(theta), -np.cos(theta)])


def error(name, n):
    run = method(name).solve(ivp(), Request(value=T / n, steps=n, every=0)).complete()
    return error_of(run.q[-1], swung(T)), run.maxima


@pytest.mark.sampled(by=("rattle", "gauss2", "radau2_ggl", "rk4").__contains__)
@pytest.mark.parametrize("name", SCHEMES, ids=str)
def test_schemes_have_their_order_and_keep_the_manifold_with_a_redundant_constraint(name):
    claims = registry()[name][1].claims
    coarse, maxima = error(name, 10)
    fine, _ = error(name, 20)
    assert fine < 1e-12 or np.log2(coarse / fine) > claims.order - 0.5
    assert maxima["g"] < 1e-13 or not claims.keeps_g
    assert maxima["Gv"] < 1e-13 or not claims.keeps_Gv


@pytest.mark.sampled(by=lambda case: case in ("ida:index1", "cvode:bdf"))
@pytest.mark.usefixtures("plain_functions")
@pytest.mark.parametrize("name", SOLVERS, ids=str)
def test_solvers_move_as_without_what_is_redundant_and_share_the_force_of_constraint(name):
    where, request = ivp(), Request(value=1e-8, t_end=T, points=3, multipliers=True)
    run, without = (parse(name).solve(each, request).complete() for each in (where, ivp(spare=False)))
    errors = [error_of(each.q[-1], swung(T)) for each in (run, without)]
    assert errors[0] < 2 * errors[1] + 1e-7
    assert run.maxima["g"] < 2 * without.maxima["g"] + 1e-7
    np.testing.assert_allclose(-where.value("G", run.q[0]).T @ run.lam[0], HELD, atol=1e-12)
    assert np.all(np.abs(run.lam[:, 1:]) > 1e-3)  # each of the three links carries something


HELD = [0, 9.81 + 4, 0, 9.81 + 4]
"""Newton's law at the start: the bar of mass 2, half of it at each end, goes round a circle of radius 1 at speed 2."""


def test_multipliers_are_the_shortest_of_those_with_the_same_force():
    """In units of the largest entries of G M^-1 G^T, in which they are invariant to how a constraint is scaled."""
    where = ivp()
    lam, G = where.value("lam", *where.start), where.value("G", where.q0)
    A = np.abs(G @ where.value("H_pp", *where.start) @ G.T)
    sizes = (A / A.max(axis=1)[:, None]).max(axis=0)
    null = np.linalg.svd(G)[0][:, 3]
    assert np.abs(null @ G).max() < 1e-14
    assert abs((sizes * null) @ (sizes * lam)) < 1e-12 * np.abs(lam).max()
    np.testing.assert_allclose(-G.T @ lam, HELD, atol=1e-12)


# ---- counted and named ---------------------------------------------------------------------------------------------------


def test_degrees_of_freedom_are_counted_and_the_redundant_constraint_is_named():
    found = freedom(ivp())
    assert (found.degrees, found.rank, found.nearby, found.permanent) == (1, 3, 3, True)
    assert found.others == {3: (1, 2)}
    assert freedom(ivp(spare=False)).count == "4 positions, 3 constraints: 1 degree of freedom"


def test_a_moment_without_rank_is_told_from_redundancy_that_stays():
    flat = dataclasses.replace(ivp(), q0=np.array([1.0, 0.0, 3.0, 0.0]), p0=np.zeros(4))  # all bars on one line
    found = freedom(flat)
    assert (found.rank, found.nearby, found.permanent) == (2, 3, False)
    # without the bar in the middle two branches cross there, and it leaves one of them: (v - w)^2 = 0 of the two free directions
    assert (found.forbidden, found.degrees) == (1, 1)
    alone = freedom(dataclasses.replace(ivp(spare=False), q0=flat.q0, p0=flat.p0))
    assert (alone.kind, alone.degrees) == ("change point", 1)


@pytest.mark.usefixtures("plain_functions")
def test_a_case_that_declares_nothing_is_told_what_to_add():
    for chosen, request in (
        (method("rattle"), Request(value=0.01, steps=5)),
        *((parse(name), Request(value=1e-6, t_end=0.1)) for name in ("ida:index2", "ida:ode", "scipy:DOP853")),
    ):
        with pytest.raises(DaebenchError, match=r"rank 3 of 4: g4 .* g2 and g3"):
            chosen.solve(ivp(on_singular="stop"), request).complete()


def test_a_check_counts_freedom_and_writes_out_what_is_redundant():
    declared, silent = (next(each for each in held(ivp(**how)) if each.what == RANK) for how in ({}, {"on_singular": "stop"}))
    assert declared.fault == ""
    assert declared.note.startswith("4 positions, 4 constraints, of rank 3")
    assert "(g4 = (q2/2 + q4/2)**2 + (q1/2 + q3/2 - 1)**2 - 1)" in declared.note
    assert "remove g4" in silent.fault


def test_what_cannot_move_is_refused_in_one_sentence():
    """A point in the plane that two independent constraints hold, and one that is redundant."""
    q, p = coordinates(2)
    start = Case(q=[1 / sp.sqrt(2)] * 2, p=(0, 0), on_singular="least-squares")
    g = [q[0] ** 2 + q[1] ** 2 - 1, q[0] - q[1], q[0] ** 2 - sp.Rational(1, 2)]
    definition = ConstrainedHamiltonian(q=q, p=p, M=sp.eye(2), U=q[1], g=g, cases={"held": start})
    with pytest.raises(BadInput, match="case held, cannot move: G has rank 2 at the start, as many as there are positions; remove"):
        initial_value_problem(definition, "held")
    fault = [each.fault for each in held(make_ivp(source_of(definition, "held"), "held")) if each.what == RANK]
    assert "cannot move" in fault[0]
