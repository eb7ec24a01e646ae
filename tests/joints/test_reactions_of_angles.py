"""Forces in joints of mechanisms with torques, gears and rotors at angles, and with quaternions, against equations worked out by hand."""

import numpy as np
import pytest
import sympy as sp
from mechanism_states import at_start, close, loads, trajectory
from mechanisms import lagrange, moving
from tops import rotation, top, turning

from daebench.joints import (
    Angle,
    Body,
    Coupling,
    Gear,
    Mechanism,
    PDMotor,
    QuaternionBody,
    Revolute,
    Rod,
    RotationalDamper,
    RotationalSpring,
    Start,
    Torque,
    t,
)

G = 9.81
DOWN = (0, "-9.81")


def directions(angle):
    """Return unit vectors at angles, and those to the left of them."""
    e = np.stack([np.cos(angle), np.sin(angle)], -1)
    return e, e[..., ::-1] * [-1, 1]


WHEELS = {"gear": Gear("wheel", "pinion", "-1/3"), "coupling": Coupling("pinion", "wheel", (0, -3))}


@pytest.mark.sampled(left_out=("coupling",))
@pytest.mark.parametrize("tie", WHEELS.values(), ids=WHEELS)
def test_teeth_of_two_wheels_and_their_bearings_bear_what_their_inertia_says(tie):
    """(I1 + I2/9) theta'' = tau - m g e cos(theta), with the first wheel's centre at a distance e from its axle."""
    problem = Mechanism(
        ground={"O": (0, 0), "Q": (4, 0)},
        points={"A": (1, 0), "B": (7, 0)},
        bodies={
            "first": Body("O", "A", mass=2, centre=("0.5", 0), inertia="1.5"),
            "second": Body("Q", "B", mass=9, centre="Q", inertia=27),
        },
        angles={"pinion": Angle("first"), "wheel": Angle("second")},
        joints=[tie],
        forces=[Torque("pinion", 30)],
        gravity=DOWN,
    ).problem()
    angle, rate = np.array([0.0, 0.7, 8.0]), np.array([0.0, -3.0, 1.5])
    (e, f), (far, turned) = directions(angle), directions(-angle / 3)
    q = np.column_stack([e, 3 * far + np.array([4, 0]), angle, -angle / 3])
    found = loads(problem, q, np.column_stack([f * rate[:, None], -turned * rate[:, None], rate, -rate / 3]))
    twice = (30 - 2 * G * 0.5 * np.cos(angle)) / (2 + 27 / 9)
    name = f"{type(tie).__name__} of {tie.first} and {tie.second}"
    assert {*found} == {("joint O", "first"), ("joint Q", "second"), (name, "first"), (name, "second")}
    assert close(found[name, "second"].torque[:, 0], 27 * -twice / 3, 100)
    assert close(found[name, "first"].torque[:, 0], 27 * -twice / 3 / 3, 100)
    assert close(found[name, "first"].force, np.zeros((3, 2)), 100)
    assert close(found["joint O", "first"].force, 2 * (0.5 * (twice[:, None] * f - rate[:, None] ** 2 * e) + [0, G]), 100)
    assert close(found["joint Q", "second"].force, [[0, 9 * G]] * 3, 100)
    assert close([found["joint O", "first"].torque, found["joint Q", "second"].torque], np.zeros((2, 3, 1)), 100)


