"""Nothing that is not finite is a success: no state, multiplier or monitored quantity, of any method, whatever is monitored."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from leaving import ENDS, ending, ending_poisson

from daebench.compiler.definition import source_of
from daebench.methods.names import CONSTRAINED, POISSON, parse
from daebench.runs.make_ivp import make_ivp
from daebench.runs.request import Request
from daebench.runs.trajectory import PoissonTrajectory, Trajectory
from daebench.systems.constrained import Case, ConstrainedHamiltonian, coordinates

WATCHES = {"nothing": (), "energy": ("energy",), "manifold": ("manifold",)}


pytestmark = pytest.mark.usefixtures("plain_functions")


def uncompiled(method):
    """Return a method whose kernel, if it has one, is not compiled."""
    return replace(method, compiled=False) if method.knob == "h" else method


def request(method, **more):
    """Return a request that goes far beyond the end of the motion."""
    return Request(value=0.02 if method.knob == "h" else 1e-6, t_end=6.0, **more)


METHODS = [each.name for each in CONSTRAINED.listed() if each.name != "cvode:bdf:projected"]
"""All but one that has no uncompiled functions: what becomes of it is in test_projected_cvode."""


CASES = [
    pytest.param(
        name,
        end,
        watch,
        id=f"{name}-{end}-{watch}",
        marks=() if i % 2 == (i + k) % len(ENDS) == 0 and j == i % 3 else pytest.mark.exhaustive,
    )
    for (i, name), (k, end), (j, watch) in itertools.product(*map(enumerate, (METHODS, ENDS, WATCHES)))
]
"""All methods beyond all ends, of which the gate takes every other method beyond one."""


@pytest.mark.parametrize(("name", "end", "watch"), CASES)
def test_no_method_comes_to_the_end_of_a_run_beyond_the_end_of_the_motion(name, end, watch):
    ivp, method = ending(end), uncompiled(parse(name))
    if method.refusal(ivp):
        pytest.skip(method.refusal(ivp))
    run = method.solve(ivp, request(method, watch=WATCHES[watch]))
    assert run.failure is not None
    assert np.isfinite(ivp.along("H", run.p, run.q)).all()
    assert all(np.isfinite(value) for value in run.maxima.values())


@pytest.mark.parametrize("name", [method.name for method in POISSON.listed()])
def test_no_method_for_poisson_systems_does_either(name):
    ivp, method = ending_poisson(), uncompiled(parse(name, kind=POISSON))
    if method.refusal(ivp):
        pytest.skip(method.refusal(ivp))
    run = method.solve(ivp, request(method, watch=("energy",)))
    assert run.failure is not None
    assert np.isfinite(ivp.along("H", run.y)).all()


def outcome(**more):
    """Return the fields of a run that is complete."""
    return {"problem": "x", "case": "y", "method": "z", "parameters": {}, "knob": "h", "value": 0.1, "steps": 2, "seconds": 0.0} | more


@pytest.mark.parametrize("place", ["q", "p", "lam", "y", "raw", "maximum"])
def test_a_trajectory_with_a_number_that_is_not_finite_is_a_failure_wherever_it_comes_from(place):
    t, rows = np.array([0.0, 0.25, 0.5]), np.ones((3, 2))
    for wrong in (np.nan, np.inf, -np.inf, 1.0):
        bad = np.array([[1.0, 1.0], [1.0, wrong], [1.0, 1.0]])
        given = outcome(t=t, maxima={"energy": wrong if place == "maximum" else 0.0})
        if place == "y":
            run = PoissonTrajectory(**given, y=bad)
        else:
            states = {name: bad if place == name else rows for name in ("q", "p", "lam")}
            run = Trajectory(**given, **states, raw={"end": (t, bad)} if place == "raw" else {})
        if wrong == 1.0:
            assert run.failure is None
        else:
            assert ("energy" if place == "maximum" else "t = 0.25") in (run.failure or ""), wrong


def test_an_energy_that_overflows_while_states_do_not_is_a_failure_though_nothing_is_watched():
    q, p = coordinates(2)
    cases = {"falling": Case(q=(0, 0), p=(0, 0))}
    problem = ConstrainedHamiltonian(q=q, p=p, M=sp.eye(2), U=-(sp.Integer(10) ** 158) * q[1], g=[q[0]], cases=cases)
    run = uncompiled(parse("symplectic_euler")).solve(make_ivp(source_of(problem), "falling"), Request(value=1.0, steps=3, watch=()))
    assert np.isfinite(run.p).all()
    assert "H is not" in (run.failure or "")


def test_a_start_outside_of_the_domain_is_said_to_be_that():
    ivp = ending("log")
    outside = replace(ivp, q0=np.array([-0.6, 0.8]))
    for name in ("rattle", "ida:index2", "scipy:DOP853", "cvode:bdf"):
        method = uncompiled(parse(name))
        run = method.solve(outside, request(method))
        assert run.failure is not None
        assert "H " in run.failure
