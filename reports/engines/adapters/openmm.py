"""OpenMM: butane as a molecule with constraints, and pendulums and chains as halves of molecules that are mirrored in their pivot."""

from functools import partial
from typing import Any

import numpy as np

from daebench.reports.engines.contender import Array, Contender, States, halved, mass_matrix, stepped
from daebench.runs.ivp import ConstrainedIvp
from daebench.systems.lazily import openmm

PACKAGE = "openmm"

PLATFORM = "Reference"
"""The platform that computes in double precision."""

TOLERANCE, TIGHT = 1e-5, 1e-12
"""Tolerance of constraints, in parts of their distances: what it is if nothing is said, and one near round-off."""

ANGSTROM = 0.1
"""One Angstrom, nm; with time in 0.1 ps velocities have the same numbers in both units."""

STRAIGHT = 2
"""Links from which on CCMA is told that a chain is straight, which ours is nearly; without that its iteration ends before its tolerance."""

MIRRORED = ("planar_pendulum", "double_pendulum", "pendulum_chain")
"""Problems whose pivot is the centre of a mirrored molecule."""


def rattle(h: float) -> Any:
    """Return velocity Verlet with RATTLE, as the documentation of CustomIntegrator writes it."""
    integrator = openmm.CustomIntegrator(h)
    integrator.addPerDofVariable("x1", 0)
    integrator.addUpdateContextState()
    integrator.addComputePerDof("v", "v+0.5*dt*f/m")
    integrator.addComputePerDof("x", "x+dt*v")
    integrator.addComputePerDof("x1", "x")
    integrator.addConstrainPositions()
    integrator.addComputePerDof("v", "v+0.5*dt*f/m+(x-x1)/dt")
    integrator.addConstrainVelocities()
    return integrator


def verlet(h: float) -> Any:
    """Return its VerletIntegrator, leap-frog with SHAKE's constraints: velocities are half a step behind positions."""
    return openmm.VerletIntegrator(h)


def molecule(ivp: ConstrainedIvp, hint: bool) -> tuple[Any, Array, Array]:
    """Return butane with its positions and velocities: constraints for bonds and angles, and its torsion as a RBTorsionForce.

    CCMA takes the angles between constraints that share an atom from triangles of constraints, or from a HarmonicAngleForce, else it takes
    them for uncoupled, and here it then diverges (openmm/openmm, issue 3603). The hint is a HarmonicAngleForce of no stiffness with the
    angles 0-2-3 and 0-1-3 that the molecule has at a torsion of 90 degrees.
    """
    values, system = ivp.parameters, openmm.System()
    for mass in np.diag(mass_matrix(ivp))[::3]:
        system.addParticle(float(mass))
    r = ivp.q0.reshape(-1, 3) * ANGSTROM
    for i, j in ((0, 1), (1, 2), (2, 3), (0, 2), (1, 3)):
        system.addConstraint(i, j, float(np.linalg.norm(r[j] - r[i])))
    torsion = openmm.RBTorsionForce()
    torsion.addTorsion(0, 1, 2, 3, *(values[f"C{k}"] for k in range(6)))
    system.addForce(torsion)
    if hint:
        system.addForce(hinted(values["bond"], np.radians(values["angle"])))
    return system, r, np.linalg.solve(mass_matrix(ivp), ivp.p0).reshape(-1, 3)


def hinted(bond: float, angle: float) -> Any:
    """Return the angles 0-2-3 and 0-1-3 at a torsion of 90 degrees, with no stiffness."""
    along, off = -bond * np.cos(angle), bond * np.sin(angle)
    first, third, last = np.array([-along, off, 0.0]), np.array([bond, 0.0, 0.0]), np.array([bond + along, 0.0, -off])
    u, w = first - third, last - third
    between = float(np.arccos(u @ w / np.linalg.norm(u) / np.linalg.norm(w)))
    force = openmm.HarmonicAngleForce()
    force.addAngle(0, 2, 3, between, 0.0)
    force.addAngle(0, 1, 3, between, 0.0)
    return force


def straight(chain: list[int]) -> Any:
    """Return an angle of 180 degrees, with no stiffness, at each particle of a chain but the outer ones."""
    force = openmm.HarmonicAngleForce()
    for i, j, k in zip(chain, chain[1:], chain[2:], strict=False):
        force.addAngle(i, j, k, np.pi, 0.0)
    return force


def mirrored(ivp: ConstrainedIvp) -> tuple[Any, Array, Array]:
    """Return a pendulum and its image in the pivot: no constraint may end at a particle that is held, so that the image takes its place.

    The image feels gravity upwards, so that the centre of the whole rests; the first rods are one constraint of twice their length.
    """
    M, gravity = mass_matrix(ivp), ivp.parameters["gravity"]
    half, system = np.pad(ivp.q0.reshape(-1, 2), ((0, 0), (0, 1))), openmm.System()
    r, n = np.concatenate([half, -half]), len(half)
    field = openmm.CustomExternalForce("weight*y")
    field.addPerParticleParameter("weight")
    for sign in (1, -1):
        for k in range(n):
            mass = float(M[2 * k, 2 * k])
            field.addParticle(system.addParticle(mass), [sign * mass * gravity])
    system.addForce(field)
    if n > STRAIGHT:
        system.addForce(straight([*range(n - 1, -1, -1), *range(n, 2 * n)]))
    for i, j in [(0, n), *((i, i + 1) for i in range(n - 1)), *((n + i, n + i + 1) for i in range(n - 1))]:
        system.addConstraint(i, j, float(np.linalg.norm(r[j] - r[i])))
    v = np.pad(np.linalg.solve(M, ivp.p0).reshape(-1, 2), ((0, 0), (0, 1)))
    return system, r, np.concatenate([v, -v])