@pytest.mark.sampled(left_out=("None",))
@pytest.mark.parametrize("ratio", [None, 2])
def test_the_pins_of_an_arm_with_springs_motors_rotors_and_a_gear(random, ratio):
    """Angles x, y of two rods: M (x'', y'') = (S - Q - (1 + ratio) T, Q + T) + ..., with the torque T of a gear, if any, on the elbow."""
    problem = Mechanism(
        ground={"O": (0, 0)},
        points={"A": (1, 0), "B": (2, 0)},
        bodies={"upper": Rod("O", "A", mass=2), "fore": Rod("A", "B", mass=1)},
        angles={"shoulder": Angle("upper"), "elbow": Angle("fore", "upper", armature="0.1")},
        joints=[] if ratio is None else [Gear("elbow", "shoulder", ratio)],
        forces=[
            RotationalSpring("elbow", 7, "0.5", damping="0.3"),
            RotationalDamper("elbow", "0.2"),
            PDMotor("elbow", 2, "0.9", target=1 + t, target_rate=4),
            Torque("shoulder", 3 + t),
        ],
        gravity=DOWN,
    ).problem()
    x, y, u, w = random.uniform(-3, 3, (4, 4))
    if ratio is not None:
        y, w = (1 + ratio) * x, (1 + ratio) * u
    time, a = np.arange(4) / 10, 0.1
    Q = -7 * (y - x - 0.5) - 0.5 * (w - u) + 2 * (1 + time - y + x) + 0.9 * (4 - w + u)
    c, s = np.cos(x - y) / 2, np.sin(x - y) / 2
    M = np.array([[5 / 3 + a + 0 * c, c - a], [c - a, 1 / 3 + a + 0 * c]]).transpose(2, 0, 1)
    right = np.column_stack([3 + time - Q - s * w**2 - 2 * G * np.cos(x), Q + s * u**2 - G / 2 * np.cos(y)])
    twice, teeth = np.linalg.solve(M, right[:, :, None])[:, :, 0], 0 * x
    if ratio is not None:
        both = np.stack([M @ [1, 1 + ratio], np.broadcast_to([1 + ratio, -1], (4, 2))], 2)
        first, teeth = np.linalg.solve(both, right[:, :, None])[:, :, 0].T
        twice = np.column_stack([first, (1 + ratio) * first])
    e, f = directions(np.stack([x, y]))
    rates = np.stack([u, w])[:, :, None]
    leaned = twice.T[:, :, None] * f - rates**2 * e
    on_fore = leaned[0] + leaned[1] / 2 + [0, G]
    on_upper = 2 * (leaned[0] / 2 + [0, G]) + on_fore
    q, v = (np.column_stack([way[0], way.sum(0), *pair]) for way, pair in ((e, (x, y)), (rates * f, (u, w))))
    found, size = loads(problem, q, v), np.abs(on_upper).max()
    assert close(found["joint O", "upper"].force, on_upper, size)
    assert close([found["joint A", "fore"].force, -found["joint A", "upper"].force], [on_fore] * 2, size)
    assert close([found["joint A", "fore"].torque, found["joint O", "upper"].torque], np.zeros((2, 4, 1)), size)
    if ratio is not None:
        gear = "Gear of elbow and shoulder"
        assert close(found[gear, "fore"].torque[:, 0], teeth, size)
        assert close(found[gear, "upper"].torque[:, 0], -(1 + ratio) * teeth, size)
    # Forces are balanced to rounding where the states of a run are off the constraints by its tolerance.
    assert trajectory(problem, q + 1e-4 * random.normal(size=q.shape), v).reactions().residual < 1e-12


@pytest.mark.exhaustive  # of rotors, the arm in the plane shows what its pins bear; of axes in space, the torsional pendulum
@pytest.mark.parametrize("kind", [Body, QuaternionBody])
@pytest.mark.parametrize("armature", ["0", "0.3"])
def test_hinges_in_space_with_torques_and_rotors_balance_their_bodies(random, kind, armature):
    """A post turns about z, and a rod on it about an axis n of the post: accelerations by Lagrange's equations of both angles."""
    axis = (2, 0, 0)
    problem = Mechanism(
        ground={"O": (0, 0, 0)},
        points={"A": (1, 0, 0), "B": (1, "0.7", 0)},
        bodies={"post": kind("O", "A", mass=2, centre="A", inertia=(1, "0.8", "0.9")), "rod": Rod("A", "B", mass=3)},
        joints=[Revolute("post", "ground", "O", axis=(0, 0, 1)), Revolute("post", "rod", "A", axis=axis)],
        angles={
            "yaw": Angle("ground", "post", axis=(0, 0, 1), armature=armature),
            "roll": Angle("rod", "post", axis=axis, armature=armature),
        },
        forces=[RotationalSpring("roll", 3, 1), Torque("yaw", "-0.7")],
        gravity=(0, 0, "-9.81"),
    ).problem()
    assert bool(problem.M.free_symbols) == (armature == "0" or kind is QuaternionBody)
    z, x = xi = sp.Matrix(sp.symbols("z x"))
    out, side = sp.Matrix([sp.cos(z), sp.sin(z), 0]), sp.Matrix([-sp.sin(z), sp.cos(z), 0])
    A, a = out, sp.Rational(armature)
    B = A + sp.Rational(7, 10) * (side * sp.cos(x) + sp.Matrix([0, 0, sp.sin(x)]))

    def kinetic(rate):
        p, r = A.jacobian(xi) * rate, B.jacobian(xi) * rate
        return p.dot(p) + sp.Rational("0.45") * rate[0] ** 2 + (p.dot(p) + r.dot(r) + p.dot(r)) / 2 + a / 2 * rate.dot(rate)

    call = lagrange(xi, sp.Matrix([*A, *B, *xi]), kinetic, 3 * sp.Rational("9.81") * B[2] / 2 + sp.Rational(3, 2) * (x - 1) ** 2 - 0.7 * z)
    q, v = moving(problem, random)
    # The unknown is the angle of the post against the ground, of which the yaw is the opposite.
    at, _, twice = call(q[-2:], v[-2:])
    weight = np.array([0, 0, G])
    P, R, dd_P, dd_R = at[:3], at[3:6], twice[:3] + weight, twice[3:6] + weight
    # The rod as point masses at its ends and its middle.
    push = [(0.5, P, dd_P), (2, (P + R) / 2, (dd_P + dd_R) / 2), (0.5, R, dd_R)]
    on_rod, about = sum(m * y for m, _, y in push), sum(m * np.cross(r - P, y) for m, r, y in push)
    roll = (-3 * (at[7] - 1) - float(armature) * twice[7]) * P
    turning_post = np.array([0, 0, 0.9 * twice[6]])
    yaw = np.array([0, 0, 0.7 - float(armature) * twice[6]])
    result = trajectory(problem, q, v).reactions()
    assert result.residual < 1e-12
    found = {(load.joint, load.on): load for load in result.loads}
    size = np.abs(on_rod).max()
    hinge, bearing = found["Revolute of post and rod", "rod"], found["Revolute of post and ground", "post"]
    assert close(hinge.force, on_rod, size)
    assert close(hinge.torque, about - roll, size)
    assert close(hinge.torque[0] @ P, 0, size)
    assert close(bearing.force, 2 * dd_P + on_rod, size)
    assert close(bearing.torque, np.cross(P, 2 * dd_P + on_rod) + turning_post + about - yaw, size)
    assert close(bearing.torque[0, 2], 0, size)


