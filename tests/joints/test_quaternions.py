"""Bodies with a quaternion against Euler's equations, against natural coordinates, and with other gauges."""

import numpy as np
import pytest
import sympy as sp
from integrating import by_dop853
from refusals import refused
from tops import INERTIA, SPUN, rotation, top, turning

from daebench.compiler.definition import source_of
from daebench.errors import InvalidProblem
from daebench.joints import Angle, Mechanism, QuaternionBody, Revolute, RotationalSpring, Start
from daebench.methods.names import parse
from daebench.runs.make_ivp import make_ivp
from daebench.runs.request import Request

pytestmark = pytest.mark.usefixtures("plain_functions", "uncompiled_schemes")


def by_euler(t_end, *inertia, weight=0.0):
    """Return the quaternion, real part first, of a spun body: I w' = (I w) x w + z x R^T m g in its axes, by DOP853."""
    quaternion, spin = (np.array(x, dtype=float) for x in SPUN.values())

    def rate(_, y):
        w, q = y[:3], y[3:]
        moment = np.cross(inertia * w, w) + np.cross([0, 0, 1], rotation(q).T @ [0, 0, -weight])
        return [*(moment / inertia), *turning(w, q)]

    return by_dop853(rate, [*(rotation(quaternion).T @ spin), *quaternion], t_end)[3:]


def last(problem, t_end, method="scipy:DOP853", value=1e-11, **parameters):
    """Return the positions at the end of a run, without a check of the start."""
    points = {"points": 2} if method == "scipy:DOP853" else {}
    request = Request(value=value, t_end=t_end, **points)
    return parse(method).solve(make_ivp(source_of(problem), parameters=parameters), request).complete().q[-1]


@pytest.mark.exhaustive  # as a free body does, and with the weight that its point bears in test_reactions_of_angles.py
def test_a_heavy_top_turns_by_eulers_equations():
    """Moments are about O: 0.5 kg at a distance of 1 m in addition."""
    assert last(top(), 1) == pytest.approx(by_euler(1, 1.3, 1.4, 1.3, weight=0.5 * 9.81), abs=2e-8)


def test_a_free_body_turns_by_eulers_equations_and_flies_straight():
    """Its centre has unknowns of its own, and the gauge term in H is (q.p)^2/(8 J) with J the mean moment."""
    problem = Mechanism(
        ground={"far": (9, 9, 9)},
        points={"A": (1, 2, 3)},
        bodies={"stone": QuaternionBody("A", mass=2, centre=(1, 2, 2), inertia=INERTIA)},
        cases={"thrown": Start(at={"stone.quaternion": SPUN["at"]}, velocity={"stone.centre": (1, 0, -2)}, spin={"stone": SPUN["spin"]})},
    ).problem()
    q = last(problem, 1)
    assert q[:3] == pytest.approx([2, 2, 0], abs=1e-9)
    assert q[3:] == pytest.approx(by_euler(1, 0.8, 0.9, 1.3), abs=2e-8)
    way = sp.Matrix([0, 0, 0, *map(sp.Rational, SPUN["at"])])
    M = problem.M.subs(dict(zip(problem.q, way, strict=True)))
    assert (way.T * M.inv() * way)[0] == 1 / (4 * sp.Rational(3, 3))  # J = (0.8 + 0.9 + 1.3) / 3


def test_motions_depend_on_the_gauge_by_the_error_of_the_scheme_alone():
    """Steps of h and h/2 of RATTLE with two gauges differ by parts of 4, so that both go to the same motion."""
    gauge = sp.Symbol("gauge", positive=True)
    problem = top(gauge, parameters={gauge: 1.0})
    first, second = (
        np.abs(np.subtract(*(last(problem, 1, "rattle", h, gauge=value) for value in (0.3, 5.0)))).max() for h in (0.01, 0.005)
    )
    assert first > 2.5e-6
    assert first / second == pytest.approx(4, rel=0.05)


@pytest.mark.exhaustive  # a disc in the plane is wound as well
def test_a_hinged_body_with_a_quaternion_is_wound_three_turns():
    """The quaternion, 1 at the start, is that of the turn since then."""
    axis = (0, 0, 1)
    problem = Mechanism(
        ground={"O": (0, 0, 0)},
        points={},
        bodies={"wheel": QuaternionBody("O", mass=1, centre=axis, inertia=(2, 2, 3))},
        joints=[Revolute("wheel", "ground", "O", axis=axis)],
        angles={"turn": Angle("wheel", axis=axis)},
        forces=[RotationalSpring("turn", 5)],
        cases={"wound": Start(angles={"turn": 6 * sp.pi})},
    ).problem()
    turned = 6 * np.pi * (np.cos(np.sqrt(5 / 3) * 2) - 1)
    assert last(problem, 2) == pytest.approx([np.cos(turned / 2), 0, 0, np.sin(turned / 2), turned + 6 * np.pi], abs=1e-7)


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
