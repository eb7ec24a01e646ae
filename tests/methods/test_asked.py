"""What is asked of Newton's iteration besides round-off is run-time data: one kernel serves all numbers of iterations and tolerances."""

import numpy as np
import pytest

from daebench.methods.ensemble.run import run_members
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.runs.members import members
from daebench.runs.request import Request

STEPS = 40


def run(ivp, **asked):
    return FixedStep("rattle", **asked).solve(ivp, Request(value=0.01, steps=STEPS, watch=())).complete()


@pytest.mark.parametrize("sweeps", [1, 2, 3, 7])
def test_as_many_iterations_are_made_as_are_asked_for(get_ivp, sweeps):
    ivp = get_ivp("spherical-fast")
    compiled, plain = run(ivp, sweeps=sweeps), run(ivp, sweeps=sweeps, compiled=False)
    assert compiled.work["newton"] == plain.work["newton"] == sweeps * STEPS
    np.testing.assert_array_equal(compiled.q, plain.q)


def test_a_larger_tolerance_leaves_a_larger_residual_and_takes_fewer_iterations(get_ivp):
    ivp = get_ivp("spherical-fast")
    runs = [run(ivp, **asked) for asked in ({}, {"roundings": 1e8}, {"roundings": 1e12})]
    residuals = [np.max(np.abs(ivp.along("g", each.q))) for each in runs]
    work = [each.work["newton"] for each in runs]
    assert residuals[0] < 1e-14
    assert residuals == sorted(residuals)
    assert work == sorted(work, reverse=True)
    assert work[-1] < work[0]


@pytest.mark.parametrize("asked", [{"sweeps": 3}, {"roundings": 1e8}], ids=["sweeps", "roundings"])
def test_lanes_and_dual_numbers_end_their_iterations_alike(get_ivp, asked):
    ivp, method = get_ivp("spherical-fast"), FixedStep("rattle", **asked)
    alone = run(ivp, **asked)
    many = members(ivp, tuple(np.repeat([x], 8, axis=0) for x in ivp.start), 0.01, {})
    together = run_members(method, many, Request(value=0.01, steps=STEPS, watch=()), lanes=8, threads=1)
    np.testing.assert_array_equal(together.states[-1], np.repeat([np.concatenate([alone.p[-1], alone.q[-1]])], 8, axis=0))
    differentiated = method.solve(ivp, Request(value=0.01, steps=STEPS, watch=(), sensitivities=("q0",))).complete()
    np.testing.assert_allclose(differentiated.q, alone.q, rtol=0, atol=1e-13)