@pytest.mark.sampled(left_out=("QuaternionBody",))  # a heavy top shows what a quaternion does to forces
@pytest.mark.parametrize(
    ("kind", "at"),
    [(Body, {"E": (0, 1, 1), "rotor.y": (-1, 0, 0)}), (QuaternionBody, {"rotor.quaternion": (sp.cos(sp.pi / 4), 0, 0, sp.sin(sp.pi / 4))})],
    ids=["Body", "QuaternionBody"],
)
def test_a_torsional_pendulum_presses_its_axle_by_its_products_of_inertia(kind, at):
    """Theta'' = -k theta / I_zz, beyond a turn; M = I alpha + w x I w about P in axes of the body, whose z is that of the axle."""
    inertia = (("0.5", 0, "-0.2"), (0, "0.6", "0.1"), ("-0.2", "0.1", "0.3"))
    problem = Mechanism(
        ground={"P": (0, 0, 1)},
        points={"E": (1, 0, 1)},
        bodies={"rotor": kind("P", "E", mass=2, centre=("0.1", 0, "1.5"), inertia=inertia)},
        joints=[Revolute("rotor", "ground", "P", (0, 0, 1))],
        angles={"twist": Angle("rotor", axis=(0, 0, 1))},
        forces=[RotationalSpring("twist", 5)],
        cases={"wound": Start(at=at, angles={"twist": 9 * sp.pi / 2}, spin={"rotor": (0, 0, 10)})},
    ).problem()
    (found,) = at_start(problem).values()
    # About P, with legs (0.1, 0, 0.5) to the centre.
    about = np.array([[0.5 + 0.5, 0, -0.3], [0, 0.6 + 0.52, 0.1], [-0.3, 0.1, 0.32]])
    alpha = np.array([0, 0, -5 * 4.5 * np.pi / 0.32])
    w, leg = np.array([0, 0, 10]), np.array([0.1, 0, 0.5])
    torque = about @ alpha + np.cross(w, about @ w) - [0, 0, -5 * 4.5 * np.pi]
    force = 2 * (np.cross(alpha, leg) + np.cross(w, np.cross(w, leg)))
    assert close(found.torque_in_body, [torque], 100)
    assert close(found.force_in_body, [force], 100)
    turned = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])  # two turns and a quarter since the reference position
    assert close(found.torque, [turned @ torque], 100)
    assert close(found.force, [turned @ force], 100)


def eulers_force(w, q):
    """Return the force on the top at O: I w' = (I w) x w + arm x R^T m g, F = m (c'' - g)."""
    R, arm, about = rotation(q), np.array([0, 0, 1]), np.array([1.3, 1.4, 1.3])  # moments about O
    alpha = (np.cross(about * w, w) + np.cross(arm, R.T @ [0, 0, -0.5 * G])) / about
    return 0.5 * (R @ (np.cross(alpha, arm) + np.cross(w, np.cross(w, arm))) + [0, 0, G])


def test_the_point_of_a_heavy_top_bears_what_eulers_equations_say(random):
    q, w = random.normal(size=(5, 4)), random.uniform(-8, 8, (5, 3))
    q /= np.linalg.norm(q, axis=1)[:, None]
    result = trajectory(top(), q, np.array(list(map(turning, w, q)))).reactions()
    assert result.residual < 1e-12
    (found,), expected = result.loads, np.array(list(map(eulers_force, w, q)))
    size = np.abs(expected).max()
    assert close(found.force, expected, size)
    assert close(found.torque, np.zeros((5, 3)), size)
    assert close(found.force_in_body, np.einsum("kij,ki->kj", [rotation(x) for x in q], expected), size)
