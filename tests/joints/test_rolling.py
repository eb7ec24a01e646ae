"""Wheels, discs, balls and edges of ``daebench.joints`` against Newton and Euler's equations written by hand."""

import numpy as np
import pytest
from integrating import by_dop853
from measures import error_of
from refusals import refused
from scipy.spatial.transform import Rotation

import daebench
from daebench.compiler.definition import source_of
from daebench.diagnostics.nearby import rates
from daebench.diagnostics.problem.check import held
from daebench.joints import Body, KnifeEdge, Mechanism, Rolling, Spin, Start
from daebench.joints.reactions import reactions_of
from daebench.runs.make_ivp import make_ivp

GRAVITY = 9.81
RADIUS, MASS, INERTIA = 0.5, 3.0, (0.2, 0.35, 0.27)
NORMAL = np.array([0.0, 0.0, 1.0])


def wheel(centre, **more):
    """Return a body of unequal moments of inertia that touches the ground in the origin."""
    body = Body("C", mass=3, centre="C", inertia=("0.2", "0.35", "0.27"))
    rolling = Rolling("wheel", "ground", at=(0, 0, 0), centre="C", **more)
    return Mechanism(points={"C": centre}, bodies={"wheel": body}, joints=[rolling], gravity=(0, 0, "-9.81"))


def arm_of(axle, rate):
    """Return the centre as seen from the lowest point of a rim, and its rate; of a ball without an axle."""
    if axle is None:
        return RADIUS * NORMAL, np.zeros(3)
    up, up_rate = NORMAL - (NORMAL @ axle) * axle, -(NORMAL @ rate) * axle - (NORMAL @ axle) * rate
    length = np.linalg.norm(up)
    return RADIUS * up / length, RADIUS * (up_rate / length - up * (up @ up_rate) / length**3)


def by_newton_and_euler(turn, omega, axis):
    """Return the velocity of the centre, its acceleration and that of the angular velocity: m c'' = F + weight, L' = -arm x F."""
    axle = None if axis is None else turn @ axis
    arm, arm_rate = arm_of(axle, None if axis is None else np.cross(omega, axle))
    J, crossed = turn @ np.diag(INERTIA) @ turn.T, np.cross(np.eye(3), arm)
    # Rows: forces, torques, and c'' = omega' x arm + omega x arm'.
    A = np.block(
        [
            [MASS * np.eye(3), np.zeros((3, 3)), -np.eye(3)],
            [np.zeros((3, 3)), J, crossed],
            [np.eye(3), crossed, np.zeros((3, 3))],
        ]
    )
    b = np.concatenate([-MASS * GRAVITY * NORMAL, -np.cross(omega, J @ omega), np.cross(omega, arm_rate)])
    x = np.linalg.solve(A, b)
    return np.cross(omega, arm), x[:3], x[3:6]


UPRIGHT = (0, 0, "0.5")
SHAPES = {"ball": (None, UPRIGHT), "disc": ((0, 1, 0), UPRIGHT), "leaning disc": (("0.6", 0, "0.8"), ("-0.4", 0, "0.3"))}


@pytest.mark.sampled(left_out=("disc",))
@pytest.mark.parametrize(("axis", "centre"), SHAPES.values(), ids=SHAPES)
def test_a_body_that_rolls_in_space_accelerates_as_newton_and_euler_say(random, axis, centre):
    problem = wheel(centre, axis=axis, normal=(0, 0, 1)).problem()
    axle = None if axis is None else np.array(axis, dtype=float)
    M = np.array(problem.M.subs(problem.parameters), dtype=float)
    ivp = make_ivp(source_of(problem, "wheel"), "rest")
    for _ in range(3):
        turn, omega = Rotation.random(random_state=random).as_matrix(), random.standard_normal(3)
        velocity, acceleration, angular = by_newton_and_euler(turn, omega, axle)
        centre = arm_of(None if axle is None else turn @ axle, np.zeros(3))[0] + np.array([0.3, -0.2, 0.0])
        # The reference directions are those of the ground, so that the columns of the rotation are the unknowns after the centre.
        q = np.concatenate([centre, turn.T.ravel()])
        v = np.concatenate([velocity, np.cross(omega, turn.T).ravel()])
        force, moved = rates(ivp, M @ v, q)
        assert error_of(moved, v) < 1e-12
        assert np.abs(ivp.value("g", q)).max() < 1e-12
        assert np.abs(ivp.value("Gv", M @ v, q)).max() < 1e-12
        turned = np.cross(angular, turn.T) + np.cross(omega, np.cross(omega, turn.T))
        expected = np.concatenate([acceleration, turned.ravel()])
        assert error_of(np.linalg.solve(M, force), expected) < 1e-10 * np.abs(expected).max()


def sleigh(second="ground", **more):
    """Return a sleigh whose edge is at P and whose centre of mass is 0.2 m ahead, on the ground or on a table that turns about O."""
    table = {} if second == "ground" else {"table": Body("O", "T", mass=2, centre=("0.3", "0.1"), inertia="0.5")}
    return Mechanism(
        ground={"O": ("0.3", "-0.2")},
        points={"P": (1, 0), "Q": (2, 0)} | ({"T": ("0.3", "0.8")} if table else {}),
        bodies={**table, "sleigh": Body("P", "Q", mass="1.5", centre=("1.2", 0), inertia="0.3")},
        joints=[KnifeEdge("sleigh", second, at="P", axis=(1, 0))],
        **more,
    )


