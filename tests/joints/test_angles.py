"""Torques, springs, motors, gears and rotors at angles against closed forms and hand-written equations in angles."""

import numpy as np
import pytest
import sympy as sp
from integrating import by_dop853
from mechanisms import accelerations, moving
from refusals import refused

from daebench.compiler.definition import source_of
from daebench.joints import (
    Angle,
    Body,
    Coupling,
    Gear,
    Mechanism,
    Revolute,
    Rod,
    RotationalSpring,
    Start,
    Torque,
)
from daebench.methods.names import parse
from daebench.runs.make_ivp import make_ivp
from daebench.runs.request import Request

DISC = {"ground": {"O": (0, 0)}, "points": {"A": (1, 0)}, "bodies": {"disc": Body("O", "A", mass=2, centre="O", inertia=3)}}
TURN = {"turn": Angle("disc")}


def last(problem, t_end):
    """Return the positions at the end of a run, without a check of the start."""
    return parse("ida:index2").solve(make_ivp(source_of(problem)), Request(value=1e-11, t_end=t_end, points=2)).complete().q[-1]


def test_a_spring_wound_three_turns_swings_as_its_closed_form():
    """Theta = 6 pi cos(w t) with w^2 = k / I, through six turns and back."""
    mechanism = Mechanism(**DISC, angles=TURN, forces=[RotationalSpring("turn", 5)], cases={"wound": Start(angles={"turn": 6 * sp.pi})})
    problem = mechanism.problem()
    assert problem.force is None
    assert not problem.M.free_symbols
    theta = 6 * np.pi * np.cos(np.sqrt(5 / 3) * 4)
    assert last(problem, 4) == pytest.approx([np.cos(theta), np.sin(theta), theta], abs=1e-6)


def test_a_coupling_of_degree_four_holds(plain_functions):
    """Energy of theta and of c(theta) with a constant torque: (I + J c'^2) theta'^2 / 2 = tau theta."""
    problem = Mechanism(
        ground={"O": (0, 0), "Q": (4, 0)},
        points={"A": (1, 0), "B": (5, 0)},
        bodies={"first": Body("O", "A", mass=1, centre="O", inertia=2), "second": Body("Q", "B", mass=1, centre="Q", inertia=3)},
        angles={"x": Angle("first"), "y": Angle("second")},
        joints=[Coupling("y", "x", (0, "0.5", "-0.2", "0.1", "0.03"))],
        forces=[Torque("x", 4)],
    ).problem()
    c = np.polynomial.Polynomial([0, 0.5, -0.2, 0.1, 0.03])

    def rate(_, y):
        slope = c.deriv()(y[0])
        return [y[1], (4 - 3 * slope * c.deriv(2)(y[0]) * y[1] ** 2) / (2 + 3 * slope**2)]

    x = by_dop853(rate, [0, 0], 2)[0]
    assert last(problem, 2)[4:6] == pytest.approx([x, c(x)], abs=1e-7)


def arm(**more):
    """Return an arm of two uniform rods of length 1, mass 2 and 1."""
    return Mechanism(
        ground={"O": (0, 0)},
        points={"A": (1, 0), "B": (2, 0)},
        bodies={"upper": Rod("O", "A", mass=2), "fore": Rod("A", "B", mass=1)},
        angles={"shoulder": Angle("upper"), "elbow": Angle("fore", "upper", armature="0.1")},
        **more,
    )


def test_parallel_hinges_in_space_have_a_constant_mass_matrix_and_the_motion_of_the_plane(random):
    """With x of the post and y of the rod, which starts at a right angle: (2.52 x'^2 + 0.49/3 y'^2)/2 + 0.35 x' y' sin(x - y)."""
    inertia = ((1, "0.1", 0), ("0.1", "1.2", 0), (0, 0, 1))
    problem = Mechanism(
        ground={"O": (0, 0, 0)},
        points={"A": (1, 0, 0), "B": (1, "0.7", 0)},
        bodies={"post": Body("O", "A", mass=2, centre=("0.5", "0.1", 0), inertia=inertia), "rod": Rod("A", "B", mass=1)},
        joints=[Revolute("post", "ground", "O", axis=(0, 0, 1)), Revolute("rod", "post", "A", axis=(0, 0, -2))],
        angles={"elbow": Angle("rod", "post", axis=(0, 0, 1))},
        forces=[RotationalSpring("elbow", 3, 1)],
    ).problem()
    assert not problem.M.free_symbols
    for _ in range(3):
        q, v = moving(problem, random)
        (y, x), (w, u) = q[-2:], v[-2:]
        c, s = 0.35 * np.sin(x - y), -0.35 * np.cos(x - y)
        expected = np.linalg.solve([[2.52, c], [c, 0.49 / 3]], [3 * (y - x - 1) - s * w**2, -3 * (y - x - 1) + s * u**2])
        assert accelerations(problem, q, v)[-2:] == pytest.approx(expected[::-1], rel=1e-9)


def test_angles_start_with_whole_turns_wherever_their_bodies_are():
    start = Start(at={"A": (0, -1), "B": (-1, -1)}, angles={"shoulder": 4 * sp.pi - sp.pi / 2})
    (case,) = arm(cases={"wound": start}).problem().cases.values()
    assert {float(x) for x in case.q[4:]} == {float(3.5 * sp.pi), float(3 * sp.pi)}
    (case,) = arm(cases={"wound": Start(at={"A": (-1, 0), "B": (-1, -1)})}).problem().cases.values()
    assert {float(x) for x in case.q[4:]} == {float(sp.pi), float(3 * sp.pi / 2)}  # the elbow is at pi/2, not at -3 pi/2


SPACE = {"ground": {"O": (0, 0, 0)}, "points": {}, "bodies": {"disc": Body("O", mass=1, centre=(0, 0, 0), inertia=(1, 1, 1))}}
REFUSED = {
    "an angle that points contradict": (lambda: arm(cases={"x": Start(angles={"elbow": 1})}), "case-angle-against-points", ["elbow"]),
    "an unknown angle at the start": (lambda: arm(cases={"x": Start(angles={"knee": 1})}), "unknown-name", ["'knee'"]),
    "an unknown angle of a torque": (lambda: arm(forces=[Torque("knee", 1)]), "unknown-name", ["'knee'"]),
    "a coupling of degree 5": (lambda: arm(joints=[Coupling("elbow", "shoulder", [1] * 6)]), "coupling-degree-too-high", ["5"]),
    "a gear that does not fit": (
        lambda: arm(joints=[Gear("elbow", "shoulder", 2, 1)]),
        "case-residual",
        ["the Gear of elbow and shoulder"],
    ),
    "of a body against itself": (lambda: Mechanism(**DISC, angles={"turn": Angle("disc", "disc")}), "angle-against-itself", ["disc"]),
    "of no body": (lambda: Mechanism(**DISC, angles={"turn": Angle("disk")}), "unknown-name", ["'disk'"]),
    "of a negative armature": (lambda: Mechanism(**DISC, angles={"turn": Angle("disc", armature=-1)}), "armature-not-positive", ["-1"]),
    "in space without an axis": (lambda: Mechanism(**SPACE, angles=TURN), "turned-joint-without-axis", ["the angle turn"]),
}


@pytest.mark.parametrize(("mechanism", "code", "names"), REFUSED.values(), ids=REFUSED)
def test_mistakes_about_angles_are_named(mechanism, code, names):
    with refused(code, says=names):
        mechanism().problem()
