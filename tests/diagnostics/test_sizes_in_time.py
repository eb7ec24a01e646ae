"""The time among the positions: it is no degree of freedom, no length, no speed and no part of the kinetic energy."""

import dataclasses

import numpy as np
import pytest
import sympy as sp
from refusals import refused

from daebench.diagnostics.combined import combined
from daebench.diagnostics.energy_verdict import energy_scales
from daebench.diagnostics.freedom import dependence, freedom
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.members import members
from daebench.runs.request import Request
from daebench.runs.scales import constrained_scales, constrained_scales_of
from daebench.studies.chaos.plane import surface
from daebench.systems.constrained import Case, ConstrainedHamiltonian

x, y, px, py, vx, vy, t = sp.symbols("x y px py vx vy t", real=True)
SMALL = sp.Rational(1, 1000)
ROUND = (x - SMALL * sp.sin(t)) ** 2 + y**2 - SMALL**2
ROUND_AT_REST = x**2 + y**2 - SMALL**2
MOVED = {"a": Case(q=(SMALL, 0), p=(SMALL, 0))}
TURNED = {"a": Case(q=(SMALL, 0), p=(0, SMALL))}


def pendulum(**more):
    """Return a small pendulum, a thousandth of a metre long, at rest."""
    settings = {
        "q": (x, y),
        "p": (px, py),
        "H": (px**2 + py**2) / 2 + y / 1000,
        "g": [x**2 + y**2 - SMALL**2],
        "cases": {"a": Case(q=(SMALL, 0), p=(0, 0))},
    }
    return ConstrainedHamiltonian(**settings | more)


def test_scales_are_those_of_the_same_motion_without_time():
    """A time that stands in no equation is in no length and in no rate; neither is its rate 1 a speed."""
    plain, timed = (initial_value_problem(problem) for problem in (pendulum(), pendulum(t=t)))
    assert constrained_scales(timed, 0.01, rated=True) == constrained_scales(plain, 0.01, rated=True)
    for ivp in (plain, timed):
        many = members(ivp, tuple(part[None] for part in ivp.start), 0.01, {})
        length, rate = constrained_scales_of(many, rated=True)
        assert (length[0], rate[0]) == constrained_scales(ivp, 0.01, rated=True)


def test_the_time_is_no_degree_of_freedom():
    driven = initial_value_problem(pendulum(t=t, g=[ROUND], cases=MOVED))
    assert freedom(driven).count == "2 positions, 1 constraint: 1 degree of freedom"
    moved = initial_value_problem(pendulum(t=t, g=[x - SMALL * sp.cos(t), y - SMALL * sp.sin(t)], cases=TURNED))
    assert freedom(moved).degrees == 0


def test_redundant_constraints_in_time_are_named_and_combined_with_their_forces():
    twice = pendulum(t=t, v=(vx, vy), force=(-vx / 3, t / 10), g=[ROUND, 2 * ROUND], cases=MOVED)
    ivp = initial_value_problem(twice)
    assert "g2 is a combination of g1" in dependence(ivp)
    one = combined(dataclasses.replace(ivp, on_singular="least-squares"))
    assert one.m == 1
    single = initial_value_problem(dataclasses.replace(twice, g=[ROUND]))
    p, q = np.array([3e-4, 2e-4, 0.1]), np.array([0.001, 0.0, 0.2])
    assert one.value("H_q", p, q) == pytest.approx(single.value("H_q", p, q), rel=1e-14)
    assert abs(single.value("H_q", p, q)[1] - 1e-3 + 0.02) < 1e-15


def test_a_driver_that_contradicts_another_later_is_told_from_one_that_is_redundant():
    """All begin at rest: x of a point on a circle, whose y is driven, goes as y says or otherwise."""
    drivers = [ROUND_AT_REST, y - SMALL * sp.sin(t**2)]
    for more, contradicts in ((x - SMALL * sp.cos(t**2), False), (x - SMALL * sp.cos(2 * t**2), True)):
        ivp = initial_value_problem(pendulum(t=t, g=[*drivers, more]))
        assert ("contradicts" in dependence(ivp)) == contradicts


@pytest.mark.parametrize(("second", "goes_on"), [(0, True), (1, False)], ids=str)
def test_a_start_needs_an_acceleration_with_the_terms_of_time(second, goes_on):
    """Two drivers of y that agree in their places and velocities at the start, and in their accelerations or not."""
    drivers = [y - SMALL * sp.sin(t), y - SMALL * (sp.sin(t) + second * t**2)]
    driven = pendulum(q=(x, y), t=t, g=drivers, cases={"a": Case(q=(SMALL, 0), p=(SMALL, SMALL))})
    if goes_on:
        assert "g2 is a combination of g1" in dependence(initial_value_problem(driven))
    else:
        with refused("no-motion-at-second-order", says=("driver",)):
            initial_value_problem(driven)


def test_the_energies_of_a_run_are_those_of_positions():
    """A potential that depends on the time alone does not move anything, and p_t, which takes it up, is no momentum of a mass."""
    kinetic = []
    for problem in (pendulum(), pendulum(t=t, H=(px**2 + py**2) / 2 + y / 1000 + sp.sin(t))):
        ivp = initial_value_problem(problem)
        run = FixedStep("rattle", compiled=False).solve(ivp, Request(value=0.01, steps=50, every=1))
        kinetic.append(energy_scales(ivp, run).kinetic)
    assert kinetic[1] == pytest.approx(kinetic[0], rel=1e-9)


def test_a_section_takes_two_degrees_of_freedom_and_a_constant_energy():
    assert surface(initial_value_problem("double_pendulum"), {"q1": 0.0}, {"q2": 0, "p2": 0}, 1.0) == ("q1", 0.0)
    with refused("section-not-two-degrees"):
        surface(initial_value_problem(pendulum(t=t)), {"q1": 0.0}, {"q2": 0, "p2": 0}, 1.0)
