"""Damped modes of mechanisms against roots of their equations in angles, written by hand."""

import numpy as np
import pytest
import sympy as sp
from scipy.linalg import eig
from scipy.optimize import brentq

import daebench
from daebench.joints import (
    Angle,
    Damper,
    DrivenCoordinate,
    Guided,
    Mechanism,
    PDMotor,
    PointMass,
    Rod,
    RotationalDamper,
    RotationalSpring,
    t,
)


def test_an_arm_that_a_motor_holds_swings_about_the_angle_where_it_and_its_weight_balance():
    """I s^2 + kd s + kp - m g (l/2) sin(theta) = 0 with kp (target - theta) = m g (l/2) cos(theta)."""
    problem = Mechanism(
        ground={"O": (0, 0)},
        points={"A": (2, 0)},
        bodies={"arm": Rod("O", "A", mass=3)},
        angles={"shoulder": Angle("arm", armature="0.4")},
        forces=[PDMotor("shoulder", 80, 5, target=2 * sp.pi + sp.cos(3 * t))],
        gravity=(0, "-9.81"),
    ).problem()
    found = daebench.modes(problem, methods=["rattle"])
    theta = brentq(lambda x: 80 * (2 * np.pi + 1 - x) - 29.43 * np.cos(x), 0, 9, xtol=1e-14)
    assert found.rest.q[2] == pytest.approx(theta, rel=1e-9)
    (expected,) = (x for x in np.roots([4.4, 5, 80 - 29.43 * np.sin(theta)]) if x.imag > 0)
    assert found.damped == pytest.approx([expected], rel=1e-8)
    assert found.frequencies == pytest.approx([abs(expected)], rel=1e-9)
    assert found.steps["rattle"] == pytest.approx(2 / abs(expected), rel=1e-4)


def test_two_joints_with_springs_and_a_damper_have_the_roots_of_their_pencil():
    """In x and y of the rods, stretched out: M = (5/3, 1/2; 1/2, 1/3), K = (9 + 4, -4; -4, 4), C = c (1, -1; -1, 1)."""
    problem = Mechanism(
        ground={"O": (0, 0)},
        points={"A": (1, 0), "B": (2, 0)},
        bodies={"upper": Rod("O", "A", mass=2), "fore": Rod("A", "B", mass=1)},
        angles={"shoulder": Angle("upper"), "elbow": Angle("fore", "upper")},
        forces=[RotationalSpring("shoulder", 9), RotationalSpring("elbow", 4), RotationalDamper("elbow", "0.7")],
    ).problem()
    found = daebench.modes(problem, methods=[])
    M, K = np.array([[5 / 3, 1 / 2], [1 / 2, 1 / 3]]), np.array([[13.0, -4], [-4, 4]])
    C, none, one = 0.7 * np.array([[1, -1], [-1, 1]]), np.zeros((2, 2)), np.eye(2)
    roots = eig(np.block([[none, one], [-K, -C]]), np.block([[one, none], [none, M]]), right=False)
    assert found.damped == pytest.approx(sorted((x for x in roots if x.imag > 0), key=abs), rel=1e-9)
    assert len(found.spectra["index3"]) == 4


def test_a_driver_is_held_and_an_overdamped_motion_creeps():
    """A mass that is guided along x, between a damper and a point that is driven: no mode but s = -c/m and 0."""
    problem = Mechanism(
        ground={"O": (0, 0)},
        points={"A": Guided((3, 0), (1, 0)), "B": Guided((5, 0), (1, 0))},
        bodies={"slider": PointMass("A", 2), "drive": PointMass("B", 1)},
        joints=[DrivenCoordinate("B", 0, 5 + sp.sin(t))],
        forces=[Damper("O", "A", 8)],
    ).problem()
    found = daebench.modes(problem, methods=[])
    assert np.sort(found.damped.real) == pytest.approx([-4, 0], abs=1e-12)


def test_modes_without_dampers_have_no_damped_ones():
    found = daebench.modes("planar_pendulum", methods=[])
    assert len(found.damped) == 0
    assert not found.damping.any()
