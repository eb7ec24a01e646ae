"""MuJoCo: trees of hinges in reduced coordinates, and closed loops by soft equality constraints."""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from daebench.reports.engines.contender import Array, Contender, States, halved, mass_matrix, stepped
from daebench.runs.ivp import ConstrainedIvp
from daebench.systems.lazily import mujoco

PACKAGE = "mujoco"

MODEL = """<mujoco>
  <compiler angle="radian"/>
  <option timestep="{h!r}" integrator="{integrator}" gravity="{gravity}" solver="Newton" tolerance="1e-14" iterations="100"/>
  <worldbody>{bodies}</worldbody>
  {rest}
</mujoco>"""
"""Any model: no geoms, so that nothing collides; no damping, no armature."""

POINT = 1e-13
"""Moments of inertia of a point mass of 1 kg, kg m^2; MuJoCo wants more than 0."""

HARD = 'solref="{constant!r} {ratio!r}" solimp="0.9999 0.9999 0.001 0.5 2"'
"""Constraints at the largest impedance, with a time constant in steps and a damping ratio that are swept."""

CONSTANTS, RATIOS = (1.0, 1.5, 2.0, 3.0, 4.0, 8.0), (0.5, 1.0, 2.0)
"""Time constants, in steps, and damping ratios. Its documentation calls 2 and more safe, and clips what is less unless told not to."""

SHIPPED = ""
"""Constraints as they are if nothing is said: solref="0.02 1", solimp="0.9 0.95 0.001 0.5 2"."""

TREE = ("RK4", "implicit", "implicitfast", "Euler")
"""Its integrators."""


def inertial(mass: float, at: str, moment: float) -> str:
    """Return the inertia of a body in the plane."""
    return f'<inertial mass="{mass!r}" pos="{at}" diaginertia="{moment!r} {moment!r} {moment!r}"/>'


def hinge(at: str = "0 0 0") -> str:
    """Return a hinge about the normal of the plane."""
    return f'<joint type="hinge" axis="0 0 1" pos="{at}"/>'


def nested(bodies: Sequence[str]) -> str:
    """Return bodies each of which is the child of the one before."""
    text = ""
    for body in reversed(bodies):
        text = f"<body {body}{text}</body>"
    return text


def links(lengths: Sequence[float], masses: Sequence[float]) -> str:
    """Return point masses on massless rods, the first hinged at the origin; at joint angles 0 all lie along the first axis."""
    starts = [0.0, *lengths[:-1]]
    return nested(
        [
            f'pos="{start!r} 0 0">{hinge()}{inertial(mass, f"{length!r} 0 0", POINT)}<site name="s{k}" pos="{length!r} 0 0"/>'
            for k, (start, length, mass) in enumerate(zip(starts, lengths, masses, strict=True))
        ]
    )


def bar(name: str, length: float, mass: float, at: str, *, rest: str = "") -> str:
    """Return a uniform bar from its hinge along its first axis, with a site at its end."""
    moment = mass * length**2 / 12
    middle = inertial(mass, f"{length / 2!r} 0 0", moment)
    return f'<body name="{name}" pos="{at}">{hinge()}{middle}<site name="{name}" pos="{length!r} 0 0"/>{rest}</body>'


class Simulation:
    """A model, its data, and how its sites are daebench's positions."""

    def __init__(
        self, ivp: ConstrainedIvp, h: float, integrator: str, bodies: str, rest: str, places: Sequence[tuple[str, tuple[int, ...]]]
    ) -> None:
        mujoco.set_mju_user_warning(lambda text: None)  # else it writes a file; what it warns of is raised below
        self.ivp, self.places = ivp, places
        gravity = f"0 {-ivp.parameters['gravity']!r} 0"
        self.model = mujoco.MjModel.from_xml_string(MODEL.format(h=h, integrator=integrator, gravity=gravity, bodies=bodies, rest=rest))
        self.data, self.seen = mujoco.MjData(self.model), mujoco.MjData(self.model)
        self.M = mass_matrix(ivp)

    def advance(self, steps: int) -> None:
        """Take steps, all within one call of C."""
        mujoco.mj_step(self.model, self.data, nstep=steps)

    def energy(self) -> float:
        """Copy the state, so that the run is not touched, and return MuJoCo's energy of it."""
        if any(warning.number for warning in self.data.warning):
            raise ArithmeticError("MuJoCo found a value that is not a number or too large, and went back to the start")
        self.seen.qpos[:], self.seen.qvel[:] = self.data.qpos, self.data.qvel
        mujoco.mj_forward(self.model, self.seen)
        mujoco.mj_energyPos(self.model, self.seen)
        mujoco.mj_energyVel(self.model, self.seen)
        return float(self.seen.energy.sum())

    def read(self) -> tuple[Array, Array, float]:
        """Return p, q and MuJoCo's energy."""
        energy, q, v = self.energy(), [], []
        for site, axes in self.places:
            k = self.model.site(site).id
            six = np.empty(6)
            mujoco.mj_objectVelocity(self.model, self.seen, mujoco.mjtObj.mjOBJ_SITE, k, six, 0)
            q += [self.seen.site_xpos[k][axis] for axis in axes]
            v += [six[3 + axis] for axis in axes]
        return self.M @ np.array(v), np.array(q), energy


