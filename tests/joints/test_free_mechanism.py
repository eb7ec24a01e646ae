"""A mechanism without any constraint: a mass on a spring, against SciPy on its equations by hand and the frequencies of textbooks."""

import numpy as np
from integrating import by_dop853
from measures import error_of

import daebench
from daebench.joints import Mechanism, PointMass, Spring, Start

MASS, STIFFNESS, LENGTH, GRAVITY = 10.0, 1000.0, 20.0, 9.81

TETHER = Mechanism(
    ground={"O": (0, 0)},
    points={"A": (0, -20)},
    bodies={"bucket": PointMass("A", 10)},
    forces=[Spring("O", "A", stiffness=1000)],
    gravity=(0, "-9.81"),
    cases={"pushed": Start(velocity={"A": (3, 0)})},
)


def by_hand(t, y):
    pull = -STIFFNESS / MASS * (1 - LENGTH / np.hypot(*y[:2])) * y[:2]
    return [*y[2:], pull[0], pull[1] - GRAVITY]


def test_a_mass_on_a_spring_moves_as_its_equations_say(plain_functions):
    run = daebench.run(TETHER.problem(), method="scipy:DOP853", tol=1e-10, t_end=3)
    exact = by_dop853(by_hand, [0, -LENGTH, 3, 0], 3)
    assert error_of(run.q[-1], exact[:2]) < 1e-7


def test_it_swings_as_a_pendulum_and_along_the_spring():
    found = daebench.modes(TETHER.problem(), methods=["rattle"])
    stretched = LENGTH + MASS * GRAVITY / STIFFNESS
    np.testing.assert_allclose(np.sort(found.frequencies), [np.sqrt(GRAVITY / stretched), np.sqrt(STIFFNESS / MASS)], rtol=1e-7)
    assert len(found.damped) == 0
