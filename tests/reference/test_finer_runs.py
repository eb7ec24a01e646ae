"""Finer runs that errors are taken against where no certified reference fits: as near to certified motions as their bounds say."""

import numpy as np
import pytest

from daebench.methods.initial_value_problem import initial_value_problem
from daebench.reference.solution import certified_for, own_run


@pytest.mark.sampled(left_out=("bricard-5.0",))
@pytest.mark.parametrize(("problem", "t_end"), [("bricard", 5.0), ("cyclohexane_ring", 2.0)])
def test_with_redundant_constraints_they_are_the_certified_motion_with_multipliers_of_least_norm(problem, t_end):
    where = initial_value_problem(problem)
    certified = certified_for(where, t_end)
    stored = np.searchsorted(certified.t, t_end) + 1
    found = own_run(where, certified.t[:stored])
    for name in ("q", "p", "lam"):
        difference = np.linalg.norm(found.states[name] - certified.values[name][:stored], axis=1)
        assert 0 < np.max(difference) <= np.max(found.bound[name]) < 1e-6
