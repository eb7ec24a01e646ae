"""Each joint against the motion that it leaves, worked out in the coordinates of that motion."""

import numpy as np
import pytest
import sympy as sp
from measures import error_of
from mechanisms import GRAVITY, accelerations, lagrange, moving, named

from daebench.joints import Body, Cylindrical, Mechanism, Prismatic, Revolute, Rod, Spherical, Universal

MASS, CENTRE, MOMENTS = 3, ("0.2", "0.5", "-0.1"), ("0.4", "0.5", "0.6")
POINTS = {"A": ("0.1", "0.2", "0.3"), "B": (1, "0.1", 0), "C": ("0.2", 1, 0), "D": ("-0.1", "0.3", 1)}


def vector(x):
    return sp.Matrix([sp.Rational(str(entry)) for entry in x])


def one_body(joint):
    """Return a body of four points that one joint holds to the ground."""
    body = Body(*POINTS, mass=MASS, centre=CENTRE, inertia=MOMENTS)
    return Mechanism(points=POINTS, bodies={"body": body}, joints=[joint], gravity=(0, "-3", "-" + GRAVITY)).problem()


def turn(axis, angle):
    """Return the rotation about an axis, by Rodrigues' formula."""
    n = vector(axis) / sp.sqrt(vector(axis).dot(vector(axis)))
    hat = sp.Matrix([[0, -n[2], n[1]], [n[2], 0, -n[0]], [-n[1], n[0], 0]])
    return sp.eye(3) + sp.sin(angle) * hat + (1 - sp.cos(angle)) * hat**2


def motion(xi, pivot, R, shift):
    """Return the motion of the body in coordinates xi: turned by R about a pivot, and shifted."""
    moved = {name: vector(pivot) + R * (vector(x) - vector(pivot)) + shift for name, x in POINTS.items()}
    centre = vector(pivot) + R * (vector(CENTRE) - vector(pivot)) + shift
    moments = [sp.Rational(x) for x in MOMENTS]
    E = sum(moments) / 2 * sp.eye(3) - sp.diag(*moments)

    def kinetic(rate):
        speed = centre.jacobian(xi) * rate
        turning = sum((R.diff(x) * w for x, w in zip(xi, rate, strict=True)), sp.zeros(3, 3))
        return MASS * speed.dot(speed) / 2 + (turning * E * turning.T).trace() / 2

    U = MASS * (3 * centre[1] + sp.Rational(GRAVITY) * centre[2])
    return lagrange(xi, sp.Matrix.vstack(*moved.values()), kinetic, U)


a, b, c = sp.symbols("a b c")
SKEW, ASIDE, NONE = ("1", "2", "2"), ("2", "1", "-2"), sp.zeros(3, 1)
SPOT = ("0.3", "-0.2", "0.5")

JOINTS = {
    "revolute": (Revolute("body", "ground", SPOT, axis=SKEW), 5, lambda: motion([a], SPOT, turn(SKEW, a), NONE)),
    "cylindrical": (
        Cylindrical("ground", "body", SPOT, SKEW),
        4,
        lambda: motion([a, b], SPOT, turn(SKEW, a), b * vector(SKEW)),
    ),
    "prismatic": (Prismatic("body", "ground", SPOT, SKEW), 5, lambda: motion([b], SPOT, sp.eye(3), b * vector(SKEW))),
    "universal": (
        Universal("ground", "body", SPOT, SKEW, ASIDE),
        4,
        lambda: motion([a, b], SPOT, turn(SKEW, a) * turn(ASIDE, b), NONE),
    ),
    "spherical": (
        Spherical("body", "ground", SPOT),
        3,
        lambda: motion([a, b, c], SPOT, turn((0, 0, 1), a) * turn((1, 0, 0), b) * turn((0, 0, 1), c), NONE),
    ),
}


GATE = ("revolute", "cylindrical")
"""Joints about one axis: of others expressions are the longest, and engines are held against them where they are installed."""


@pytest.mark.sampled(by=lambda case: case in GATE)
@pytest.mark.parametrize(("joint", "taken", "expected"), JOINTS.values(), ids=JOINTS)
def test_a_joint_leaves_the_motion_that_it_is_named_for(random, joint, taken, expected):
    problem, by_hand = one_body(joint), expected()
    assert (problem.d, problem.m) == (12, 6 + taken)
    for _ in range(2):
        angles, rates = random.uniform(0.3, 1, (2, 6 - taken))
        q, v, q_pp = by_hand(angles, rates)
        assert error_of(accelerations(problem, q, v), q_pp) < 1e-10 * np.abs(q_pp).max()


