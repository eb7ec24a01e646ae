"""What the rounding of a state changes the energy by: against changed states, and where the energy itself is zero."""

import numpy as np
import pytest

from daebench.diagnostics.energy import energy_drift
from daebench.diagnostics.integrals import energy_rounding
from daebench.methods.initial_value_problem import initial_value_problem

PROBLEMS = ["planar_pendulum", "spherical_pendulum", "double_pendulum", "free_rigid_body"]


@pytest.mark.sampled(left_out=("planar_pendulum", "double_pendulum"))
@pytest.mark.parametrize("name", PROBLEMS)
def test_no_change_of_the_state_by_a_part_of_its_largest_coordinate_changes_the_energy_by_more(name, random):
    ivp, part = initial_value_problem(name, None, {}), 1e-6
    most = 0.0
    for _ in range(400):
        moved = [x + part * np.max(np.abs(x)) * random.choice([-1.0, 1.0], x.shape) for x in ivp.start]
        most = max(most, abs(float(ivp.value("H", *moved)) - float(ivp.value("H", *ivp.start))))
    assert most == pytest.approx(energy_rounding(ivp, part), rel=1e-3)


def test_a_pendulum_that_begins_horizontally_has_no_energy_and_one_rounding_of_it():
    ivp = initial_value_problem("planar_pendulum", "horizontal", {})
    assert float(ivp.value("H", *ivp.start)) == 0
    assert energy_rounding(ivp, 2.0**-52) == 2.0**-52


def test_roundings_of_either_sign_are_kept_and_roundings_one_way_are_not(random):
    n = 10_000
    t = np.arange(n + 1.0)
    roundings = 2.0**-53 * random.choice([-1.0, 1.0], n)
    for signs, verdict in ((roundings, "kept"), (np.abs(roundings), "drifts")):
        assert energy_drift(t, np.concatenate([[0.0], np.cumsum(signs)]), scale=1.0, steps=n).verdict == verdict
