"""Drivers against the motion that they prescribe, and dampers against the power that they take."""

import numpy as np
import pytest
import sympy as sp
from measures import error_of
from mechanisms import moving
from refusals import refused
from scipy.spatial.transform import Rotation

from daebench.errors import InvalidProblem
from daebench.joints import (
    Angle,
    Body,
    Damper,
    DrivenAngle,
    DrivenCoordinate,
    DrivenDistance,
    Guided,
    Mechanism,
    NegativeDamping,
    PointMass,
    Revolute,
    Rod,
    RotationalDamper,
    Spring,
    Start,
    t,
)

RODS = {"upper": Rod("O", "A", mass=1), "lower": Rod("A", "B", mass=1)}
PLANE = {"ground": {"O": (0, 0), "S": (1, 2)}, "points": {"A": (1, 0), "B": (2, 0)}, "bodies": RODS}


def last(problem, q, time):
    """Return the last equation of a definition, that of its driver, at positions and a time."""
    return float(problem.g[-1].subs(dict(zip(problem.q, q, strict=True)) | {t: time}))


def test_a_driven_angle_holds_where_the_body_has_that_angle_and_its_start_turns_as_fast(random):
    problem = Mechanism(**PLANE, joints=[DrivenAngle("upper", "ground", 3 * t + t**2)]).problem()
    assert problem.t is t
    for time in random.uniform(0, 5, 4):
        angle = 3 * time + time**2
        A = np.array([np.cos(angle), np.sin(angle)])
        assert abs(last(problem, [*A, 0.3, 0.4], time)) < 1e-14
        assert abs(last(problem, [A[0] * np.cos(0.1) - A[1] * np.sin(0.1), A[1] * np.cos(0.1) + A[0] * np.sin(0.1), 0, 0], time)) > 0.09
    (case,) = problem.cases.values()
    v = problem.M.LUsolve(sp.Matrix(case.p))
    assert list(v[:2]) == [0, 3]


def test_a_driven_angle_in_space_is_about_its_axis_from_one_body_to_the_other(random):
    axis = (1, 2, 2)
    mechanism = Mechanism(
        ground={"O": (0, 0, 0)},
        points={"A": (1, 0, 0), "B": (0, 1, 0), "C": (0, 0, 1)},
        bodies={"body": Body("O", "A", "B", "C", mass=1, centre="A", inertia=(1, 1, 1))},
        joints=[Revolute("body", "ground", "O", axis=axis), DrivenAngle("body", "ground", sp.sin(t), axis=axis)],
    )
    determined = mechanism.problem()
    assert determined.m == determined.d  # the driver takes the last freedom
    free = Mechanism(**vars(mechanism) | {"joints": [mechanism.joints[1]]}).problem()
    for time in random.uniform(0, 5, 3):
        there, off = (Rotation.from_rotvec((np.sin(time) + more) * np.array(axis) / 3).as_matrix().T.ravel() for more in (0, 0.1))
        assert abs(last(free, there, time)) < 1e-14
        assert abs(last(free, off, time)) > 0.05


def test_a_driven_distance_and_a_driven_coordinate_hold_at_their_values():
    joined = Mechanism(**PLANE, joints=[DrivenDistance("S", "B", sp.sqrt(5) + t)]).problem()
    assert last(joined, [0, 0, 1, 2 - np.sqrt(5) - 0.5], 0.5) == pytest.approx(0, abs=1e-13)
    slid = Mechanism(**PLANE, joints=[DrivenCoordinate("B", 1, sp.sin(2 * t))]).problem()
    assert last(slid, [9, 9, 9, np.sin(1.4)], 0.7) == pytest.approx(0, abs=1e-15)
    (case,) = slid.cases.values()
    assert slid.M.LUsolve(sp.Matrix(case.p))[3] == 2


CONTRADICTIONS = {
    "angle": (DrivenAngle("upper", "ground", t + 1), "case-residual", "the DrivenAngle of upper and ground"),
    "half a turn": (DrivenAngle("upper", "ground", t + sp.pi), "case-on-other-branch", "the DrivenAngle of upper and ground"),
    "distance": (DrivenDistance("S", "B", 2 + t), "case-residual", "the DrivenDistance of S and B"),
    "coordinate": (DrivenCoordinate("B", 0, 1 + t), "case-residual", "the driver of B"),
}


@pytest.mark.parametrize(("driver", "code", "name"), CONTRADICTIONS.values(), ids=CONTRADICTIONS)
def test_a_driver_that_contradicts_the_start_is_an_inconsistent_position(driver, code, name):
    with refused(code, InvalidProblem, [name]):
        Mechanism(**PLANE, joints=[driver]).problem()


def test_a_driver_of_an_axis_that_is_none_is_refused():
    with refused("driver-axis-index", InvalidProblem, ["B", "2"]):
        Mechanism(**PLANE, joints=[DrivenCoordinate("B", 2, t)]).problem()


