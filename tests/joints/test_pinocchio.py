"""Mechanisms of ``daebench.joints`` against the accelerations of Pinocchio, where it is installed."""

import numpy as np
import pytest
from mechanisms import MECHANISMS, accelerations, moving, named

pytest.importorskip("pinocchio")

CLOSENESS = 1e-10


@pytest.mark.parametrize("name", MECHANISMS)
def test_the_points_of_a_mechanism_accelerate_as_pinocchio_says(random, name):
    from free_bodies import in_space, point_accelerations

    mechanism = MECHANISMS[name]()
    problem = mechanism.problem()
    for _ in range(3):
        q, v = moving(problem, random)
        expected = point_accelerations(mechanism, named(problem, q), named(problem, v, speeds=True))
        found = named(problem, accelerations(problem, q, v), speeds=True)
        size = max(1.0, *(np.abs(x).max() for x in expected.values()))
        assert max(np.abs(in_space(found[point]) - expected[point]).max() for point in expected) < CLOSENESS * size
