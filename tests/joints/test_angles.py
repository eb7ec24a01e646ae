"""Torques, springs, motors, gears and rotors at angles against closed forms and hand-written equations in angles."""

import numpy as np
import pytest
import sympy as sp
from mechanisms import moving, rates
from refusals import refused
from scipy.integrate import solve_ivp

from daebench.compiler.definition import source_of
from daebench.joints import (
    Angle,
    Body,
    Coupling,
    Gear,
    Mechanism,
    NegativeDamping,
    PDMotor,
    Revolute,
    Rod,
    RotationalDamper,
    RotationalSpring,
    Start,
    Torque,
    t,
)
from daebench.methods.names import parse
from daebench.runs.make_ivp import make_ivp
from daebench.runs.request import Request

DISC = {"ground": {"O": (0, 0)}, "points": {"A": (1, 0)}, "bodies": {"disc": Body("O", "A", mass=2, centre="O", inertia=3)}}
TURN = {"turn": Angle("disc")}


def last(problem, t_end):
    """Return the positions at the end of a run, without a check of the start."""
    return parse("ida:index2").solve(make_ivp(source_of(problem)), Request(value=1e-11, t_end=t_end, points=2)).complete().q[-1]


def accelerating(problem):
    """Return a function of q, v and t for q'': Lagrange's equations with M(q), U, forces and multipliers, by SymPy."""
    w, x = sp.Matrix(rates(problem)), list(problem.q)
    g = sp.Matrix(list(problem.g))
    G, T = g.jacobian(x), (w.T * problem.M * w)[0] / 2
    curved = (problem.M * w).jacobian(x) * w - sp.Matrix([T - problem.U]).jacobian(x).T
    force = sp.Matrix(list(problem.force or [0] * problem.d)).subs(dict(zip(problem.v or (), w, strict=False)))
    call = sp.lambdify([x, list(w), t], [problem.M, G, force - curved, (G * w).jacobian(x) * w], "numpy", cse=True)

    def accelerated(q, v, time=0.0):
        M, G, right, drift = (np.array(y, dtype=float) for y in call(q, v, time))
        whole = np.block([[M, G.T], [G, np.zeros((len(G), len(G)))]])
        return np.linalg.solve(whole, np.concatenate([right.ravel(), -drift.ravel()]))[: problem.d]

    return accelerated


def test_a_spring_wound_three_turns_swings_as_its_closed_form():
    """Theta = 6 pi cos(w t) with w^2 = k / I, through six turns and back."""
    mechanism = Mechanism(**DISC, angles=TURN, forces=[RotationalSpring("turn", 5)], cases={"wound": Start(angles={"turn": 6 * sp.pi})})
    problem = mechanism.problem()
    assert problem.force is None
    assert not problem.M.free_symbols
    theta = 6 * np.pi * np.cos(np.sqrt(5 / 3) * 4)
    assert last(problem, 4) == pytest.approx([np.cos(theta), np.sin(theta), theta], abs=1e-6)


GEARS = {"gear": Gear("wheel", "pinion", "-1/3"), "coupling": Coupling("pinion", "wheel", (0, -3))}


@pytest.mark.exhaustive  # teeth bear what they should in test_reactions_of_angles.py, and a spring winds through turns below
@pytest.mark.parametrize("tie", GEARS.values(), ids=GEARS)
def test_a_gear_of_one_to_three_holds_over_ten_turns(tie):
    """A torque tau on the pinion: theta'' = tau / (I1 + I2 / 9)."""
    problem = Mechanism(
        ground={"O": (0, 0), "Q": (4, 0)},
        points={"A": (1, 0), "B": (7, 0)},
        bodies={"first": Body("O", "A", mass=1, centre="O", inertia=2), "second": Body("Q", "B", mass=9, centre="Q", inertia=27)},
        angles={"pinion": Angle("first"), "wheel": Angle("second")},
        joints=[tie],
        forces=[Torque("pinion", 10 * sp.pi)],
    ).problem()
    far = last(problem, np.sqrt(20))  # ten turns
    assert far[4:6] == pytest.approx([20 * np.pi, -20 * np.pi / 3], abs=1e-6)
    assert far[2:4] == pytest.approx([4 + 3 * np.cos(-20 * np.pi / 3), 3 * np.sin(-20 * np.pi / 3)], abs=1e-6)


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
    q = last(problem, 2)

    def rate(_, y):
        slope, bent = 0.5 - 0.4 * y[0] + 0.3 * y[0] ** 2 + 0.12 * y[0] ** 3, -0.4 + 0.6 * y[0] + 0.36 * y[0] ** 2
        return [y[1], (4 - 3 * slope * bent * y[1] ** 2) / (2 + 3 * slope**2)]

    x = solve_ivp(rate, (0, 2), [0, 0], method="DOP853", rtol=1e-12, atol=1e-12).y[0, -1]
    assert q[4:6] == pytest.approx([x, 0.5 * x - 0.2 * x**2 + 0.1 * x**3 + 0.03 * x**4], abs=1e-7)