Pose = Callable[[ConstrainedIvp, float, str, str], Simulation]
"""From a problem, a step size, an integrator and the attributes of its constraints to a simulation."""


def run(pose: Pose, integrator: str, ivp: ConstrainedIvp, h: float, times: Array) -> States:
    """Run a model as posed, with an integrator, and constraints as shipped where it has any."""
    simulation = pose(ivp, h, integrator, SHIPPED)
    return stepped(simulation.advance, simulation.read, h, times)


def run_hard(pose: Pose, integrator: str, constant: float, ratio: float, ivp: ConstrainedIvp, h: float, times: Array) -> States:
    """Run a model with hard constraints: a time constant of so many steps, and a damping ratio."""
    simulation = pose(ivp, h, integrator, HARD.format(constant=constant * h, ratio=ratio))
    simulation.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_REFSAFE)
    return stepped(simulation.advance, simulation.read, h, times)


def hanging(ivp: ConstrainedIvp) -> tuple[list[float], list[float]]:
    """Return lengths and masses of the pendulums and chains."""
    values = ivp.parameters
    if ivp.problem == "double_pendulum":
        return [values["length1"], values["length2"]], [values["mass1"], values["mass2"]]
    return [values["length"]] * ivp.m, [values["mass"]] * ivp.m


def tree(ivp: ConstrainedIvp, h: float, integrator: str, softness: str) -> Simulation:
    """Pose pendulums and chains in reduced coordinates: joint angles, and no constraint."""
    lengths, masses = hanging(ivp)
    places = [(f"s{k}", (0, 1)) for k in range(ivp.m)]
    simulation = Simulation(ivp, h, integrator, links(lengths, masses), "", places)
    rods = np.diff(ivp.q0.reshape(-1, 2), axis=0, prepend=0.0)
    simulation.data.qpos[:] = np.diff(np.unwrap(np.arctan2(rods[:, 1], rods[:, 0])), prepend=0.0)
    return simulation


def points(ivp: ConstrainedIvp, h: float, integrator: str, softness: str) -> Simulation:
    """Pose pendulums and chains as points free in the plane, each tied to the one before by a tendon of fixed length."""
    _, masses = hanging(ivp)
    slides = '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>'
    starts = [f"{x!r} {y!r} 0" for x, y in ivp.q0.reshape(-1, 2).tolist()]
    bodies = "".join(
        f'<body pos="{at}">{slides}{inertial(mass, "0 0 0", POINT)}<site name="s{k}"/></body>'
        for k, (at, mass) in enumerate(zip(starts, masses, strict=True))
    )
    names = ["pivot", *(f"s{k}" for k in range(ivp.m))]
    tendons = "".join(f'<spatial name="t{k}"><site site="{names[k]}"/><site site="{names[k + 1]}"/></spatial>' for k in range(ivp.m))
    ties = "".join(f'<tendon tendon1="t{k}" {softness}/>' for k in range(ivp.m))
    rest = f"<tendon>{tendons}</tendon><equality>{ties}</equality>"
    return Simulation(ivp, h, integrator, f'<site name="pivot"/>{bodies}', rest, [(f"s{k}", (0, 1)) for k in range(ivp.m)])


def slider_crank(ivp: ConstrainedIvp, h: float, integrator: str, softness: str) -> Simulation:
    """Pose the slider crank: crank and rod a tree of hinges, the slider on its line, and rod and slider connected."""
    crank, rod, crank_mass, rod_mass, slider_mass, _ = ivp.par
    second = bar("rod", rod, rod_mass, f"{crank!r} 0 0")
    slide = f'<joint type="slide" axis="1 0 0"/>{inertial(slider_mass, "0 0 0", 1.0)}<site name="slider"/>'
    bodies = bar("crank", crank, crank_mass, "0 0 0", rest=second) + f'<body pos="{crank + rod!r} 0 0">{slide}</body>'
    rest = f'<equality><connect site1="rod" site2="slider" {softness}/></equality>'
    simulation = Simulation(ivp, h, integrator, bodies, rest, [("crank", (0, 1)), ("slider", (0,))])
    omega = ivp.value("H_p", ivp.p0, ivp.q0)[1] / crank
    simulation.data.qvel[:] = [omega, -omega - omega * crank / rod, 0.0]
    return simulation