@pytest.mark.parametrize("damper", [Damper("S", "B", "0.7"), Spring("S", "B", damping="0.7")], ids=["damper", "spring"])
def test_a_damper_takes_the_power_of_its_rate_and_pulls_along_itself(random, damper):
    problem = Mechanism(**PLANE, forces=[damper]).problem()
    q, v = moving(problem, random)
    call = sp.lambdify([list(problem.q), list(problem.v)], list(problem.force), "numpy")

    def length(s):
        return np.hypot(*((q + s * v)[2:] - [1, 2]))

    F, rate = np.array(call(q, v), dtype=float), (length(1e-5) - length(-1e-5)) / 2e-5
    assert F @ v == pytest.approx(-0.7 * rate**2, rel=1e-8)
    along = (q[2:] - [1, 2]) / length(0)
    assert error_of(F, [0, 0, *(-0.7 * rate * along)]) < 1e-8


def test_a_spring_has_its_energy_and_no_force_in_the_reference_position_unless_its_length_is_given(random):
    for length, rest in ((None, np.sqrt(5)), (1, 1.0), (0, 0.0)):
        problem = Mechanism(**PLANE, forces=[Spring("S", "B", stiffness=3, length=length)]).problem()
        q, _ = moving(problem, random)
        energy = float(problem.U.subs(dict(zip(problem.q, q, strict=True))))
        assert energy == pytest.approx(1.5 * (np.hypot(q[2] - 1, q[3] - 2) - rest) ** 2, rel=1e-13)
        assert problem.force is None


LINES = {
    "along x": ((1, 0), (2, 0), (0, 0)),
    "against x": ((1, 0), (-2, 0), (0, 0)),
    "along y, anchor away": ((0, 1), (1, 4), (1, "-0.5")),
    "oblique": (("0.6", "0.8"), (4, 3), (1, -1)),
    "direction of another length": ((3, 4), (4, 3), (1, -1)),
    "in space": ((1, 2, 2), (2, 3, 4), (1, 1, 2)),
}


@pytest.mark.parametrize("ends", [("F", "B"), ("B", "F")], ids=["anchor first", "slider first"])
@pytest.mark.parametrize(("way", "place", "anchor"), LINES.values(), ids=LINES)
def test_a_spring_along_a_guided_line_has_the_energy_and_the_force_of_its_length(way, place, anchor, ends):
    problem = Mechanism(
        ground={"F": anchor, "O": [0] * (len(way) - 1) + [9]},
        points={"B": Guided(place, way), "C": [0] * (len(way) - 1) + [8]},
        bodies={"slider": PointMass("B", 2), "bob": Rod("O", "C", mass=1)},
        forces=[Spring(*ends, stiffness=3, length="1.5", damping="0.7")],
    ).problem()
    x, way, F = problem.q[0], np.array(way, dtype=float), np.array(anchor, dtype=float)
    (start,) = problem.cases.values()
    for moved in (0.0, 0.4, -0.7, 1.3):
        here = {x: float(start.q[0]) + moved}
        gap = np.array([sp.sympify(entry).subs(here) for entry in problem.picture.points["B"]], dtype=float) - F
        length, along = np.linalg.norm(gap), np.sign(gap @ way) * np.linalg.norm(way)
        assert float(problem.U.subs(here)) == pytest.approx(1.5 * (length - 1.5) ** 2, rel=1e-12)
        assert float(problem.U.diff(x).subs(here)) == pytest.approx(3 * (length - 1.5) * along, rel=1e-12, abs=1e-12)
        assert float(problem.force[0].subs(here).subs(dict.fromkeys(problem.v, 2.0))) == pytest.approx(-0.7 * 2.0 * way @ way)


def line(length, *, place=(2, 0), **more):
    return Mechanism(
        ground={"F": (0, 0), "O": (0, 9)},
        points={"B": Guided(place, (1, 0)), "C": (0, 8)},
        bodies={"slider": PointMass("B", 2), "bob": Rod("O", "C", mass=1)},
        forces=[Spring("F", "B", stiffness=3, length=length)],
        **more,
    )


def test_a_spring_on_a_line_starts_on_the_side_of_its_reference_position():
    line(1, cases={"right": Start(at={"B": ("0.1", 0)})}).problem()
    with refused("case-on-other-branch", InvalidProblem, ["'left'", "the Spring of F and B"]):
        line(1, cases={"left": Start(at={"B": (-2, 0)})}).problem()
    with refused("spring-of-length-zero", InvalidProblem, ["the Spring of F and B"]):
        line(1, place=(0, 0)).problem()


ROTATIONAL = {"angles": {"turn": Angle("upper")}, "forces": [RotationalDamper("turn", -2)]}


@pytest.mark.parametrize(("damped", "what"), [({"forces": [Damper("S", "B", -2)]}, "S and B"), (ROTATIONAL, "turn")], ids=["line", "angle"])
def test_negative_damping_is_taken_and_said(damped, what):
    with pytest.warns(NegativeDamping, match=f"{what} has negative damping -2"):
        assert Mechanism(**PLANE, **damped).problem().force is not None
