"""Health of a run: judged over its steps, whatever is stored, and a body at rest is not lost."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import sympy as sp
from definitions import double_pendulum

from daebench.compiler.definition import source_of
from daebench.diagnostics.consistency import require_consistent
from daebench.diagnostics.energy_verdict import LOST, energy_error, energy_scales, size
from daebench.errors import InconsistentStart
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.plan import plan
from daebench.methods.warnings_on_runs import losses
from daebench.runs.make_ivp import make_ivp
from daebench.systems.constrained import Case, ConstrainedHamiltonian, coordinates

UNITS = (1.0, 1e-9, 1e7)

AT_REST = ("rattle-1e-09", "energy_momentum-10000000.0")
"""Methods of two kinds, in two units of length: what the gate takes."""

LOSING = {
    "generalized_alpha": ("spherical_pendulum", "fig1.2", 0.05, 20.0),
    "implicit_euler": ("spherical_pendulum", "fig1.2", 0.05, 100.0),
    "rattle": ("spherical_pendulum", "fig1.2", 0.002, 2.0),
}
"""Runs that lose their motion and one that does not; the case, the step and the end."""


def solved(problem, method, **settings):
    planned = plan(problem, method=method, **settings)
    chosen, ivp, request = planned.method, planned.ivp, planned.request
    return ivp, (replace(chosen, compiled=False) if hasattr(chosen, "compiled") else chosen).solve(ivp, request)


@pytest.mark.parametrize("method", ["generalized_alpha", "implicit_euler", "rattle"])
def test_the_same_is_said_whatever_is_stored(method):
    problem, case, h, t_end = LOSING[method]
    said = []
    for every in (1, 7, 100, 0):
        ivp, run = solved(problem, method, case=case, h=h, t_end=t_end, every=every)
        assert run.failure is None
        said.append(losses(ivp, run))
    assert all(each == said[0] for each in said)
    assert bool(said[0]) == (method != "rattle")


def hanging(n, unit, gravity=9.81, spring=0.0):
    """Rods that hang at rest, n points below each other, with springs to the side where they are asked for."""
    q, p = coordinates(2 * n)
    points = [sp.Matrix([0, 0]), *[sp.Matrix(q[2 * k : 2 * k + 2]) for k in range(n)]]
    g = [(b - a).dot(b - a) - sp.Float(unit) ** 2 for a, b in pairwise(points)]
    U = sp.Float(gravity) * sum(q[1::2]) + sp.Float(spring) / sp.Float(unit) * sum(x**2 for x in q[::2])
    q0 = [x for k in range(n) for x in (0.0, -(k + 1) * unit)]
    case = Case(q=q0, p=(0,) * (2 * n))
    return make_ivp(source_of(ConstrainedHamiltonian(q=q, p=p, M=sp.eye(2 * n), U=U, g=g, cases={"rest": case}), "hanging"), "rest")


def leaning(unit, angle):
    """A rod at rest at an angle, between gravity and a spring that balances it up to rounding."""
    q, p = coordinates(2)
    x, y = unit * np.sin(angle), -unit * np.cos(angle)
    stiffness = sp.Float(9.81 / (-y)) if y else sp.Float(0)
    U = sp.Float(9.81) * q[1] - stiffness * q[0] ** 2 / 2 + 0 * q[1]
    case = Case(q=(float(x), float(y)), p=(0, 0))
    g = [q[0] ** 2 + q[1] ** 2 - sp.Float(float(x)) ** 2 - sp.Float(float(y)) ** 2]
    return make_ivp(source_of(ConstrainedHamiltonian(q=q, p=p, M=sp.eye(2), U=U, g=g, cases={"rest": case}), "leaning"), "rest")


@pytest.mark.sampled(by=lambda case: case in AT_REST)
@pytest.mark.parametrize("unit", UNITS, ids=str)
@pytest.mark.parametrize("method", ["rattle", "symplectic_euler", "lobatto3", "rk4", "midpoint+symproj", "rk4+proj", "energy_momentum"])
def test_a_body_at_rest_is_not_lost(method, unit):
    for body in (hanging(1, unit), hanging(2, unit, spring=3.0), leaning(unit, 0.7), leaning(unit, 1.2)):
        h = 0.01 * unit**0.5
        ivp, run = solved(body, method, h=h, steps=150)
        assert run.failure is None
        assert losses(ivp, run) == []
        assert size(np.max(np.abs(energy_error(ivp, run))), energy_scales(ivp, run)) < LOST


@pytest.mark.parametrize("unit", UNITS, ids=str)
def test_a_velocity_has_the_floor_of_a_rounding_and_no_more(unit):
    hung = hanging(1, unit)
    rounding = 2.0**-52 * (9.81 * unit) ** 0.5
    for part, accepted in ((1e-3, True), (1.0, True), (100.0, False), (1e6, False)):
        pulled = replace(hung, p0=np.array([0.0, part * rounding]))
        if accepted:
            require_consistent(pulled)
        else:
            with pytest.raises(InconsistentStart):
                require_consistent(pulled)
    nudged = initial_value_problem("planar_pendulum", "horizontal", p0=[1e-17, 0.0])
    assert nudged.p0[0] == 1e-17


def test_a_moving_body_keeps_its_strict_bound():
    swinging = make_ivp(source_of(double_pendulum(), "plain"), "bent")
    with pytest.raises(InconsistentStart):
        require_consistent(replace(swinging, p0=swinging.p0 + np.array([0.0, 1e-11, 0.0, 0.0])))