def test_a_sleigh_runs_as_chaplygin_says(plain_functions):
    # m (u' - a w^2) = 0, (I + m a^2) w' + m a u w = 0 with the speed u along the edge.
    m, inertia, a = 1.5, 0.3, 0.2
    start = Start(velocity={"P": ("0.4", 0)}, spin={"sleigh": 2})

    def slope(_, y):
        _, _, phi, u, w = y
        return [u * np.cos(phi), u * np.sin(phi), w, a * w**2, -m * a * u * w / (inertia + m * a**2)]

    expected = by_dop853(slope, [1, 0, 0, 0.4, 2], 3)
    end = daebench.run(sleigh(cases={"pushed": start}).problem(), method="ida:ode", tol=1e-11, t_end=3)
    x, y, phi = expected[:3]
    assert error_of(end.q[-1], [x, y, x + np.cos(phi), y + np.sin(phi)]) < 1e-8


def test_an_edge_on_a_table_that_turns_moves_with_it(random):
    problem = sleigh(second="table").problem()
    (row,) = problem.velocity
    for _ in range(3):
        (alpha, phi), (x, y) = random.uniform(-3, 3, (2, 2))
        table, spin, v = random.standard_normal(2)[0], random.standard_normal(2)[0], random.standard_normal(2)
        e, aside = np.array([np.cos(phi), np.sin(phi)]), np.array([-np.sin(phi), np.cos(phi)])
        q = [0.3 - np.sin(alpha), np.cos(alpha) - 0.2, x, y, *(np.array([x, y]) + e)]
        rate = [-table * np.cos(alpha), -table * np.sin(alpha), *v, *(v + spin * aside)]
        at = dict(zip([*problem.q, *problem.v], [*q, *rate], strict=True))
        slip = v - table * np.array([-(y + 0.2), x - 0.3])
        assert float(row.subs(at)) == pytest.approx(float(aside @ slip), abs=1e-12)


def test_a_ball_on_a_plate_that_turns_does_not_slip_on_it(random):
    plate = Body("O", mass=1, centre="O", inertia=(1, 1, 1))
    ball = Body("C", mass=1, centre="C", inertia=(1, 1, 1))
    rolling = Rolling("ball", "plate", at=(0, 0, 0), centre="C")
    problem = Mechanism(ground={"O": (0, 0, 0)}, points={"C": (0, 0, 1)}, bodies={"plate": plate, "ball": ball}, joints=[rolling]).problem()
    for _ in range(2):
        tilt, turn = (Rotation.random(random_state=random).as_matrix() for _ in range(2))
        omega, spin, v, (x, y) = *random.standard_normal((3, 3)), random.standard_normal(2)
        contact = tilt @ [x, y, 0]
        q = np.concatenate([tilt.T.ravel(), contact + tilt[:, 2], turn.T.ravel()])
        rate = np.concatenate([np.cross(omega, tilt.T).ravel(), v, np.cross(spin, turn.T).ravel()])
        at = dict(zip([*problem.q, *problem.v], [*q, *rate], strict=True))
        slip = tilt.T @ (v - np.cross(spin, tilt[:, 2]) - np.cross(omega, contact))
        rows = np.array([float(row.subs(at)) for row in problem.velocity])
        assert np.sort(np.abs(rows)) == pytest.approx(np.sort(np.abs(slip[:2])), abs=1e-12)
        assert float(problem.g[-1].subs(at)) == pytest.approx(0, abs=1e-12)


def cart(*joints, **angles):
    return Mechanism(
        points={"L": (0, "0.2"), "R": (0, "-0.2")},
        bodies={"chassis": Body("L", "R", mass=10, centre=(0, 0), inertia="0.4")},
        angles=angles,
        joints=joints,
    )


def rolls(at, **more):
    return Rolling("chassis", "ground", at=at, **{"axis": (0, 1), "angle": "left", "radius": "0.1"} | more)


MISTAKES = {
    "no radius": (lambda: cart(rolls("L", radius=None), left=Spin("0.1")), "rolling-part-missing", ["L", "radius="]),
    "an angle that is none": (lambda: cart(rolls("L")), "rolling-angle-not-spin", ["L", "'left'"]),
    "no direction": (
        lambda: cart(KnifeEdge("chassis", "ground", "L", (0, 0))),
        "direction-zero",
        ["the KnifeEdge of chassis and ground at L"],
    ),
    "slides without an axis": (lambda: wheel(UPRIGHT, slides=True), "rolling-part-missing", ["axis="]),
    "centre at the contact": (lambda: wheel((0, 0, 0)), "wheel-centre-at-contact", []),
    "a wheel without inertia": (lambda: cart(rolls("L"), left=Spin(0)), "mechanism-mass-singular", ["left"]),
}


@pytest.mark.parametrize(("mechanism", "code", "names"), MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_in_a_wheel_or_an_edge_is_named(mechanism, code, names):
    with refused(code, says=names):
        mechanism().problem()


def test_two_wheels_that_both_hold_their_axle_are_named():
    problem = cart(rolls("L"), rolls("R", angle="right"), left=Spin("0.1"), right=Spin("0.1")).problem()
    faults = [finding.fault for finding in held(make_ivp(source_of(problem, "cart"), "rest")) if finding.fault]
    assert len(faults) == 1
    assert "the Rolling of chassis and ground at R, across is a combination of" in faults[0]


def test_reactions_of_wheels_are_refused_in_a_sentence():
    mechanism = cart(rolls("L"), left=Spin("0.1"))
    with refused("reactions-of-wheels", says=["the Rolling of chassis and ground"]):
        reactions_of(mechanism, {}, np.zeros(1), *np.zeros((3, 1, 5)))
