"""Reference solutions: both kinds against each other and against a motion in angles, their bounds, and where they end."""

from dataclasses import replace

import definitions
import numpy as np
import pytest
import sympy as sp
from integrating import by_dop853
from ivps import ivp
from refusals import refused
from studies import plain

from daebench.compiler.definition import source_of
from daebench.errors import RunFailed
from daebench.reference.solution import integrated, multipliers_between, reach, reference_solution
from daebench.runs.make_ivp import make_ivp
from daebench.studies.orders.study import study

pytestmark = pytest.mark.usefixtures("plain_functions")

TIMES = np.arange(1, 9) / 4


def double_pendulum_in_angles(times):
    """States of ``definitions.double_pendulum``, case bent, from its equations in angles: no constraint, no multiplier."""

    def field(_, y):
        a, b, da, db = y
        mass = np.array([[3, 2 * np.cos(a - b)], [2 * np.cos(a - b), 2]])
        force = [-2 * db**2 * np.sin(a - b) - 3 * np.sin(a), 2 * da**2 * np.sin(a - b) - 2 * np.sin(b)]
        return [da, db, *np.linalg.solve(mass, force)]

    a, b, da, db = by_dop853(field, [0, np.pi / 2, 1, 0.75], times, max_step=0.01).T
    upper, lower = (np.array([np.sin(x), -np.cos(x)]) for x in (a, b))
    turned, bent = (rate * np.array([np.cos(x), np.sin(x)]) for x, rate in ((a, da), (b, db)))
    return np.vstack([upper, upper + lower]).T, np.vstack([turned, 2 * (turned + bent)]).T


def test_both_kinds_of_reference_agree_within_the_bound_of_the_worse():
    exact, steps = reference_solution(ivp("planar"), TIMES), integrated(ivp("planar"), TIMES)
    assert (exact.kind, steps.kind) == ("closed form", "DOP853")
    for name in ("q", "p", "lam"):
        difference = np.linalg.norm(exact.states[name] - steps.states[name], axis=1)
        assert np.max(difference) <= steps.bound[name] < 1e-8
        assert exact.bound[name] < 1e-14


def test_the_reference_is_the_motion_in_angles():
    found = reference_solution(ivp("double-pendulum"), TIMES)
    assert found.kind == "DOP853"
    for name, exact in zip("qp", double_pendulum_in_angles(TIMES), strict=True):
        assert 0 < np.max(np.linalg.norm(found.states[name] - exact, axis=1)) <= found.bound[name] < 1e-9
    assert found.bound["q"] < 1e-10


def test_multipliers_between_known_times_are_those_of_the_motion_itself():
    fine = np.arange(1, 33) / 16
    known, all_ = reference_solution(ivp("planar"), fine[3::4]), reference_solution(ivp("planar"), fine)
    times = [0.0, 1.0, *fine[[30, 0, 17, 5]]]
    lam, bound = multipliers_between(ivp("planar"), known, times)
    assert np.max(np.abs(lam[1:, 0] - all_.states["lam"][[15, 30, 0, 17, 5], 0])) <= bound < 1e-10
    q, p = ivp("planar").q0, ivp("planar").p0
    assert lam[0, 0] == pytest.approx((p @ p - q[1]) / 2, rel=1e-14)


def test_a_reference_that_breaks_down_is_an_error_that_says_when():
    q = sp.symbols("q1:3", real=True)
    facts = definitions.stretched()
    bad = replace(facts, M=sp.eye(2), U=1 / (q[0] - sp.Rational(1, 5)), cases={}, parameters={})
    lowest = [float(x) for x in facts.cases["swing"].q]
    with refused("reference-solution-stopped", RunFailed):
        reference_solution(make_ivp(source_of(bad, "pole"), "", p0=[1.0, 0.0], q0=lowest), [50.0])


def test_the_default_end_time_follows_the_motion():
    slow, fast = (reach(ivp(name), 64) for name in ("spherical-slow", "spherical-fast"))
    assert 5 * fast < slow < 20 * fast
    assert study(ivp("spherical-fast"), [plain("rattle")], h=1 / 32, halvings=2).t_end == 4.0
