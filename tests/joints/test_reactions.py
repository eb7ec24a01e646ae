"""Forces in joints against statics and motions worked out by hand."""

import numpy as np
import pytest
import sympy as sp
from mechanism_states import at_start, close, loads
from mechanisms import GRAVITY
from refusals import refused

from daebench.errors import DaebenchError
from daebench.joints import (
    Body,
    Cylindrical,
    Damper,
    Distance,
    DrivenAngle,
    DrivenCoordinate,
    DrivenDistance,
    Guided,
    Mechanism,
    PointMass,
    Prismatic,
    Revolute,
    Rod,
    Spring,
    Universal,
    t,
)

G = float(GRAVITY)
DOWN = (0, "-" + GRAVITY)


def test_a_beam_on_two_rollers_bears_its_weight_and_that_of_a_load_by_the_levers():
    beam = Mechanism(
        points={"A": Guided((0, 0), (1, 0)), "B": Guided((4, 0), (1, 0)), "C": (1, 0)},
        bodies={"beam": Rod("A", "B", "C", mass=10), "load": PointMass("C", 6)},
        gravity=DOWN,
    )
    found = at_start(beam.problem())
    assert close(found["guide of A", "beam"].force, [[0, 5 * G + 4.5 * G]], 100)
    assert close(found["guide of B", "beam"].force, [[0, 5 * G + 1.5 * G]], 100)
    assert close(found["joint C", "load"].force, [[0, 6 * G]], 100)
    assert close(found["joint C", "beam"].force, [[0, -6 * G]], 100)


@pytest.mark.parametrize("ends", [("O", "A"), ("A", "O")], ids=["from the ground", "to the ground"])
def test_the_rod_of_a_pendulum_pulls_with_the_weight_along_it_and_the_centripetal_force(ends):
    pendulum = Mechanism(
        ground={"O": (0, 0)}, points={"A": (0, -2)}, bodies={"bob": PointMass("A", 3)}, joints=[Distance(*ends)], gravity=DOWN
    )
    angles, rates = np.array([0.0, 0.7, -2.5]), np.array([1.5, -4.0, 0.3])
    e, f = np.column_stack([np.sin(angles), -np.cos(angles)]), np.column_stack([np.cos(angles), np.sin(angles)])
    found = loads(pendulum.problem(), 2 * e, 2 * rates[:, None] * f)[f"Distance of {ends[0]} and {ends[1]}", "bob"]
    tension = 3 * (G * np.cos(angles) + 2 * rates**2)
    assert close(found.force, -tension[:, None] * e, 100)


def test_a_hinged_rod_pulls_and_pushes_across_as_the_formulas_of_its_fall():
    rod = Mechanism(ground={"O": (0, 0)}, points={"A": (1, 0)}, bodies={"rod": Rod("O", "A", mass=4)}, gravity=DOWN).problem()
    below = np.array([0.0, 0.4, 1.2])  # angle below the horizontal, released there
    e, f = np.column_stack([np.cos(below), -np.sin(below)]), np.column_stack([-np.sin(below), -np.cos(below)])
    rates = np.sqrt(3 * G * np.sin(below))
    found = loads(rod, e, rates[:, None] * f)["joint O", "rod"]
    along, across = 5 / 2 * 4 * G * np.sin(below), 4 * G / 4 * np.cos(below)
    assert close(found.force, -along[:, None] * e - across[:, None] * f, 100)
    assert close(found.force_in_body, np.column_stack([-along, across]), 100)


def test_a_driven_rod_in_space_needs_the_torque_of_its_inertia_and_weight():
    rod = Mechanism(
        ground={"O": (0, 0, 0)},
        points={"A": (2, 0, 0)},
        bodies={"rod": Body("O", "A", mass=3, centre=(1, 0, 0), inertia=(1, 1, 1))},
        joints=[Revolute("rod", "ground", "O", (0, 0, 1)), DrivenAngle("rod", "ground", 3 * t**2 + t, axis=(0, 0, 1))],
        gravity=(*DOWN, 0),
    )
    found = at_start(rod.problem())
    # I_O = 1 + 3, angle'' = 6
    assert close(found["DrivenAngle of rod and ground", "rod"].torque, [[0, 0, 4 * 6 + 3 * G]], 100)
    hinge = found["Revolute of rod and ground", "rod"]
    assert close(hinge.force, [[-3 * 1, 3 * 6 + 3 * G, 0]], 100)
    assert close(hinge.torque, np.zeros((1, 3)), 100)


