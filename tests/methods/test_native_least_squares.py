"""Compiled callbacks where multipliers are found by least squares do what Python callbacks do, also under redundant constraints."""

import dataclasses

import definitions
import numpy as np
import pytest
from measures import differences, error_of, right_side
from refusals import refused

import daebench
from daebench.compiler.definition import source_of
from daebench.methods.solvers import least_squares
from daebench.runs.make_ivp import make_ivp

METHODS = ("ida:ode", "cvode:adams", "cvode:bdf")


def doubled(**changes):
    """Return the double pendulum of ``definitions`` with a third constraint that is a combination of its two."""
    base = definitions.double_pendulum()
    return dataclasses.replace(base, g=[*base.g, base.g[0] - 2 * base.g[1]], **changes)


def both(problem, **settings):
    """Return a run by least squares with compiled callbacks, and one with Python callbacks."""
    return [daebench.run(problem, on_singular="least-squares", callbacks=callbacks, **settings) for callbacks in ("native", "python")]


def same(native, python):
    """Assert that two runs have the same steps, calls, end and passages, and states within 1e-15 of their size."""
    assert (native.callbacks, python.callbacks) == ("native", "python")
    assert dict(native.work) == dict(python.work)
    assert native.work["jacobian"] > 0
    assert native.failure == python.failure
    assert [passage.branch for passage in native.passages] == [passage.branch for passage in python.passages]
    assert np.array_equal(native.t, python.t)
    ours, theirs = (np.hstack([run.q, run.p]) for run in (native, python))
    assert error_of(ours, theirs) <= 1e-15 * np.abs(theirs).max()


@pytest.mark.sampled(by=lambda case: case == "ida:ode-1e-05")
@pytest.mark.parametrize("tol", [1e-5, 1e-11])
@pytest.mark.parametrize("method", METHODS)
def test_both_kinds_of_callbacks_give_the_same_run_under_redundant_constraints(method, tol):
    same(*both(doubled(), case="bent", method=method, tol=tol, t_end=2.0, points=21))


@pytest.fixture
def plain(monkeypatch):
    """Have nothing compiled."""
    monkeypatch.setattr(least_squares, "COMPILED", False)


def posed():
    ivp = make_ivp(source_of(doubled(), "doubled"), "bent")
    return least_squares.by_least_squares(dataclasses.replace(ivp, on_singular="least-squares"))


@pytest.mark.usefixtures("plain")
def test_the_jacobian_is_that_of_differences_along_the_constraints():
    dae = posed()
    JJ, residual_y = np.empty((2, dae.n, dae.n))
    assert dae.rhs_jacobian(0.0, dae.y0, JJ, dae.par) > 1e-3
    assert error_of(differences(lambda y: right_side(dae, y), dae.y0), JJ) < 1e-7
    dae.jacobian(0.0, dae.y0, dae.yp0, np.empty(dae.n), 7.0, residual_y, dae.par)
    assert error_of(residual_y, 7.0 * np.eye(dae.n) - JJ) < 1e-14


@pytest.mark.usefixtures("plain")
def test_a_record_of_steps_is_refused_where_callbacks_are_not_compiled():
    settings = {"case": "bent", "method": "ida:ode", "tol": 1e-6, "t_end": 1.0, "on_singular": "least-squares", "solver_steps": True}
    with refused("native-callbacks-missing"):
        daebench.run(doubled(), **settings)
