"""Parts of runs against their definitions: the largest errors, splines, scales, members, and the bounds of references."""

import numpy as np
import pytest
from ivps import ivp
from measures import error_of
from runs import run

from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.interpolant import Interpolant
from daebench.runs.members import members
from daebench.runs.scales import constrained_scales
from daebench.studies.ensemble.energies import along_members
from daebench.studies.ensemble.references import bounds_of


def test_the_largest_errors_are_those_of_the_states_up_to_the_last():
    where = ivp("planar")
    found = run("rk4", where, 0.1, 4)
    assert found.maxima["g"] == pytest.approx(error_of(np.sum(found.q**2, axis=1), 1), rel=1e-6)
    H = np.sum(found.p**2, axis=1) / 2 + found.q[:, 1]
    assert found.maxima["energy"] == pytest.approx(error_of(H, H[0]), rel=1e-6)
    assert np.argmax(np.abs(H - H[0])) == 4


@pytest.mark.parametrize(("outputs", "degree"), [(2, 1), (3, 1), (4, 3), (5, 3), (6, 5), (9, 5)])
def test_states_between_outputs_are_exact_for_polynomials_of_the_degree_of_the_splines(outputs, degree):
    t = np.linspace(0, 1, outputs) ** 1.2
    between = np.linspace(0, 1, 17)
    found = Interpolant(t, {"q": (1 + 2 * t**degree)[:, None]})(between)["q"][:, 0]
    assert found == pytest.approx(1 + 2 * between**degree, abs=1e-12)


def test_the_rate_of_a_pendulum_is_that_of_its_turning_or_of_its_weight():
    slow = initial_value_problem("planar_pendulum", "horizontal", {"length": 4.0, "gravity": 9.0}, q0=(4.0, 0.0), p0=(0.0, 0.0))
    assert constrained_scales(slow, 1e-3, rated=True) == pytest.approx((4.0, 1.5))
    fast = initial_value_problem("planar_pendulum", "horizontal", {"length": 4.0, "gravity": 9.0}, q0=(4.0, 0.0), p0=(0.0, 20.0))
    assert constrained_scales(fast, 1e-3, rated=True) == pytest.approx((4.0, 5.0))


def pendulums():
    """Return three members of the planar pendulum with masses of their own."""
    q, p = np.array([[1.0, 0.0], [0.0, -1.0], [0.6, 0.8]]), np.array([[0.0, 1.0], [2.0, 0.0], [0.8, -0.6]])
    return members(initial_value_problem("planar_pendulum"), (p, q), 0.1, {"mass": np.array([1.0, 2.0, 4.0])})


def test_some_members_keep_their_weights_and_parameters():
    some = pendulums().weighted([[0.5, 0.5], [0.2, 0.8], [1.5, -0.5]]).some(np.array([2, 0]))
    assert some.weights.tolist() == [[1.5, -0.5], [0.5, 0.5]]
    assert [some.member(i).parameters["mass"] for i in range(2)] == [4.0, 1.0]


def test_weights_are_refused_whose_sum_is_off_one_by_more_than_rounding():
    from daebench.errors import BadInput

    with pytest.raises(BadInput, match="must sum to 1"):
        pendulums().weighted([[0.5, 0.5], [0.2, 0.8], [1.5, -0.5 + 1e-9]])


def test_energies_of_members_are_those_of_their_masses():
    some = pendulums()
    states = np.concatenate(some.start, axis=1)[None].repeat(3, axis=0)
    along = along_members(some, np.array([0.0, 0.1, 0.2]), states)
    assert along.T[:, 0] == pytest.approx([0.5, 1.0, 0.125])
    assert along.H[:, 0] == pytest.approx([0.5, 1.0 - 2.0, 0.125 + 3.2])


def test_the_bound_of_a_member_is_that_of_the_typical_one_at_least():
    used = np.zeros((2, 4, 1)) + 1e-9
    other = used + np.array([1e-6, 1e-9, 2e-6, np.nan])[:, None]
    bounds = bounds_of(used, other)
    assert bounds[3] == np.inf
    assert bounds[1] == bounds[0] < bounds[2]
    assert bounds[2] == pytest.approx(2 * bounds[0])
