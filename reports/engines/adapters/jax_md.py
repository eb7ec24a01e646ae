"""jax-md: points tied by the constraints of its AMBER module, and the heavy top as one of its rigid bodies."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from daebench.reports.engines.contender import Array, Contender, States, halved, mass_matrix, stepped
from daebench.runs.ivp import ConstrainedIvp
from daebench.systems.lazily import jax, jax_md, jax_md_constraints, jnp

PACKAGE = "jax_md"

TIGHT = {"tolerance": 1e-12, "max_iters": 2000}
"""Tolerance and most iterations of its constraints; 1e-6 and 150 if left out."""


Points = tuple[Array, Array, Array, Array, list[tuple[int, int]], Callable[..., Any]]
"""Masses, positions, velocities, points that are held, pairs at fixed distances, and the potential."""


def doubles() -> None:
    """Let JAX compute in double precision, on the CPU."""
    jax.config.update("jax_enable_x64", True)


def molecule(ivp: ConstrainedIvp) -> Points:
    """Return masses, positions, velocities and constraints of butane, and its torsion's potential."""
    values, M = ivp.parameters, mass_matrix(ivp)
    bond, angle = values["bond"], np.radians(values["angle"])
    along, off = -bond * np.cos(angle), bond * np.sin(angle)
    C = [values[f"C{k}"] for k in range(6)]

    def potential(r: Any, **_: Any) -> Any:
        cosine = (jnp.sum((r[3] - r[0]) ** 2) - (bond + 2 * along) ** 2) / (2 * off**2) - 1
        return sum(c * cosine**k for k, c in enumerate(C))

    pairs = [(0, 1), (1, 2), (2, 3), (0, 2), (1, 3)]
    return np.diag(M)[::3], ivp.q0.reshape(-1, 3), np.linalg.solve(M, ivp.p0).reshape(-1, 3), np.zeros(0), pairs, potential


def hanging(ivp: ConstrainedIvp) -> Points:
    """Return the same of a pendulum or chain; its pivot is a point of mass 0, which its constraints leave where it is."""
    M, gravity = mass_matrix(ivp), ivp.parameters["gravity"]
    masses, v = np.diag(M)[::2], np.linalg.solve(M, ivp.p0).reshape(-1, 2)
    weights = jnp.asarray(np.append(0.0, masses) * gravity)
    pairs = [(k, k + 1) for k in range(len(masses))]
    return masses, ivp.q0.reshape(-1, 2), v, np.zeros((1, 2)), pairs, lambda r, **_: jnp.sum(weights * r[:, 1])


def run(kind: Callable[[ConstrainedIvp], Any], tolerance: dict[str, Any], ivp: ConstrainedIvp, h: float, times: Array) -> States:
    """Run velocity Verlet with its projections of positions and velocities, put together as OpenMM's documentation does.

    jax-md has the projections, and no integrator that calls them. All steps to an output are one call of compiled code.
    """
    doubles()
    masses, r, v, pivot, pairs, potential = kind(ivp)
    held = len(pivot)
    if held:
        masses, r, v = np.append(np.zeros(held), masses), np.concatenate([pivot, r]), np.concatenate([np.zeros_like(pivot), v])
    displacement, shift = jax_md.space.free()
    distances = [float(np.linalg.norm(r[j] - r[i])) for i, j in pairs]
    _, ties = jax_md_constraints.prepare_settle_ccma(np.array(pairs), np.array(distances), masses)
    m, force = jnp.asarray(masses), jax.grad(lambda x: -potential(x))
    inverse = jnp.where(m > 0, 1 / jnp.where(m > 0, m, 1.0), 0.0)[:, None]

    def step(dt: Any, state: Any) -> Any:
        x, u, a = state
        half = u + dt / 2 * a
        x1 = x + dt * half
        x2 = jax_md_constraints.ccma_apply_positions(x1, ties, m, displacement, shift, **tolerance)
        a2 = force(x2) * inverse
        u2 = half + (x2 - x1) / dt + dt / 2 * a2
        return x2, jax_md_constraints.ccma_apply_velocities(x2, u2, ties, m, displacement, **tolerance), a2

    state = [(jnp.asarray(r), jnp.asarray(v), force(jnp.asarray(r)) * inverse)]
    march = compiled((ivp.problem, ivp.case, ivp.par, ivp.d, *tolerance.values()), step)
    march(0, h, state[0])

    def advance(steps: int) -> None:
        state[0] = jax.block_until_ready(march(steps, h, state[0]))

    def read() -> tuple[Array, Array, float]:
        x, u = np.array(state[0][0]), np.array(state[0][1])
        energy = float(np.sum(masses[:, None] * u**2) / 2 + potential(jnp.asarray(x)))
        return np.repeat(masses[held:], x.shape[1]) * u[held:].ravel(), x[held:].ravel(), energy

    return stepped(advance, read, h, times)


