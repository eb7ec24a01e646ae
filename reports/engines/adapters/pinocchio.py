"""Pinocchio: articulated bodies in reduced coordinates, and closed loops by its constrained dynamics with Baumgarte's correction."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from daebench.reports.engines.contender import Array, Contender, States, halved, mass_matrix, stepped
from daebench.runs.ivp import ConstrainedIvp
from daebench.systems.lazily import pinocchio as pin

PACKAGE = "pinocchio"

USUAL = 10.0
"""Kp of its example of closed chains, 1/s^2, with Kd = 2 sqrt(Kp): critically damped."""

DECAYS = (1.0, 2.0, 4.0, 8.0, 16.0, 64.0)
"""Steps within which corrections decay, where Kp is swept."""

PROXIMAL = (1e-12, 1e-10, 20)
"""Accuracy, regularisation and most iterations of the solver of constraints; the example has 1e-8, 1e-10 and 10."""


@dataclass
class Robot:
    """A model, its state, and how its frames are daebench's positions."""

    model: Any
    """The model."""
    q: Array
    v: Array
    """Configuration and velocity."""
    read: Callable[["Robot"], tuple[Array, Array]]
    """From the robot to daebench's p and q."""
    loops: list[Any] = field(default_factory=list)
    """What closes its loops."""

    def __post_init__(self) -> None:
        self.data, self.tau = self.model.createData(), np.zeros(self.model.nv)
        self.loop_models, self.loop_data = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
        for loop in self.loops:
            self.loop_models.append(loop)
            self.loop_data.append(loop.createData())
        self.proximal = pin.ProximalSettings(*PROXIMAL)
        if self.loops:
            pin.initConstraintDynamics(self.model, self.data, self.loop_models, self.loop_data)

    def acceleration(self, q: Array, v: Array) -> Array:
        """Return the accelerations of the joints."""
        if not self.loops:
            return np.array(pin.aba(self.model, self.data, q, v, self.tau))  # a copy: what is returned is overwritten by the next call
        arguments = (self.model, self.data, q, v, self.tau, self.loop_models, self.loop_data, self.proximal)
        return np.array(pin.constraintDynamics(*arguments))

    def moved(self, x: Array) -> Array:
        """Return the configuration that is a displacement away."""
        return np.asarray(pin.integrate(self.model, self.q, x))

    def rate(self, x: Array, v: Array) -> Array:
        """Return the rate of a displacement at which the velocity is v; on hinges and slides they are the same."""
        if self.model.nq == self.model.nv:
            return v
        return np.linalg.solve(pin.dIntegrate(self.model, self.q, x, pin.ArgumentPosition.ARG1), v)

    def state(self) -> tuple[Array, Array, float]:
        """Return p, q and Pinocchio's mechanical energy."""
        energy = float(pin.computeMechanicalEnergy(self.model, self.data, self.q, self.v))
        pin.forwardKinematics(self.model, self.data, self.q, self.v)
        pin.updateFramePlacements(self.model, self.data)
        return (*self.read(self), energy)

    def frame(self, k: int) -> tuple[Array, Array]:
        """Return where a frame is, and its velocity, in the plane."""
        velocity = pin.getFrameVelocity(self.model, self.data, k, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        return self.data.oMf[k].translation[:2].copy(), velocity.linear[:2].copy()


def euler(robot: Robot, h: float, steps: int) -> None:
    """Take semi-implicit Euler steps, as its examples do."""
    for _ in range(steps):
        robot.v = robot.v + h * robot.acceleration(robot.q, robot.v)
        robot.q = pin.integrate(robot.model, robot.q, h * robot.v)


def rk4(robot: Robot, h: float, steps: int) -> None:
    """Take steps of the classical Runge-Kutta method, for displacements from the configuration at the step's start (Munthe-Kaas)."""
    a, moved, rate = robot.acceleration, robot.moved, robot.rate
    for _ in range(steps):
        v1 = robot.v
        a1, r1 = a(robot.q, v1), v1
        x2, v2 = h / 2 * r1, v1 + h / 2 * a1
        a2, r2 = a(moved(x2), v2), rate(x2, v2)
        x3, v3 = h / 2 * r2, v1 + h / 2 * a2
        a3, r3 = a(moved(x3), v3), rate(x3, v3)
        x4, v4 = h * r3, v1 + h * a3
        a4, r4 = a(moved(x4), v4), rate(x4, v4)
        robot.q = moved(h / 6 * (r1 + 2 * r2 + 2 * r3 + r4))
        robot.v = v1 + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)