def arm(**more):
    """Return an arm of two uniform rods of length 1, mass 2 and 1."""
    return Mechanism(
        ground={"O": (0, 0)},
        points={"A": (1, 0), "B": (2, 0)},
        bodies={"upper": Rod("O", "A", mass=2), "fore": Rod("A", "B", mass=1)},
        angles={"shoulder": Angle("upper"), "elbow": Angle("fore", "upper", armature="0.1")},
        **more,
    )


def in_space(armature):
    """Return a body that is hinged about z, and a rod hinged on it about x."""
    return Mechanism(
        ground={"O": (0, 0, 0)},
        points={"A": (1, 0, 0), "B": (1, "0.7", 0)},
        bodies={"post": Body("O", "A", mass=2, centre="A", inertia=(1, "0.8", "0.9")), "rod": Rod("A", "B", mass=3)},
        joints=[Revolute("post", "ground", "O", axis=(0, 0, 1)), Revolute("post", "rod", "A", axis=(2, 0, 0))],
        angles={"yaw": Angle("post", axis=(0, 0, 1), armature=armature), "roll": Angle("rod", "post", axis=(2, 0, 0), armature=armature)},
        forces=[RotationalSpring("roll", 3, 1, damping="0.2"), Torque("yaw", "0.7")],
        gravity=(0, "-1", "-9.81"),
    )


@pytest.mark.exhaustive  # models of arms with and without rotors are held against MuJoCo
@pytest.mark.parametrize("armature", ["0", "0.3"])
def test_hinges_in_space_turn_as_lagranges_equations_of_their_angles(random, armature):
    problem = in_space(armature).problem()
    assert bool(problem.M.free_symbols) == (armature == "0")
    z, x, u, w = sp.symbols("z x u w")
    by, rate, out = sp.Matrix([z, x]), sp.Matrix([u, w]), sp.Matrix([sp.cos(z), sp.sin(z), 0])
    A, B = out, out + sp.Rational(7, 10) * sp.Matrix([-sp.sin(z) * sp.cos(x), sp.cos(z) * sp.cos(x), sp.sin(x)])
    dA, dB = (place.jacobian(by) * rate for place in (A, B))
    T = dA.dot(dA) + sp.Rational("0.45") * u**2 + (dA.dot(dA) + dB.dot(dB) + dA.dot(dB)) / 2 + sp.Rational(armature) / 2 * (u**2 + w**2)
    U = sum(2 * P[k] * weight + 3 * (P[k] + Q[k]) / 2 * weight for P, Q in [(A, B)] for k, weight in ((1, 1), (2, 9.81)))
    slope = sp.Matrix([T]).jacobian(rate)
    right = sp.Matrix([T - U - 1.5 * (x - 1) ** 2]).jacobian(by).T - slope.jacobian(by) * rate + sp.Matrix([0.7, -0.2 * w])
    accelerated, call = accelerating(problem), sp.lambdify([z, x, u, w], [slope.jacobian(rate), right])
    for _ in range(3):
        q, v = moving(problem, random)
        mass, force = (np.array(part, dtype=float) for part in call(*q[-2:], *v[-2:]))
        assert accelerated(q, v)[-2:] == pytest.approx(np.linalg.solve(mass, force.ravel()), rel=1e-9)


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
    accelerated = accelerating(problem)
    for _ in range(3):
        q, v = moving(problem, random)
        (y, x), (w, u) = q[-2:], v[-2:]
        c, s = 0.35 * np.sin(x - y), -0.35 * np.cos(x - y)
        expected = np.linalg.solve([[2.52, c], [c, 0.49 / 3]], [3 * (y - x - 1) - s * w**2, -3 * (y - x - 1) + s * u**2])
        assert accelerated(q, v)[-2:] == pytest.approx(expected[::-1], rel=1e-9)