def four_bar(ivp: ConstrainedIvp, h: float, integrator: str, softness: str) -> Simulation:
    """Pose the linkages: each upright with its coupler a tree of hinges, and the coupler's end connected to the next upright's."""
    length, mass = ivp.parameters["length"], ivp.parameters["mass"]
    count = ivp.d // 2
    couplers = [bar(f"c{i}", length, mass, f"{length!r} 0 0") if i + 1 < count else "" for i in range(count)]
    bodies = "".join(bar(f"u{i}", length, mass, f"{i * length!r} 0 0", rest=coupler) for i, coupler in enumerate(couplers))
    ties = "".join(f'<connect site1="c{i}" site2="u{i + 1}" {softness}/>' for i in range(count - 1))
    simulation = Simulation(ivp, h, integrator, bodies, f"<equality>{ties}</equality>", [(f"u{i}", (0, 1)) for i in range(count)])
    x, y = ivp.q0[:2]
    v = ivp.value("H_p", ivp.p0, ivp.q0)[:2]
    angle, omega = float(np.arctan2(y, x)), float((x * v[1] - y * v[0]) / length**2)
    simulation.data.qpos[:] = ([angle, -angle] * count)[:-1]
    simulation.data.qvel[:] = ([omega, -omega] * count)[:-1]
    return simulation


class Top(Simulation):
    """The heavy top by its attitude, a rotation matrix in daebench's coordinates."""

    def __init__(self, ivp: ConstrainedIvp, h: float, integrator: str, joint: str, rest: str) -> None:
        values = ivp.parameters
        self.moments = np.array([values[name] for name in ("I1", "I2", "I3")])
        r, mass = np.array([values[name] for name in ("r1", "r2", "r3")]), values["mass"]
        central = np.diag(self.moments) - mass * (r @ r * np.eye(3) - np.outer(r, r))
        about = " ".join(map(repr, np.diag(central).tolist()))
        where = " ".join(map(repr, r.tolist()))
        body = f'<inertial mass="{mass!r}" pos="{where}" diaginertia="{about}"/><site name="tip"/>'
        super().__init__(ivp, h, integrator, f'<site name="pivot"/><body name="top">{joint}{body}</body>', rest, [])
        self.model.opt.gravity[:] = 0, 0, -values["gravity"]
        P = ivp.p0.reshape(3, 3)
        y = P - P.T
        self.data.qvel[-3:] = np.array([y[2, 1], y[0, 2], y[1, 0]]) / self.moments

    def read(self) -> tuple[Array, Array, float]:
        """Return P = Q hat(omega) D, Q, and MuJoCo's energy; the velocity of a ball is in the axes of the body."""
        energy = self.energy()
        Q = self.seen.body("top").xmat.reshape(3, 3)
        x, y, z = self.seen.qvel[-3:]
        hat = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        P = Q @ hat @ np.diag(self.moments.sum() / 2 - self.moments)
        return P.ravel(), Q.ravel().copy(), energy


def top_on_ball(ivp: ConstrainedIvp, h: float, integrator: str, softness: str) -> Simulation:
    """Pose the heavy top on a ball joint, without constraints."""
    return Top(ivp, h, integrator, '<joint type="ball"/>', "")


def top_connected(ivp: ConstrainedIvp, h: float, integrator: str, softness: str) -> Simulation:
    """Pose the heavy top as a free body whose tip is connected to the pivot."""
    return Top(ivp, h, integrator, "<freejoint/>", f'<equality><connect site1="tip" site2="pivot" {softness}/></equality>')


def contenders() -> list[Contender]:
    """Return reduced coordinates under all integrators, and closed loops with constraints that are swept and as shipped."""
    entries = []
    for motion, first in {"pendulum": 1 / 8, "double": 1 / 32, "chain10": 1 / 16, "chain100": 1 / 64}.items():
        for name in TREE:
            entries.append(
                Contender("MuJoCo", f"hinges, {name}", motion, "h", halved(first, 12), partial(run, tree, name), constrained=False)
            )
    for motion, first in {"pendulum": 1 / 32, "double": 1 / 64, "chain10": 1 / 64}.items():
        entries += [swept(motion, f"tendons, {name}", first, points, name) for name in ("RK4", "implicitfast")]
    for motion, first, pose in (("slider", 1 / 64, slider_crank), ("fourbar", 1 / 16, four_bar), ("iftomm", 1 / 64, four_bar)):
        entries += [swept(motion, f"connect, {name}", first, pose, name) for name in ("RK4", "implicitfast")]
        shipped = partial(run, pose, "implicitfast")
        entries.append(Contender("MuJoCo", "connect as shipped, implicitfast", motion, "h", halved(first, 12), shipped))
    for name in TREE:
        entries.append(
            Contender("MuJoCo", f"ball, {name}", "top", "h", halved(1 / 512, 11), partial(run, top_on_ball, name), constrained=False)
        )
    return [*entries, swept("top", "free body connected, RK4", 1 / 512, top_connected, "RK4")]


def swept(motion: str, setting: str, first: float, pose: Pose, integrator: str) -> Contender:
    """Return a closed loop with hard constraints, whose time constant and damping ratio are swept."""
    variants = {
        f"solref {constant:g} h, {ratio:g}": partial(run_hard, pose, integrator, constant, ratio)
        for constant in CONSTANTS
        for ratio in RATIOS
    }
    safe = partial(run_hard, pose, integrator, 2.0, 1.0)
    return Contender("MuJoCo", setting, motion, "h", halved(first, 11), safe, variants=variants)