def test_a_motor_turns_a_rod_at_later_times_too_and_at_other_parameters():
    gamma = sp.Symbol("gravity", real=True)
    rod = Mechanism(
        ground={"O": (0, 0)},
        points={"A": (2, 0)},
        bodies={"rod": Rod("O", "A", mass=3)},
        joints=[DrivenAngle("rod", "ground", 3 * t**2 + t)],
        gravity=(0, -gamma),
        parameters={gamma: 9.81},
    ).problem()
    at = np.arange(6) / 10  # the times of the states
    angle, rate = 3 * at**2 + at, 6 * at + 1
    q = 2 * np.column_stack([np.cos(angle), np.sin(angle)])
    v = rate[:, None] * np.column_stack([-q[:, 1], q[:, 0]])
    found = loads(rod, q, v, gravity=1.5)
    assert close(found["DrivenAngle of rod and ground", "rod"].torque, (4 * 6 + 3 * 1.5 * np.cos(angle))[:, None], 100)
    centre = (6 * np.column_stack([-q[:, 1], q[:, 0]]) - rate[:, None] ** 2 * q) / 2
    weight = np.array([0, 3 * 1.5])
    assert close(found["joint O", "rod"].force, 3 * centre + weight, 100)


def test_forces_that_no_body_has_are_not_put_into_joints():
    v = sp.symbols("v1 v2", real=True)
    rod = Mechanism(ground={"O": (0, 0)}, points={"A": (1, 0)}, bodies={"rod": Rod("O", "A", mass=1)})
    with refused("body-forces-unbalanced", DaebenchError):
        loads(rod.problem(force=[0, 1], v=v), [1, 0], [0, 0])


def test_a_slide_bears_the_torque_of_a_load_beside_it():
    block = Body("P", mass=5, centre=("0.3", "0.2"), inertia=1)
    slide = Mechanism(points={"P": (0, 0)}, bodies={"block": block}, joints=[Prismatic("block", "ground", "P", (1, 0))], gravity=DOWN)
    (found,) = at_start(slide.problem()).values()
    assert close(found.force, [[0, 5 * G]], 100)
    assert close(found.torque, [[5 * G * 0.3]], 100)


def test_a_spring_and_a_damper_pull_with_their_laws():
    pulled = Mechanism(
        ground={"O": (0, 0), "K": (0, 1)},
        points={"A": (3, 0)},
        bodies={"rod": Rod("O", "A", mass=2)},
        forces=[Spring("K", "A", stiffness=7, length=1), Damper("K", "A", damping=4)],
    ).problem()
    rate = 0.5
    found = loads(pulled, [3, 0], [0, 3 * rate])["joint O", "rod"]
    gap = np.array([3.0, -1.0])
    length = np.hypot(*gap)
    pull = -(7 * (length - 1) + 4 * (gap @ [0, 3 * rate]) / length) * gap / length
    twice = 3 * pull[1] / (2 * 9 / 3)
    assert close(found.force, [2 * np.array([-1.5 * rate**2, 1.5 * twice]) - pull], 30)


def test_springs_whose_length_has_a_sign_push_beyond_the_point():
    slider = Mechanism(
        ground={"O": (0, 0)},
        points={"S": Guided((1, 0), (1, 0)), "A": (1, -1)},
        bodies={"slider": PointMass("S", 1), "rod": Rod("S", "A", mass=2)},
        forces=[Spring("O", "S", stiffness=10, length="0.5", damping=2)],
    ).problem()
    # Beyond O, at x = -0.3, the length is -0.3: the spring is 0.8 shorter than at rest. No force turns the rod, which hangs at rest.
    found = loads(slider, [-0.3, -0.3, -1], [0.2, 0.2, 0])
    on_rod = found["joint S", "rod"].force[0]
    push = 10 * 0.8 - 2 * 0.2
    # A rod pulled at its end: the end has a mass of a quarter of it.
    assert close(on_rod, [push * (2 / 4) / (1 + 2 / 4), 0], 10)
    assert close(found["guide of S", "S"].force, [[0, 0]], 10)


