"""Systems with constraints on velocities: definitions, their motions by DOP853 from equations by hand, and steps of schemes in NumPy."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import sympy as sp
from scipy.integrate import solve_ivp
from scipy.optimize import root

from daebench.compiler.definition import source_of
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.make_ivp import make_ivp
from daebench.systems.constrained import Case, ConstrainedHamiltonian

MASSES = np.array([1.0, 1.3, 0.8])
BEAD = np.array([1.0, 1.2, 0.9, 0.7])


def particle():
    """Return a particle with z' = y x' in a potential that is not quadratic, with three masses."""
    q, p, v = sp.symbols("x y z", real=True), sp.symbols("p_x p_y p_z", real=True), sp.symbols("v_x v_y v_z", real=True)
    U = (q[0] ** 2 + q[1] ** 2 + q[2] ** 2) / 2 + q[0] ** 2 * q[2] ** 2 / 4 + sp.cos(q[1])
    start = Case(q=(1, sp.Rational(1, 2), 0), p=(sp.Rational(1, 5), 1, sp.Rational(2, 25)), about="from (1, 1/2, 0)")
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        v=v,
        M=sp.diag(1, sp.Rational(13, 10), sp.Rational(4, 5)),
        U=U,
        g=[],
        velocity=[v[2] - q[1] * v[0]],
        cases={"turning": start},
    )


def heavier():
    """Return the particle with a mass along x that grows with y, given by its H."""
    of = particle()
    x, y, z = of.q
    H = of.p[0] ** 2 / (2 + y**2) + of.p[1] ** 2 / 2 + of.p[2] ** 2 / 2 + (x**2 + y**2 + z**2) / 2
    start = Case(q=(1, sp.Rational(1, 2), 0), p=(sp.Rational(9, 16), 1, sp.Rational(1, 4)), about="from (1, 1/2, 0)")
    return ConstrainedHamiltonian(q=of.q, p=of.p, v=of.v, H=H, g=[], velocity=of.velocity, cases={"turning": start})


def bead():
    """Return a point on a sphere and a fourth position w with w' = x y': a constraint on positions and one on velocities."""
    q, p, v = sp.symbols("x y z w", real=True), sp.symbols("p_x p_y p_z p_w", real=True), sp.symbols("v_x v_y v_z v_w", real=True)
    start = Case(q=(sp.Rational(3, 5), 0, sp.Rational(-4, 5), 0), p=(0, sp.Rational(6, 5), 0, sp.Rational(21, 50)), about="around the axis")
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        v=v,
        M=sp.diag(1, sp.Rational(6, 5), sp.Rational(9, 10), sp.Rational(7, 10)),
        U=q[2] + q[3] ** 2 / 2,
        g=[q[0] ** 2 + q[1] ** 2 + q[2] ** 2 - 1],
        velocity=[v[3] - q[0] * v[1]],
        cases={"around": start},
    )


def heavier_bead():
    """Return the point on a sphere with unit masses, but for a mass 1 + z^2/2 along w, given by its H."""
    of = bead()
    (_, _, z, w), p = of.q, of.p
    H = (p[0] ** 2 + p[1] ** 2 + p[2] ** 2) / 2 + p[3] ** 2 / (2 + z**2) + z + w**2 / 2
    start = Case(q=of.cases["around"].q, p=(0, 1, 0, sp.Rational(99, 125)), about="around the axis")
    return ConstrainedHamiltonian(q=of.q, p=p, v=of.v, H=H, g=of.g, velocity=of.velocity, cases={"around": start})


def driven():
    """Return the particle with z' = y x' + sin(t)/2, on a surface that lifts it: a constraint that is affine in the velocities."""
    of, t = particle(), sp.Symbol("t", real=True)
    start = {"turning": Case(q=of.cases["turning"].q, p=of.cases["turning"].p, about="from (1, 1/2, 0)")}
    rows = [of.v[2] - of.q[1] * of.v[0] - sp.sin(t) / 2]
    return ConstrainedHamiltonian(q=of.q, p=of.p, v=of.v, M=of.M, U=of.U, t=t, g=[], velocity=rows, cases=start)


DEFINITIONS = {"particle": particle, "heavier": heavier, "bead": bead, "heavier_bead": heavier_bead, "driven": driven}


@cache
def ivp(name):
    """Return one of the initial value problems, or the knife edge of the catalogue."""
    if name == "knife_edge":
        return initial_value_problem(name)
    problem = DEFINITIONS[name]()
    return make_ivp(source_of(problem, name), next(iter(problem.cases)))


def force(q):
    """Return -U_q of the particle."""
    x, y, z = q
    return -np.array([x + x * z**2 / 2, y - np.sin(y), z + x**2 * z / 2])


def of_particle(t, state, lift=0.0):
    """Return q' and p' of the particle: lam from z'' = y x'' + x' y' + lift cos(t)."""
    q, p = state[:3], state[3:]
    v, F, A = p / MASSES, force(q), np.array([-q[1], 0, 1])
    lam = (A @ (F / MASSES) - v[0] * v[1] - lift * np.cos(t)) / (A @ (A / MASSES))
    return np.concatenate([v, F - A * lam])


def of_heavier(t, state):
    """Return q' and p' of the particle with a mass 1 + y^2/2 along x."""
    q, p = state[:3], state[3:]
    y, m = q[1], 1 + q[1] ** 2 / 2
    v, A = p / np.array([m, 1, 1]), np.array([-q[1], 0, 1])
    F = -np.array([q[0], y - p[0] ** 2 * y / (2 * m**2), q[2]])
    # z'' = y x'' + x' y' with x'' = (p_x' - m' x')/m and m' = y y'
    rest = F[2] - y * (F[0] - y * v[1] * v[0]) / m - v[0] * v[1]
    return np.concatenate([v, F - A * rest / (1 + y**2 / m)])


def of_bead(t, state):
    """Return q' and p' of the bead: both multipliers from the second derivatives of |r|^2 = 1 and from w'' = x y'' + x' y'."""
    q, p = state[:4], state[4:]
    v, F = p / BEAD, -np.array([0, 0, 1, q[3]])
    G = np.array([[2 * q[0], 2 * q[1], 2 * q[2], 0], [0, -q[0], 0, 1]])
    turn = np.array([2 * (v[:3] @ v[:3]), -v[0] * v[1]])
    lam = np.linalg.solve(G @ (G / BEAD).T, G @ (F / BEAD) + turn)
    return np.concatenate([v, F - G.T @ lam])


def of_heavier_bead(t, state):
    """Return q' and p' of the bead with a mass 1 + z^2/2 along w: w'' = (p_w' - z z' w') / m."""
    q, p = state[:4], state[4:]
    m = 1 + q[2] ** 2 / 2
    M = np.array([1, 1, 1, m])
    v, F = p / M, -np.array([0, 0, 1 - p[3] ** 2 * q[2] / (2 * m**2), q[3]])
    G = np.array([[2 * q[0], 2 * q[1], 2 * q[2], 0], [0, -q[0], 0, 1]])
    turn = np.array([2 * (v[:3] @ v[:3]), -v[0] * v[1] - q[2] * v[2] * v[3] / m])
    lam = np.linalg.solve(G @ (G / M).T, G @ (F / M) + turn)
    return np.concatenate([v, F - G.T @ lam])


def of_knife_edge(t, state):
    """Return q' and p' of the knife edge: the speed u along the edge grows by g cos(phi)/sqrt(2), and p = m u (cos phi, sin phi)."""
    phi, m, spin = state[2], 1.25, state[5] / 0.13
    u = (state[3] * np.cos(phi) + state[4] * np.sin(phi)) / m
    rate = 9.81 / np.sqrt(2) * np.cos(phi)
    along, across = np.array([np.cos(phi), np.sin(phi)]), np.array([-np.sin(phi), np.cos(phi)])
    return np.concatenate([u * along, [spin], m * (rate * along + u * spin * across), [0.0]])


MOTIONS = {
    "particle": of_particle,
    "heavier": of_heavier,
    "bead": of_bead,
    "heavier_bead": of_heavier_bead,
    "knife_edge": of_knife_edge,
    "driven": lambda t, state: of_particle(t, state, 0.5),
}


@cache
def exact(name, T):
    """Return q and p at T by DOP853, with errors far below 1e-10."""
    where = ivp(name)
    d = {"driven": 3}.get(name, where.d)
    start = np.concatenate([where.q0[:d], where.p0[:d]])
    end = solve_ivp(MOTIONS[name], (0, T), start, method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    return end[:d], end[d:]


# ---- steps, written out ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Body:
    """A system in NumPy with a constant diagonal mass: -U_q, g, the rows of g and of A, and the derivative of A v along v."""

    M: Any
    F: Any
    g: Any
    J: Any
    A: Any
    turn: Any

    def G(self, q):
        return np.vstack([self.J(q), self.A(q)])

    def lam(self, p, q):
        """Return the multipliers of the motion itself."""
        G = self.G(q)
        return np.linalg.solve(G @ (G / self.M).T, G @ (self.F(q) / self.M) + self.turn(q, p / self.M))


BODIES = {
    "particle": Body(
        M=MASSES,
        F=force,
        g=lambda q: np.zeros(0),
        J=lambda q: np.zeros((0, 3)),
        A=lambda q: np.array([[-q[1], 0, 1]]),
        turn=lambda q, v: np.array([-v[0] * v[1]]),
    ),
    "bead": Body(
        M=BEAD,
        F=lambda q: -np.array([0, 0, 1, q[3]]),
        g=lambda q: np.array([q[:3] @ q[:3] - 1]),
        J=lambda q: np.array([[2 * q[0], 2 * q[1], 2 * q[2], 0]]),
        A=lambda q: np.array([[0, -q[0], 0, 1]]),
        turn=lambda q, v: np.array([2 * (v[:3] @ v[:3]), -v[0] * v[1]]),
    ),
}


def solved(residual, guess):
    """Return the solution of a system of equations by MINPACK, to round-off."""
    found = root(residual, guess, tol=1e-15)
    assert np.abs(residual(found.x)).max() < 1e-13, found
    return found.x


def settled(body, p, q):
    """Return p - G^T mu with G M^-1 p = 0, and mu."""
    G = body.G(q)
    mu = np.linalg.solve(G @ (G / body.M).T, G @ (p / body.M))
    return p - G.T @ mu, mu


def dla(body, p0, q0, h, memory):
    d, m = len(q0), len(body.G(q0))

    def equations(x):
        p, q1, lam = x[:d], x[d : 2 * d], x[2 * d :]
        middle = (q0 + q1) / 2
        return np.concatenate(
            [
                p - p0 - h / 2 * (body.F(middle) - body.G(q0).T @ lam),
                q1 - q0 - h * p / body.M,
                body.g(q1),
                body.A(middle) @ (q1 - q0),
            ]
        )

    x = solved(equations, np.concatenate([p0, q0 + h * p0 / body.M, np.zeros(m)]))
    p, q1 = x[:d], x[d : 2 * d]
    return settled(body, p + h / 2 * body.F((q0 + q1) / 2), q1)[0], q1, None


def nonholonomic_leapfrog(body, p0, q0, h, memory):
    half = q0 + h / 2 * p0 / body.M

    def equations(lam):
        p1 = p0 + h * (body.F(half) - body.G(half).T @ lam)
        return body.G(half + h / 2 * p1 / body.M) @ (p1 / body.M)

    p1 = p0 + h * (body.F(half) - body.G(half).T @ solved(equations, np.zeros(len(body.G(q0)))))
    return p1, half + h / 2 * p1 / body.M, None


def gni(body, p0, q0, h, memory):
    """One step of a recursion in velocities: A(q1) (v1 + v2) = 0 is what the momentum and the force in common say together."""
    own = len(body.g(q0))
    lam0 = body.lam(p0, q0)[own:] if memory is None else memory

    def moved(nu):
        p = p0 + h / 2 * (body.F(q0) - body.A(q0).T @ lam0 - body.J(q0).T @ nu)
        return p, q0 + h * p / body.M

    p, q1 = moved(solved(lambda nu: body.g(moved(nu)[1]), np.zeros(own)) if own else np.zeros(0))
    p1, mu = settled(body, p + h / 2 * body.F(q1), q1)
    return p1, q1, 2 / h * mu[own:]


def nonholonomic_newmark(body, p0, q0, h, memory, beta=0.25):
    d = len(q0)
    k0 = body.F(q0) - body.G(q0).T @ body.lam(p0, q0)

    def ends(x):
        q1, mu = x[:d], x[d:]
        k1 = body.F(q1) - body.G(q1).T @ mu
        return p0 + h / 2 * (k0 + k1), q0 + h * (p0 + h / 2 * ((1 - 2 * beta) * k0 + 2 * beta * k1)) / body.M

    def equations(x):
        p1, q1 = ends(x)
        return np.concatenate([q1 - x[:d], body.G(x[:d]) @ (p1 / body.M)])

    x = solved(equations, np.concatenate([q0 + h * p0 / body.M, body.lam(p0, q0)]))
    return *ends(x), None


STEPS = {
    "dla": dla,
    "nonholonomic_leapfrog": nonholonomic_leapfrog,
    "gni": gni,
    "nonholonomic_newmark": nonholonomic_newmark,
}