def compiled(key: tuple[Any, ...], step: Callable[[Any, Any], Any]) -> Callable[[int, float, Any], Any]:
    """Return the loop over steps, which is compiled once for all step sizes."""
    if key not in _LOOPS:
        _LOOPS[key] = jax.jit(lambda steps, dt, start: jax.lax.fori_loop(0, steps, lambda _, state: step(dt, state), start))
    return _LOOPS[key]


_LOOPS: dict[tuple[Any, ...], Callable[[int, float, Any], Any]] = {}


def top(ivp: ConstrainedIvp) -> tuple[Any, Any, Callable[[int, float, Any], Any], Any]:
    """Return the heavy top as a rigid body, whose centre is the fixed point and whose energy depends on its attitude alone.

    These are its state at the start, its potential, the loop over steps of the NVE simulation, and the rotation of vectors by an attitude.
    """
    doubles()
    values = ivp.parameters
    moments = np.array([values[name] for name in ("I1", "I2", "I3")])
    r, weight = jnp.array([[values[name] for name in ("r1", "r2", "r3")]]), values["mass"] * values["gravity"]
    y = ivp.p0.reshape(3, 3) - ivp.p0.reshape(3, 3).T
    L = jnp.array([[y[2, 1], y[0, 2], y[1, 0]]])
    attitude = jax_md.rigid_body.Quaternion(jnp.array([[1.0, 0.0, 0.0, 0.0]]))
    body = jax_md.rigid_body.RigidBody(jnp.zeros((1, 3)), attitude)
    mass = jax_md.rigid_body.RigidBody(jnp.array([values["mass"]]), jnp.asarray(moments)[None])
    momenta = jax_md.rigid_body.RigidBody(jnp.zeros((1, 3)), jax_md.rigid_body.angular_momentum_to_conjugate_momentum(attitude, L))

    def potential(position: Any, **_: Any) -> Any:
        return weight * jax_md.rigid_body.quaternion_rotate(position.orientation, r)[0, 2]

    start, step = jax_md.simulate.nve(potential, jax_md.space.free()[1])
    state = start(jax.random.PRNGKey(0), body, kT=0.0, mass=mass, momenta=momenta)
    march = compiled((ivp.problem, ivp.case, ivp.par), lambda dt, now: step(now, dt=dt))
    axes = jnp.eye(3)[:, None, :]
    rotate = jax.jit(lambda turned: jnp.concatenate([jax_md.rigid_body.quaternion_rotate(turned, axis) for axis in axes]).T)
    return state, potential, march, rotate


_TOPS: dict[tuple[Any, ...], Any] = {}


def run_top(ivp: ConstrainedIvp, h: float, times: Array) -> States:
    """Run its NVE simulation of the heavy top."""
    doubles()
    key = (ivp.case, ivp.par)
    if key not in _TOPS:
        _TOPS[key] = top(ivp)
    first, potential, march, rotate = _TOPS[key]
    moments, state = np.array([ivp.parameters[name] for name in ("I1", "I2", "I3")]), [first]
    march(0, h, first)

    def advance(steps: int) -> None:
        state[0] = jax.block_until_ready(march(steps, h, state[0]))

    def read() -> tuple[Array, Array, float]:
        now = state[0].position.orientation
        Q = np.array(rotate(now))
        seen = np.array(jax_md.rigid_body.conjugate_momentum_to_angular_momentum(now, state[0].momentum.orientation))[0]
        wx, wy, wz = seen / moments
        hat = np.array([[0, -wz, wy], [wz, 0, -wx], [-wy, wx, 0]])
        energy = float(np.sum(seen**2 / moments) / 2 + potential(state[0].position))
        return (Q @ hat @ np.diag(moments.sum() / 2 - moments)).ravel(), Q.ravel(), energy

    return stepped(advance, read, h, times)


def contenders() -> list[Contender]:
    """Return its constraints near round-off and as shipped on points, and its rigid body."""
    steps = {"pendulum": halved(1 / 16, 9), "double": halved(1 / 32, 9), "chain10": halved(1 / 32, 6), "butane": halved(1 / 16, 9)}
    rows = []
    for motion, values in steps.items():
        kind = molecule if motion == "butane" else hanging
        rows.append(Contender("jax-md", "CCMA, tolerance 1e-12", motion, "h", values, partial(run, kind, TIGHT)))
        rows.append(Contender("jax-md", "CCMA, tolerance 1e-6", motion, "h", values, partial(run, kind, {})))
    return [*rows, Contender("jax-md", "rigid body, NVE", "top", "h", halved(1 / 256, 9), run_top, constrained=False)]