def test_a_prismatic_joint_in_the_plane_slides_and_does_not_turn(random):
    problem = Mechanism(
        points={"A": (0, 0), "B": (1, 0)},
        bodies={"rod": Rod("A", "B", mass=2)},
        joints=[Prismatic("rod", "ground", "A", (3, 4))],
        gravity=(0, "-10"),
    ).problem()
    q, v = moving(problem, random)
    assert error_of(accelerations(problem, q, v), [-4.8, -6.4, -4.8, -6.4]) < 1e-13
    assert (problem.d, problem.m) == (4, 3)


def test_a_slide_between_two_bodies_and_a_hinge_aside_of_their_points_move_as_lagrange_says(random):
    s, turned = xi = sp.symbols("s turned")
    problem = Mechanism(
        ground={"O": (0, 0)},
        points={"A": (1, 0), "B": (2, 1), "C": (3, 1)},
        bodies={"arm": Rod("O", "A", mass=1), "block": Rod("B", "C", mass=2)},
        joints=[Prismatic("arm", "block", "B", (1, 0))],
        gravity=(0, "-" + GRAVITY),
    ).problem()
    along = sp.Matrix([sp.cos(turned), sp.sin(turned)])
    aside = sp.Matrix([-sp.sin(turned), sp.cos(turned)])
    middle = (sp.Rational(5, 2) + s) * along + aside

    def kinetic(rate):
        centre = middle.jacobian(xi) * rate
        return rate[1] ** 2 / 6 + centre.dot(centre) + rate[1] ** 2 / 12

    place = along.col_join(middle - along / 2).col_join(middle + along / 2)
    by_hand = lagrange(xi, place, kinetic, sp.Rational(GRAVITY) * (along[1] / 2 + 2 * middle[1]))
    q, v, q_pp = by_hand(random.uniform(-1, 1, 2), random.uniform(-1, 1, 2))
    assert error_of(accelerations(problem, q, v), q_pp) < 1e-12 * np.abs(q_pp).max()


def test_a_shared_point_costs_no_equation_and_a_hinge_there_none_more():
    points, rods = {"A": (1, 0), "B": (2, 0)}, {"one": Rod("O", "A", mass=1), "two": Rod("A", "B", mass=1)}
    plain = Mechanism(ground={"O": (0, 0)}, points=points, bodies=rods).problem()
    hinged = Mechanism(ground={"O": (0, 0)}, points=points, bodies=rods, joints=[Revolute("one", "two", "A")]).problem()
    assert plain.g == hinged.g
    assert plain.m == 2


def test_a_body_that_shares_a_point_and_a_direction_is_hinged_there():
    bodies = {
        "one": Body("O", "P", "u", mass=1, centre="P", inertia=(1, 1, 1)),
        "two": Body("P", "Q", "u", mass=1, centre="Q", inertia=(1, 1, 1)),
    }
    mechanism = Mechanism(
        ground={"O": (0, 0, 0)}, points={"P": (1, 0, 0), "Q": (2, 0, 0)}, directions={"u": (0, 0, 1)}, bodies=bodies, gravity=(0, -1, 0)
    )
    problem = mechanism.problem()
    assert problem.d - problem.m == 4
    doubled = Mechanism(**{**vars(mechanism), "joints": [Revolute("one", "two", "P", axis="u")]}).problem()
    assert doubled.g == problem.g


def test_a_rod_across_an_axis_is_hinged_by_one_equation_at_a_shared_point(random):
    problem = Mechanism(
        ground={"O": (0, 0, 0)},
        points={"A": (1, 0, 0)},
        bodies={"rod": Rod("O", "A", mass=1)},
        joints=[Revolute("rod", "ground", "O", axis=(0, 3, 4))],
        gravity=(0, 0, "-10"),
    ).problem()
    assert (problem.d, problem.m) == (3, 2)
    q, _ = moving(problem, random)
    at = named(problem, q)["A"]
    assert abs(at @ [0, 3, 4]) < 1e-13
