"""Mechanisms of ``daebench.joints`` against problems of the catalogue, which are written out by hand, and against minimal coordinates."""

import numpy as np
import pytest
from measures import error_of
from mechanisms import accelerations, four_bar, heavy_top, masses_on_strings, moving, slider_crank

from daebench.problems import double_pendulum, double_spherical_pendulum, rigid_body_rotation
from daebench.problems import four_bar as bars
from daebench.problems import slider_crank as crank


def top_by_hand():
    problem = rigid_body_rotation.problem(I1=15.234375, I2=0.46875, I3=15.234375, mass=15.0, gravity=9.81)
    return problem, lambda x: x.reshape(3, 3).T.ravel()


def as_it_is(problem):
    return problem, lambda x: x


PAIRS = {
    "slider crank": (slider_crank, lambda: as_it_is(crank.problem())),
    "double pendulum": (lambda: masses_on_strings((1, 0), (2, 0)), lambda: as_it_is(double_pendulum.problem())),
    "double spherical pendulum": (
        lambda: masses_on_strings(("0.6", 0, "-0.8"), ("0.6", 1, "-0.8")),
        lambda: as_it_is(double_spherical_pendulum.problem()),
    ),
    "four bar": (four_bar, lambda: as_it_is(bars.problem(bars=2).written_out())),
    "heavy top": (heavy_top, top_by_hand),
}


@pytest.mark.parametrize(("mechanism", "by_hand"), PAIRS.values(), ids=PAIRS)
def test_a_mechanism_accelerates_as_the_same_one_written_by_hand(random, mechanism, by_hand):
    problem, (hand, ordered) = mechanism().problem(), by_hand()
    assert (problem.d, problem.m) == (hand.d, hand.m)
    for _ in range(3):
        q, v = moving(problem, random)
        expected = accelerations(hand, ordered(q), ordered(v))
        assert error_of(ordered(accelerations(problem, q, v)), expected) < 1e-10 * max(1.0, np.abs(expected).max())