class Simulation:
    """A context, and how its particles are daebench's positions."""

    def __init__(self, ivp: ConstrainedIvp, integrator: Any, tolerance: float, *, hint: bool = True) -> None:
        self.ivp, self.M, self.mirrored = ivp, mass_matrix(ivp), ivp.problem in MIRRORED
        system, r, v = mirrored(ivp) if self.mirrored else molecule(ivp, hint)
        self.integrator = integrator
        integrator.setConstraintTolerance(tolerance)
        self.context = openmm.Context(system, integrator, openmm.Platform.getPlatformByName(PLATFORM))
        self.context.setPositions(r)
        self.context.setVelocities(v)

    def energy(self, state: Any) -> float:
        """Return OpenMM's energy, of one half of what is mirrored."""
        total = float((state.getKineticEnergy() + state.getPotentialEnergy())._value)
        return total / 2 if self.mirrored else total

    def mapped(self, values: Array, unit: float = 1.0) -> Array:
        """Return rows of particles as a vector of daebench's."""
        plane = self.mirrored
        rows = values[: len(values) // 2, :2] if plane else values / unit
        return np.array(rows, dtype=float).ravel()

    def read(self) -> tuple[Array, Array, float]:
        """Return p, q and OpenMM's energy."""
        state = self.context.getState(positions=True, velocities=True, energy=True)
        q = self.mapped(state.getPositions(asNumpy=True)._value, ANGSTROM)
        return self.M @ self.mapped(state.getVelocities(asNumpy=True)._value), q, self.energy(state)

    def particles(self) -> tuple[Array, Array]:
        """Return positions and velocities of all particles, nm and nm/ps."""
        state = self.context.getState(positions=True, velocities=True)
        return state.getPositions(asNumpy=True)._value, state.getVelocities(asNumpy=True)._value


def run(tolerance: float, ivp: ConstrainedIvp, h: float, times: Array, *, hint: bool = True) -> States:
    """Run RATTLE at a tolerance of its constraints; steps are taken within one call of C++ from output to output."""
    simulation = Simulation(ivp, rattle(h * unit(ivp)), tolerance, hint=hint)
    return stepped(simulation.integrator.step, simulation.read, h, times)


def run_leap_frog(tolerance: float, ivp: ConstrainedIvp, h: float, times: Array) -> States:
    """Run its VerletIntegrator: velocities start half a step back, and those at an output are the mean of the two beside it."""
    back, simulation = Simulation(ivp, rattle(h * unit(ivp)), tolerance), Simulation(ivp, verlet(h * unit(ivp)), tolerance)
    start, velocity = back.particles()
    back.context.setVelocities(-velocity)
    back.integrator.step(1)
    simulation.context.setVelocities((start - back.particles()[0]) / (h * unit(ivp)))
    ahead = 0

    def advance(steps: int) -> None:
        simulation.integrator.step(steps - ahead)

    def read() -> tuple[Array, Array, float]:
        nonlocal ahead
        r, before = simulation.particles()
        q = simulation.mapped(r, ANGSTROM)
        simulation.integrator.step(1)
        ahead = 1
        v = (before + simulation.particles()[1]) / 2
        return simulation.M @ simulation.mapped(v), q, float("nan")

    return stepped(advance, read, h, times)


def unit(ivp: ConstrainedIvp) -> float:
    """Return daebench's unit of time, ps."""
    return 1.0 if ivp.problem in MIRRORED else ANGSTROM


def contenders() -> list[Contender]:
    """Return RATTLE near round-off and as shipped, and leap-frog, on every motion that it can express."""
    steps = {"pendulum": halved(1 / 16, 9), "double": halved(1 / 32, 9), "chain10": halved(1 / 16, 8), "butane": halved(1 / 16, 9)}
    rows = []
    for motion, values in steps.items():
        rows.append(Contender("OpenMM", "RATTLE, tolerance 1e-12", motion, "h", values, partial(run, TIGHT)))
        rows.append(Contender("OpenMM", "RATTLE, tolerance 1e-5", motion, "h", values, partial(run, TOLERANCE)))
        rows.append(Contender("OpenMM", "leap-frog, tolerance 1e-12", motion, "h", values, partial(run_leap_frog, TIGHT)))
    plain = partial(run, TOLERANCE, hint=False)
    return [*rows, Contender("OpenMM", "RATTLE, tolerance 1e-5, no hint", "butane", "h", steps["butane"][:4], plain)]
