"""The programs in C that kernels are timed against take the steps of the kernels."""

import numpy as np
import pytest

from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.request import Request
from daebench.studies.timers import BY_HAND, compiler, program

CASES = {"spherical_pendulum": "fig1.1", "rigid_water": "tumbling"}


@pytest.mark.skipif(compiler() is None, reason="there is no C compiler")
@pytest.mark.parametrize("name", BY_HAND)
def test_a_program_in_c_takes_the_steps_of_the_kernel(tmp_path, name):
    ivp = initial_value_problem(BY_HAND[name], CASES[BY_HAND[name]])
    run = FixedStep(name, compiled=False).solve(ivp, Request(value=0.01, steps=200, every=0)).complete()
    state, _ = program(tmp_path, name, ivp)(0.01, 200)
    linked = np.concatenate([run.p[-1], run.q[-1]])
    assert np.abs(linked - np.concatenate([ivp.p0, ivp.q0])).max() > 0.1
    assert np.abs(state - linked).max() < 1e-12 * np.abs(linked).max()
