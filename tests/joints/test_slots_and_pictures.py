"""A pin in a slot against the angles of a quick-return mechanism, and the drawing of cylinders and of angles."""

import numpy as np
import pytest
import sympy as sp
from mechanisms import moving

from daebench.joints import Angle, Body, DrivenAngle, DrivenDistance, Mechanism, Rod, Slot, t


def quick_return():
    """Return a driven crank of length 1 whose pin slides in a rocker that turns about a pivot at a distance of 2."""
    return Mechanism(
        ground={"O": (0, 0), "Q": (-2, 0)},
        points={"A": (1, 0), "B": (2, 0)},
        bodies={"crank": Rod("O", "A", mass=1), "rocker": Rod("Q", "B", mass=1)},
        joints=[DrivenAngle("crank", "ground", 3 * t), Slot("crank", "rocker", "A", axis=(1, 0))],
    )


def test_a_pin_in_a_slot_turns_a_rocker_by_the_direction_to_the_pin():
    problem = quick_return().problem()
    assert (problem.d, problem.m) == (4, 4)
    for time in (0.3, 1.1, 2.9):
        pin = np.array([np.cos(3 * time), np.sin(3 * time)])
        way = (pin - [-2, 0]) / np.linalg.norm(pin - [-2, 0])
        at = dict(zip(problem.q, [*pin, *(4 * way - [2, 0])], strict=True)) | {t: time}
        assert np.abs([float(g.subs(at)) for g in problem.g]).max() < 1e-14
        at[problem.q[3]] += 0.1
        assert abs(float(problem.g[-1].subs(at))) > 0.01


def test_a_pin_stays_on_the_line_of_a_slot_in_space_wherever_its_body_turns(random):
    mechanism = Mechanism(
        ground={"O": (0, 0, 0)},
        points={"A": (1, 2, 3), "C": (4, 4, 4)},
        bodies={
            "plate": Body("O", mass=1, centre=(0, 0, 0), inertia=(1, 1, 1)),
            "stick": Rod("A", "C", mass=1),
        },
        joints=[Slot("stick", "plate", "A", axis=(1, 0, 2))],
    )
    problem = mechanism.problem()
    assert problem.m - 6 - 1 == 2
    q, _ = moving(problem, random)
    R, A = q[:9].reshape(3, 3).T, q[9:12]
    gap = A - R @ [1, 2, 3]
    assert np.linalg.norm(gap) > 1e-3
    assert np.abs(np.cross(gap, R @ [1, 0, 2])).max() < 1e-12


def test_cylinders_and_angles_are_drawn():
    crane = Mechanism(
        ground={"O": (0, 0), "S": (1, -1)},
        points={"A": (4, 0), "B": (2, 0)},
        bodies={"boom": Rod("O", "A", "B", mass=100)},
        joints=[DrivenDistance("S", "B", sp.sqrt(2) + t / 10)],
        angles={"luff": Angle("boom")},
    )
    picture = crane.problem().picture
    level = dict(zip(sp.symbols("q1 q2", real=True), (4, 0), strict=True))
    ends = {tuple(float(x.subs(level)) for x in map(sp.sympify, line[k])) for line in picture.rods for k in (0, -1)}
    assert {(1, -1), (2, 0)} <= ends
    (ring,) = (np.array([sp.Matrix(x) for x in line], dtype=object) for line in picture.rods if len(line) > 10)
    turned = np.array(sp.Matrix(ring.squeeze()).subs(dict(zip(sp.symbols("q1 q2", real=True), (0, 4), strict=True))), dtype=float)
    assert np.linalg.norm(turned[:-1], axis=1) == pytest.approx(turned[0, 1])
    assert turned[0, 0] == pytest.approx(0)  # its spoke turns with the boom, by a right angle
    assert turned[-1] == pytest.approx([0, 0])
