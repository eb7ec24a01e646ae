"""Bodies with a quaternion against Euler's equations, against natural coordinates, and with other gauges."""

import numpy as np
import pytest
import sympy as sp
from refusals import refused
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from daebench.compiler.definition import source_of
from daebench.errors import InvalidProblem
from daebench.joints import Angle, Mechanism, QuaternionBody, Revolute, RotationalSpring, Start
from daebench.methods.names import parse
from daebench.runs.make_ivp import make_ivp
from daebench.runs.request import Request

INERTIA = ("0.8", "0.9", "1.3")
TILT, SPIN = (sp.Rational(4, 5), sp.Rational(3, 5), 0, 0), ("0.4", -3, "2.5")


pytestmark = pytest.mark.usefixtures("plain_functions", "uncompiled_schemes")


def top(gauge=None, **more):
    """Return a heavy top of unequal moments, tilted and spun."""
    return Mechanism(
        ground={"O": (0, 0, 0)},
        points={"C": (0, 0, 1)},
        bodies={"top": QuaternionBody("O", "C", mass="0.5", centre="C", inertia=INERTIA, gauge=gauge)},
        gravity=(0, 0, -10),
        cases={"spun": Start(at={"top.quaternion": TILT}, spin={"top": SPIN})},
        **more,
    ).problem()


def by_euler(t_end, arm, weight, inertia, start):
    """Return the quaternion, real part first, of a body about a fixed point: I w' = (I w) x w + arm x R^T weight, by DOP853."""

    def rate(_, y):
        w, q = y[:3], y[3:]
        R = Rotation.from_quat([*q[1:], q[0]]).as_matrix()
        turned = [-q[1:] @ w, *(q[0] * w + np.cross(q[1:], w))]
        return [*((np.cross(inertia * w, w) + np.cross(arm, R.T @ weight)) / inertia), *(np.array(turned) / 2)]

    return solve_ivp(rate, (0, t_end), start, method="DOP853", rtol=1e-12, atol=1e-13).y[3:, -1]


def body_rates():
    """Return the angular velocity of the start in axes of the body."""
    q = np.array([float(x) for x in TILT])
    return Rotation.from_quat([*q[1:], q[0]]).as_matrix().T @ np.array([float(x) for x in SPIN])


def last(problem, t_end, method="scipy:DOP853", value=1e-11, **parameters):
    """Return the positions at the end of a run, without a check of the start."""
    ivp = make_ivp(source_of(problem), parameters=parameters)
    points = {"points": 2} if method == "scipy:DOP853" else {}
    return parse(method).solve(ivp, Request(value=value, t_end=t_end, **points)).complete().q[-1]


@pytest.mark.exhaustive  # as a free body does, and with the weight that its point bears in test_reactions_of_angles.py
def test_a_heavy_top_turns_by_eulers_equations():
    problem = top()
    assert (problem.d, problem.m) == (4, 1)
    inertia = np.array([1.3, 1.4, 1.3])  # about O: 0.5 kg at a distance of 1 m in addition
    expected = by_euler(1, [0, 0, 1], [0, 0, -5], inertia, [*body_rates(), 0.8, 0.6, 0, 0])
    assert last(problem, 1) == pytest.approx(expected, abs=2e-8)


def test_a_free_body_turns_by_eulers_equations_and_flies_straight():
    """Its centre has unknowns of its own, and the gauge term in H is (q.p)^2/(8 J) with J the mean moment."""
    problem = Mechanism(
        ground={"far": (9, 9, 9)},
        points={"A": (1, 2, 3)},
        bodies={"stone": QuaternionBody("A", mass=2, centre=(1, 2, 2), inertia=INERTIA)},
        cases={"thrown": Start(at={"stone.quaternion": TILT}, velocity={"stone.centre": (1, 0, -2)}, spin={"stone": SPIN})},
    ).problem()
    q = last(problem, 1)
    assert q[:3] == pytest.approx([2, 2, 0], abs=1e-9)
    expected = by_euler(1, [0, 0, 1], [0, 0, 0], np.array([0.8, 0.9, 1.3]), [*body_rates(), 0.8, 0.6, 0, 0])
    assert q[3:] == pytest.approx(expected, abs=2e-8)
    way = sp.Matrix([0, 0, 0, *TILT])
    M = problem.M.subs(dict(zip(problem.q, way, strict=True)))
    assert (way.T * M.inv() * way)[0] == 1 / (4 * sp.Rational(3, 3))  # J = (0.8 + 0.9 + 1.3) / 3


def test_motions_depend_on_the_gauge_by_the_error_of_the_scheme_alone():
    """Steps of h and h/2 of RATTLE with two gauges differ by parts of 4, so that both go to the same motion."""
    gauge = sp.Symbol("gauge", positive=True)
    problem, apart = top(gauge, parameters={gauge: 1.0}), []
    for h in (0.01, 0.005):
        few, many = (last(problem, 1, "rattle", h, gauge=value) for value in (0.3, 5.0))
        apart.append(few - many)
    first, second = (np.abs(x).max() for x in apart)
    assert first > 2.5e-6
    assert first / second == pytest.approx(4, rel=0.05)


@pytest.mark.exhaustive
def test_a_hinged_body_with_a_quaternion_is_wound_three_turns():
    problem = Mechanism(
        ground={"O": (0, 0, 0)},
        points={"C": (0, 0, 1)},
        bodies={"wheel": QuaternionBody("O", "C", mass=1, centre="C", inertia=(2, 2, 3))},
        joints=[Revolute("wheel", "ground", "O", axis=(0, 0, 1))],
        angles={"turn": Angle("wheel", axis=(0, 0, 1))},
        forces=[RotationalSpring("turn", 5)],
        cases={"wound": Start(angles={"turn": 6 * sp.pi})},
    ).problem()
    theta = 6 * np.pi * np.cos(np.sqrt(5 / 3) * 2)
    q = last(problem, 2)
    assert q[4] == pytest.approx(theta, abs=1e-7)
    turned = (theta - 6 * np.pi) / 2  # the quaternion starts at 1: it is that of the turn since the start
    assert q[:4] == pytest.approx([np.cos(turned), 0, 0, np.sin(turned)], abs=1e-7)


REFUSED = {
    "three numbers": ({"cases": {"x": Start(at={"top.quaternion": (1, 0, 0)})}}, "quaternion-malformed", ["top.quaternion of case 'x'"]),
    "not of length one": (
        {"cases": {"x": Start(at={"top.quaternion": (1, 1, 0, 0)})}},
        "case-residual",
        ["the length of the quaternion of top"],
    ),
    "a gauge of 0": (
        {"bodies": {"top": QuaternionBody("O", mass=1, centre=(0, 0, 0), inertia=(1, 1, 1), gauge=0)}},
        "gauge-without-inertia",
        ["top", "0"],
    ),
    "in the plane": ({"ground": {"O": (0, 0)}, "points": {}}, "quaternion-body-in-plane", ["top"]),
}


@pytest.mark.parametrize(("more", "code", "names"), REFUSED.values(), ids=REFUSED)
def test_mistakes_about_quaternions_are_named(more, code, names):
    body = QuaternionBody("O", mass=1, centre=(0,) * len(more.get("ground", {"O": (0, 0, 0)})["O"]), inertia=(1, 1, 1))
    with refused(code, InvalidProblem, names):
        Mechanism(**{"ground": {"O": (0, 0, 0)}, "points": {}, "bodies": {"top": body}, **more}).problem()
