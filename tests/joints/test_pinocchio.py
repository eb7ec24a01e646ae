"""Mechanisms of ``daebench.joints`` against the accelerations of Pinocchio, where it is installed."""

import numpy as np
import pytest
from mechanism_states import loads
from mechanisms import GRAVITY, MECHANISMS, accelerations, moving, named

from daebench.joints import Mechanism, Rod

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


def five_bar():
    """Two cranks on the ground, and two links between them: two degrees of freedom."""
    return Mechanism(
        ground={"O": (0, 0), "Q": (2, 0)},
        points={"A": ("-0.5", "0.8"), "B": ("2.4", "0.9"), "C": ("0.9", "1.9")},
        bodies={"left": Rod("O", "A", mass=2), "right": Rod("Q", "B", mass=3), "up": Rod("A", "C", mass=1), "over": Rod("C", "B", mass=1)},
        gravity=(0, "-" + GRAVITY),
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", ["five_bar", "double_rod", "wishbones"])
def test_the_pins_of_a_mechanism_bear_what_pinocchio_says(random, name):
    from free_bodies import in_space, motion_and_forces

    mechanism = {"five_bar": five_bar, **MECHANISMS}[name]()
    problem = mechanism.problem()
    for _ in range(3):
        q, v = moving(problem, random)
        _, expected = motion_and_forces(mechanism, named(problem, q), named(problem, v, speeds=True))
        pins = {(load.at, on): in_space(load.force[0]) for (_, on), load in loads(problem, q, v).items()}
        size = max(np.abs(x).max() for x in expected.values())
        assert {*pins} == {key for key in expected if key[1] != "ground"}
        assert max(np.abs(pins[key] - expected[key]).max() for key in pins) < CLOSENESS * size
