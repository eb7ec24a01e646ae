"""Whether every step goes where the velocities lead: a turn that is resolved, the other solution, and a motion that rests."""

import numpy as np
import pytest

from daebench.diagnostics.branch import WRONG, largest_jump


def turning(theta, n=40):
    """Return times, positions and velocities on the unit circle, an angle theta a step and a unit of time each."""
    angle = theta * np.arange(n)
    return np.arange(n, dtype=float), np.stack([np.cos(angle), np.sin(angle)], 1), theta * np.stack([-np.sin(angle), np.cos(angle)], 1)


@pytest.mark.parametrize("theta", [0.01, 0.5, 2.0])
def test_a_turn_that_is_resolved_has_the_jump_of_a_chord(theta):
    expected = abs(2 * np.sin(theta / 2) - theta * np.cos(theta / 2)) / theta
    assert largest_jump(*turning(theta)) == pytest.approx(expected, rel=1e-9)
    assert expected < WRONG


def test_the_point_opposite_is_the_other_branch():
    t, q, v = turning(0.05)
    q[20:], v[20:] = -q[20:], -v[20:]
    assert largest_jump(t, q, v) > 10 * WRONG


def test_a_motion_that_turns_back_is_no_other_branch():
    t = np.linspace(0.0, 10.0, 200)
    assert largest_jump(t, np.cos(t)[:, None], -np.sin(t)[:, None]) < 1e-3


def test_a_motion_that_rests_has_no_jump():
    assert largest_jump(np.arange(5.0), np.ones((5, 2)), np.zeros((5, 2))) == 0.0


def test_several_motions_have_the_jumps_that_each_has_alone():
    t, *one = turning(0.05)
    several = [np.stack([x, turning(2.0)[k + 1], x[::-1]], axis=1) for k, x in enumerate(one)]
    assert largest_jump(t, *several).tolist() == [largest_jump(t, *(x[:, i] for x in several)) for i in range(3)]