def run(
    pose: Callable[[ConstrainedIvp], Robot], method: Callable[[Robot, float, int], None], ivp: ConstrainedIvp, h: float, times: Array
) -> States:
    """Run a robot with an integrator; Pinocchio gives accelerations and has none of its own."""
    robot = pose(ivp)
    return stepped(partial(method, robot, h), robot.state, h, times)


def run_loops(
    pose: Callable[[ConstrainedIvp, float], Robot], method: Callable[[Robot, float, int], None], ivp: ConstrainedIvp, h: float, times: Array
) -> States:
    """Run a robot with closed loops, with the usual gain."""
    return run(lambda problem: pose(problem, USUAL), method, ivp, h, times)


def run_gain(
    pose: Callable[[ConstrainedIvp, float], Robot],
    method: Callable[[Robot, float, int], None],
    steps: float,
    ivp: ConstrainedIvp,
    h: float,
    times: Array,
) -> States:
    """Run a robot with closed loops, with Kp = 1/(steps h)^2: corrections decay within so many steps."""
    return run(lambda problem: pose(problem, (steps * h) ** -2), method, ivp, h, times)


def placed(x: float, y: float = 0.0) -> Any:
    """Return a translation in the plane."""
    return pin.SE3(np.eye(3), np.array([x, y, 0.0]))


def hinge(model: Any, parent: int, at: float, mass: float, centre: float, moment: float, length: float) -> tuple[int, int]:
    """Add a body on a hinge along its first axis; return its joint and the frame of its end."""
    joint = model.addJoint(parent, pin.JointModelRZ(), placed(at), f"joint{model.njoints}")
    inertia = pin.Inertia(mass, np.array([centre, 0.0, 0.0]), np.diag([0.0, moment, moment]))
    model.appendBodyToJoint(joint, inertia, pin.SE3.Identity())
    frame = model.addFrame(pin.Frame(f"end{joint}", joint, placed(length), pin.FrameType.OP_FRAME))
    return joint, frame


def planar(ivp: ConstrainedIvp) -> Any:
    """Return a model without bodies under the gravity of a problem in the plane."""
    model = pin.Model()
    model.gravity.linear = np.array([0.0, -ivp.parameters["gravity"], 0.0])
    return model


def ends(frames: list[int], M: Array, robot: Robot) -> tuple[Array, Array]:
    """Return p and q where q are the places of frames."""
    seen = [robot.frame(k) for k in frames]
    return M @ np.concatenate([v for _, v in seen]), np.concatenate([x for x, _ in seen])


def tree(ivp: ConstrainedIvp) -> Robot:
    """Pose pendulums and chains released from rest in reduced coordinates, without constraints."""
    model, M = planar(ivp), mass_matrix(ivp)
    rods = np.diff(ivp.q0.reshape(-1, 2), axis=0, prepend=0.0)
    lengths = np.linalg.norm(rods, axis=1).tolist()
    joint, frames = 0, []
    for k, length in enumerate(lengths):
        joint, frame = hinge(model, joint, lengths[k - 1] if k else 0.0, float(M[2 * k, 2 * k]), length, 0.0, length)
        frames.append(frame)
    q = np.diff(np.unwrap(np.arctan2(rods[:, 1], rods[:, 0])), prepend=0.0)
    return Robot(model, q, np.zeros(model.nv), partial(ends, frames, M))


def loop(model: Any, first: int, x_first: float, second: int, x_second: float, gain: float) -> Any:
    """Return the constraint that keeps a point of one body at a point of another."""
    constraint = pin.RigidConstraintModel(pin.ContactType.CONTACT_3D, model, first, placed(x_first), second, placed(x_second))
    constraint.m_baumgarte_parameters.Kp = gain
    constraint.m_baumgarte_parameters.Kd = 2 * float(np.sqrt(gain))
    return constraint


def slider_crank(ivp: ConstrainedIvp, gain: float) -> Robot:
    """Pose the slider crank: crank and rod a tree of hinges, the slider on its line, and the rod's end kept at the slider."""
    model, M = planar(ivp), mass_matrix(ivp)
    crank, rod, crank_mass, rod_mass, slider_mass, _ = ivp.par
    first, knee = hinge(model, 0, 0.0, crank_mass, crank / 2, crank_mass * crank**2 / 12, crank)
    second, _ = hinge(model, first, crank, rod_mass, rod / 2, rod_mass * rod**2 / 12, rod)
    slider = model.addJoint(0, pin.JointModelPX(), pin.SE3.Identity(), "slider")
    model.appendBodyToJoint(slider, pin.Inertia(slider_mass, np.zeros(3), np.zeros((3, 3))), pin.SE3.Identity())
    omega = float(ivp.value("H_p", ivp.p0, ivp.q0)[1]) / crank

    def read(robot: Robot) -> tuple[Array, Array]:
        x, v = robot.frame(knee)
        return M @ np.append(v, robot.v[2]), np.append(x, robot.q[2])

    start, speed = np.array([0.0, 0.0, crank + rod]), np.array([omega, -omega - omega * crank / rod, 0.0])
    return Robot(model, start, speed, read, [loop(model, second, rod, slider, 0.0, gain)])