def test_angles_start_with_whole_turns_wherever_their_bodies_are():
    start = Start(at={"A": (0, -1), "B": (-1, -1)}, angles={"shoulder": 4 * sp.pi - sp.pi / 2})
    (case,) = arm(cases={"wound": start}).problem().cases.values()
    assert {float(x) for x in case.q[4:]} == {float(3.5 * sp.pi), float(3 * sp.pi)}
    (case,) = arm(cases={"wound": Start(at={"A": (-1, 0), "B": (-1, -1)})}).problem().cases.values()
    assert {float(x) for x in case.q[4:]} == {float(sp.pi), float(3 * sp.pi / 2)}  # the elbow is at pi/2, not at -3 pi/2


REFUSED = {
    "an angle that points contradict": (
        {"cases": {"x": Start(angles={"elbow": 1})}},
        "case-angle-against-points",
        ["elbow"],
    ),
    "an unknown angle at the start": ({"cases": {"x": Start(angles={"knee": 1})}}, "unknown-name", ["'knee'"]),
    "an unknown angle of a torque": ({"forces": [Torque("knee", 1)]}, "unknown-name", ["'knee'"]),
    "an unknown angle of a gear": ({"joints": [Gear("elbow", "knee", 2)]}, "unknown-name", ["'knee'"]),
    "a coupling of degree 5": ({"joints": [Coupling("elbow", "shoulder", [1] * 6)]}, "coupling-degree-too-high", ["5"]),
    "a gear that does not fit": ({"joints": [Gear("elbow", "shoulder", 2, 1)]}, "case-residual", ["the Gear of elbow and shoulder"]),
}


@pytest.mark.parametrize(("more", "code", "names"), REFUSED.values(), ids=REFUSED)
def test_mistakes_about_angles_are_named(more, code, names):
    with refused(code, says=names):
        arm(**more).problem()


ANGLES = {
    "of a body against itself": (Angle("disc", "disc"), "angle-against-itself", ["the angle turn", "disc"]),
    "of no body": (Angle("disk"), "unknown-name", ["'disk'"]),
    "of a negative armature": (Angle("disc", armature=-1), "armature-not-positive", ["the angle turn", "-1"]),
}


@pytest.mark.parametrize(("angle", "code", "names"), ANGLES.values(), ids=ANGLES)
def test_an_angle_that_is_none_is_refused(angle, code, names):
    with refused(code, says=names):
        Mechanism(**DISC, angles={"turn": angle}).problem()


def test_an_angle_in_space_needs_an_axis():
    body = Body("O", mass=1, centre=(0, 0, 0), inertia=(1, 1, 1))
    with refused("turned-joint-without-axis", says=["the angle turn"]):
        Mechanism(ground={"O": (0, 0, 0)}, points={}, bodies={"disc": body}, angles=TURN).problem()


def test_negative_damping_of_a_rotation_is_said():
    with pytest.warns(NegativeDamping, match="the RotationalDamper at turn has negative damping -1, so it adds energy"):
        Mechanism(**DISC, angles=TURN, forces=[RotationalDamper("turn", -1)]).problem()


def test_torques_motors_and_rotors_are_listed():
    forces = [
        Torque("turn", 2 * t),
        RotationalSpring("turn", 7, 2 * sp.pi, "0.5"),
        RotationalDamper("turn", "0.3"),
        PDMotor("turn", 8, 3, t),
        PDMotor("turn", 8, 3, t, 0),
    ]
    assert Mechanism(**DISC, angles={"turn": Angle("disc", armature=2)}, forces=forces).problem().parts.forces == (
        "Torque at turn: 2*t N m",
        "RotationalSpring at turn: stiffness 7 N m/rad, 2*pi rad without torque, damping 0.5 N m s/rad",
        "RotationalDamper at turn: damping 0.3 N m s/rad",
        "PDMotor at turn: kp 8 N m/rad, kd 3 N m s/rad, target t rad",
        "PDMotor at turn: kp 8 N m/rad, kd 3 N m s/rad, target t rad at 0 rad/s",
        "Armature of the angle turn: 2 kg m^2",
    )