def test_driven_points_and_distances_pull_their_points():
    driven = Mechanism(
        points={"A": (1, 0), "B": (1, -1)},
        bodies={"a": PointMass("A", 2), "b": PointMass("B", 3)},
        joints=[DrivenCoordinate("A", 0, 1 + t**2), DrivenDistance("A", "B", 1 + 2 * t**2)],
        gravity=DOWN,
    )
    found = at_start(driven.problem())
    # Both fall; that their distance grows at 4 m/s^2 takes 4 m_a m_b / (m_a + m_b).
    push = 4 * 2 * 3 / 5
    assert close(found["driver of A", "a"].force, [[2 * 2, 0]], 10)
    assert close(found["DrivenDistance of A and B", "b"].force, [[0, -push]], 10)
    assert close(found["DrivenDistance of A and B", "a"].force, [[0, push]], 10)


@pytest.mark.exhaustive
@pytest.mark.filterwarnings("ignore")
def test_of_two_hinges_of_a_door_neither_force_is_determined_across_its_torque():
    door = Mechanism(
        points={"P": (0, 0, 0), "R": (0, 0, 1)},
        bodies={"door": Body("P", "R", mass=12, centre=("0.4", 0, 1), inertia=(5, 5, 1))},
        joints=[Revolute("door", "ground", x, (0, 0, 1)) for x in ("P", "R")],
        gravity=(0, *DOWN),
    )
    found = at_start(door.problem())
    one = found["Revolute of door and ground", "door"]
    assert np.isnan(one.force).all()
    assert np.isnan(one.torque[0, :2]).all()
    assert one.torque[0, 2] == 0


def test_a_joint_whose_point_bodies_share_is_told_once_and_has_the_force_there():
    axis = (0, 1, 0)
    arm = Mechanism(
        ground={"O": (0, 0, 0)},
        points={"A": (1, 0, 0)},
        bodies={"arm": Body("O", "A", mass=2, centre=("0.5", 0, 0), inertia=("0.1", "0.2", "0.2"))},
        joints=[Revolute("arm", "ground", "O", axis)],
        gravity=(0, *DOWN),
    )
    found = at_start(arm.problem())
    assert [*found] == [("Revolute of arm and ground", "arm")]
    # I_O = 0.2 + 0.5, angle'' = m g/2 / I_O down.
    assert close(found["Revolute of arm and ground", "arm"].force, [[0, 0, 2 * G - 2 * 0.5 * (G / 0.7)]], 30)


@pytest.mark.sampled(by="Universal".__eq__)
@pytest.mark.parametrize(
    ("kind", "free_force", "free_torque"),
    [(Universal, [], [0, 2]), (Cylindrical, [2], [2]), (Prismatic, [2], [])],
    ids=["Universal", "Cylindrical", "Prismatic"],
)
def test_joints_in_space_transmit_no_more_than_they_prevent(kind, free_force, free_torque):
    axes = [(0, 0, 1), (1, 0, 0)] if kind is Universal else [(0, 0, 1)]
    pushed = Mechanism(
        ground={"S": (1, 1, 1)},
        points={"P": (0, 0, 0), "F": ("0.7", "-0.3", "0.2")},
        bodies={"body": Body("P", "F", mass=3, centre=("0.2", "0.1", "-0.4"), inertia=("0.5", "0.6", "0.7"))},
        joints=[kind("ground", "body", "P", *axes)],
        forces=[Spring("S", "F", stiffness=40, length="0.1")],
        gravity=("1", "-2", "-9"),
    )
    found = next(iter(at_start(pushed.problem()).values()))
    for load, free in ((found.force[0], free_force), (found.torque[0], free_torque)):
        assert close(load[free], 0 * load[free], 30)
        assert np.count_nonzero(np.abs(load) > 1e-3) == 3 - len(free)