def four_bar(ivp: ConstrainedIvp, gain: float) -> Robot:
    """Pose the linkages: each upright with its coupler a tree of hinges, and the coupler's end kept at the next upright's."""
    model, M = planar(ivp), mass_matrix(ivp)
    length, mass = ivp.parameters["length"], ivp.parameters["mass"]
    moment, count = mass * length**2 / 12, ivp.d // 2
    uprights, couplers, frames = [], [], []
    for i in range(count):
        upright, frame = hinge(model, 0, i * length, mass, length / 2, moment, length)
        uprights.append(upright)
        frames.append(frame)
        if i + 1 < count:
            couplers.append(hinge(model, upright, length, mass, length / 2, moment, length)[0])
    loops = [loop(model, couplers[i], length, uprights[i + 1], length, gain) for i in range(count - 1)]
    (x, y), v = ivp.q0[:2], ivp.value("H_p", ivp.p0, ivp.q0)[:2]
    angle, omega = float(np.arctan2(y, x)), float((x * v[1] - y * v[0]) / length**2)
    signs = np.array(([1.0, -1.0] * count)[:-1])
    return Robot(model, angle * signs, omega * signs, partial(ends, frames, M), loops)


def top(ivp: ConstrainedIvp) -> Robot:
    """Pose the heavy top on a spherical joint, without constraints."""
    model, values = pin.Model(), ivp.parameters
    model.gravity.linear = np.array([0.0, 0.0, -values["gravity"]])
    moments, r = np.array([values[name] for name in ("I1", "I2", "I3")]), np.array([values[name] for name in ("r1", "r2", "r3")])
    joint = model.addJoint(0, pin.JointModelSpherical(), pin.SE3.Identity(), "ball")
    central = np.diag(moments) - values["mass"] * (r @ r * np.eye(3) - np.outer(r, r))
    model.appendBodyToJoint(joint, pin.Inertia(values["mass"], r, central), pin.SE3.Identity())
    y = ivp.p0.reshape(3, 3) - ivp.p0.reshape(3, 3).T

    def read(robot: Robot) -> tuple[Array, Array]:
        Q = robot.data.oMi[joint].rotation
        return (Q @ pin.skew(robot.v) @ np.diag(moments.sum() / 2 - moments)).ravel(), Q.ravel().copy()

    return Robot(model, pin.neutral(model), np.array([y[2, 1], y[0, 2], y[1, 0]]) / moments, read)


def contenders() -> list[Contender]:
    """Return reduced coordinates under both integrators, and closed loops with the usual gain and with one that is swept."""
    methods = {"Euler": euler, "RK4": rk4}
    rows = []
    for motion, first, count in (("pendulum", 1 / 8, 8), ("double", 1 / 32, 8), ("chain10", 1 / 16, 8), ("chain100", 1 / 64, 5)):
        for name, method in methods.items():
            rows.append(
                Contender("Pinocchio", f"aba, {name}", motion, "h", halved(first, count), partial(run, tree, method), constrained=False)
            )
    for name, method in methods.items():
        rows.append(Contender("Pinocchio", f"aba, {name}", "top", "h", halved(1 / 256, 7), partial(run, top, method), constrained=False))
    for motion, pose, first in (("slider", slider_crank, 1 / 32), ("fourbar", four_bar, 1 / 8), ("iftomm", four_bar, 1 / 32)):
        for name, method in methods.items():
            usual = partial(run_loops, pose, method)
            rows.append(Contender("Pinocchio", f"loops, Kp = 10, {name}", motion, "h", halved(first, 8), usual))
        gains = {f"Kp = 1/({steps:g} h)^2": partial(run_gain, pose, rk4, steps) for steps in DECAYS}
        swept = gains["Kp = 1/(4 h)^2"]
        rows.append(Contender("Pinocchio", "loops, Kp swept, RK4", motion, "h", halved(first, 8), swept, variants=gains))
    return rows
