"""Parts of mechanisms by themselves: a rod, a spring, a damper, a driver, a slider, a universal joint, and what a row makes of numbers."""

import numpy as np
import pytest
import sympy as sp
from scipy.spatial.transform import Rotation

from daebench.joints import Body, Damper, DrivenAngle, DrivenDistance, Mechanism, PointMass, Prismatic, Rod, Universal, t
from daebench.joints.inertia import euler_tensor
from daebench.joints.rows import in_k, k

ROD = {"A": (0, 0), "B": (2, 0)}
AXES = {"A": (0, 0, 0), "B": (1, 0, 0), "C": (0, 1, 0), "D": (0, 0, 1)}


def at(problem, expression, *points, **more):
    """Return an expression at points in the order of the definition, as a float."""
    q = [x for point in points for x in point]
    numbers = dict(zip(problem.q, q, strict=True)) | {sp.Symbol(name, real=True): value for name, value in more.items()}
    return float(sp.sympify(expression).subs(numbers))


def test_a_uniform_rod_has_a_third_of_its_mass_at_each_end_and_a_sixth_between():
    problem = Mechanism(points=ROD, bodies={"rod": Rod("A", "B", mass=6)}).problem()
    assert sp.Matrix([[2, 0, 1, 0], [0, 2, 0, 1], [1, 0, 2, 0], [0, 1, 0, 2]]) == problem.M


def test_a_damper_pulls_with_its_rate_however_long_it_is():
    points = {"P": (3, 4), "Q": (3, 5)}
    bodies = {"p": PointMass("P", 1), "rod": Rod("P", "Q", mass=1)}
    problem = Mechanism(ground={"S": (0, 0)}, points=points, bodies=bodies, forces=[Damper("S", "P", 2)]).problem()
    numbers = dict(zip([*problem.q, *problem.v], [6, 8, 6, 9, 0.6, 0.8, 0, 0], strict=True))  # 10 long, and longer by 1 each second
    assert [float(sp.sympify(F).subs(numbers)) for F in problem.force] == pytest.approx([-1.2, -1.6, 0, 0])


def test_a_driven_distance_is_the_distance_and_a_driven_angle_turns_to_the_left():
    mechanism = {"ground": {"O": (0, 0), "S": (0, -2)}, "points": {"A": (1, 0)}, "bodies": {"rod": Rod("O", "A", mass=1)}}
    driven = Mechanism(**mechanism, joints=[DrivenDistance("S", "A", sp.sqrt(5) - t / 10)]).problem()
    y = ((np.sqrt(5) - 0.1) ** 2 - 5) / 4
    assert at(driven, driven.g[-1], (np.sqrt(1 - y * y), y), t=1.0) == pytest.approx(0, abs=1e-13)
    turned = Mechanism(**mechanism, joints=[DrivenAngle("rod", "ground", t)]).problem()
    assert at(turned, turned.g[-1], (np.cos(0.5), np.sin(0.5)), t=0.5) == pytest.approx(0, abs=1e-15)
    assert abs(at(turned, turned.g[-1], (np.cos(0.5), -np.sin(0.5)), t=0.5)) > 0.5


def test_a_slider_in_the_plane_neither_turns_nor_leaves_its_line():
    body = Body("A", "B", mass=1, centre="A", inertia=1)
    problem = Mechanism(points=ROD, bodies={"body": body}, joints=[Prismatic("body", "ground", "A", (1, 0))]).problem()
    worst = [max(abs(at(problem, g, *ends)) for g in problem.g) for ends in (((3, 0), (5, 0)), ((0, 0), (0, 2)), ((3, 1), (5, 1)))]
    assert worst[0] == 0
    assert min(worst[1:]) > 0.1


def test_a_universal_joint_turns_about_either_axis_and_not_about_both_at_once():
    body = Body(*AXES, mass=1, centre="A", inertia=(1, 1, 1))
    joint = Universal("ground", "body", "A", (1, 0, 0), (0, 1, 0))
    problem = Mechanism(points=AXES, bodies={"body": body}, joints=[joint]).problem()
    free = len(problem.q) // 3
    turns = [Rotation.from_rotvec(0.4 * axis).as_matrix().T for axis in np.eye(3)]
    worst = [max(abs(at(problem, g, *([(0, 0, 0), *ends][-free:]))) for g in problem.g) for ends in turns]
    assert max(worst[:2]) < 1e-14
    assert worst[2] > 0.1


def test_moments_of_inertia_are_sums_of_two_entries_of_eulers_tensor():
    E = euler_tensor("body", (5, 4, 3), 3)
    assert sp.diag(1, 2, 3) == E


def test_numbers_that_are_a_parabola_in_k_are_found_to_be_one():
    assert sp.expand(in_k([3 + 2 * n - 5 * n**2 for n in map(sp.Integer, range(1, 7))], 1) - (3 + 2 * k - 5 * k**2)) == 0
    assert in_k([sp.Integer(n) ** 3 for n in range(5)]) is None
