"""Whether G loses rank is decided by G itself: steps that are too large are told from places where it does."""

import itertools
import math

import numpy as np
import pytest
import sympy as sp
from definitions import bowed
from runs import method

from daebench.compiler.definition import source_of
from daebench.diagnostics.rank import loses_rank
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.make_ivp import make_ivp
from daebench.runs.request import Request
from daebench.systems.constrained import Case, ConstrainedHamiltonian, coordinates

UNITS = (1.0, 1e-9, 1e7)
"""Lengths of the mechanisms."""


def rods(n, unit=1.0, halfway=False):
    """Return a chain of n rods with unit masses, released level: at their ends, or half way along each rod."""
    q, p = coordinates(2 * n)
    size, part = sp.Float(unit), sp.Rational(1, 1 + halfway)
    joint, g = sp.zeros(2, 1), []
    for k in range(n):
        rod = sp.Matrix(q[2 * k : 2 * k + 2]) - joint
        g.append(rod.dot(rod) / size - part**2 * size)
        joint += rod / part
    start = Case(q=[x for k in range(n) for x in ((k + part) * size, 0)], p=(0,) * (2 * n))
    return make_ivp(
        source_of(ConstrainedHamiltonian(q=q, p=p, M=sp.eye(2 * n), U=9.81 * sum(q[1::2]), g=g, cases={"level": start}), "rods")
    )


def told(ivp, name, h, steps=100):
    return method(name).solve(ivp, Request(value=h, steps=steps, every=0, on_singular="stop", watch=())).failure or ""


@pytest.mark.sampled(by=lambda case: case in ("half way-rattle", "two-symplectic_euler", "three half way-shake"))
@pytest.mark.parametrize("name", ["rattle", "symplectic_euler", "shake"])
@pytest.mark.parametrize("shape", [(2, True), (2, False), (3, False), (3, True)], ids=["half way", "two", "three", "three half way"])
def test_no_rank_is_lost_where_rods_are_moved_by_too_large_steps(shape, name):
    crossed = itertools.product(UNITS, (0.02, 0.04, 0.1, 0.2))
    failures = [told(rods(shape[0], unit, shape[1]), name, share * math.sqrt(unit)) for unit, share in crossed]
    failures = [failure for failure in failures if failure]
    assert all("use a smaller h" in failure and "loses rank" not in failure for failure in failures)
    assert len(failures) >= len(UNITS)


def test_a_singular_step_of_a_g_that_keeps_its_rank_is_too_large():
    for name, h in (("rattle", 0.03), ("symplectic_euler", 0.02), ("shake", 0.02)):
        failure = told(rods(2, halfway=True), name, h, 1500)
        assert "G keeps its rank" in failure
        assert "use a smaller h" in failure


@pytest.mark.sampled(by=lambda case: case in ("rattle-0.002", "lobatto3-0.1"))
@pytest.mark.parametrize("h", [0.002, 0.01, 0.03, 0.06, 0.1])
@pytest.mark.parametrize("name", ["rattle", "symplectic_euler", "shake", "lobatto3"])
def test_a_mechanism_that_loses_rank_is_named_with_fine_and_with_coarse_steps(name, h):
    for problem, case in (("slider_crank", "lock_up"), ("four_bar", "iftomm")):
        assert "G loses rank at about t = 0." in told(initial_value_problem(problem, case), name, h, math.ceil(1 / h))


def test_the_way_of_a_state_meets_a_loss_of_rank_exactly_where_it_is():
    crossing, resolved = (make_ivp(source_of(bowed(d), "bowed"), "in") for d in (0.0, 0.02))
    t = 1.0
    assert loses_rank(crossing, crossing.p0, crossing.q0, 0.1, 1.3 * t)
    assert not loses_rank(crossing, crossing.p0, crossing.q0, 0.1, 0.6 * t)
    assert not loses_rank(resolved, resolved.p0, resolved.q0, 0.1, 1.3 * t)


def test_a_folded_double_pendulum_keeps_its_rank():
    folded = rods(2)
    for angle in np.linspace(0, 3, 7):
        x, y = math.cos(angle), math.sin(angle)
        q, v = np.array([x, y, 1e-9, 0.0]), np.array([-y, x, 0.0, 1.0])
        v[2:] = [v[0] + 0.5 * -(q[3] - y), v[1] + 0.5 * (q[2] - x)]
        assert not loses_rank(folded, v, q, 0.1, 0.5)
