"""Solutions of the swept problems that owe nothing to the package: equations of motion written out by hand, integrated by SciPy."""

from functools import cache

import numpy as np
import pytest
import uncompiled
from ivps import CATALOGUE, ivp
from scipy.integrate import solve_ivp

from daebench.methods.solvers.scipy_ode import ScipyOde
from daebench.runs.request import Request

E2 = np.array([0.0, 1.0])


def _integrate(f, x0, t):
    found = solve_ivp(f, (0, t), np.asarray(x0, dtype=float), method="DOP853", rtol=1e-13, atol=1e-14)
    assert found.success
    return found.y[:, -1]


def pendulum(q0, v0, t, up):
    """Unit pendulum in Cartesian coordinates: v' = -up - lam q, lam from q.q'' = -v.v."""
    d = len(q0)

    def f(_, x):
        q, v = x[:d], x[d:]
        return np.concatenate([v, -up - q * (v @ v - up @ q) / (q @ q)])

    x = _integrate(f, np.concatenate([q0, v0]), t)
    return x[:d], x[d:]


def tied(M, force, q0, v0, t):
    """Two rods in the plane, first end at the origin, constant mass matrix M on (x1, y1, x2, y2)."""

    def f(_, x):
        q, v = x[:4], x[4:]
        d, w = q[2:] - q[:2], v[2:] - v[:2]
        G = np.array([[*q[:2], 0, 0], [*-d, *d]])
        hidden = np.array([v[:2] @ v[:2], w @ w])
        K = np.block([[M, G.T], [G, np.zeros((2, 2))]])
        return np.concatenate([v, np.linalg.solve(K, np.concatenate([force, -hidden]))[:4]])

    x = _integrate(f, np.concatenate([q0, v0]), t)
    return x[:4], x[4:]


def fast_pair(q0, p0, t):
    """The relativistic pair: p' = -U_q - G^T lam with lam from d/dt (r . r') = 0, r the vector between the two."""
    m2 = np.array([1.0, 1.0, 4.0, 4.0])

    def velocity(p):
        e = np.sqrt(m2 + np.repeat([p[:2] @ p[:2], p[2:] @ p[2:]], 2))
        return p / e, e

    def f(_, x):
        q, p = x[:4], x[4:]
        v, e = velocity(p)
        r = q[:2] - q[2:]
        G = 2 * np.array([*r, *-r])
        U_q = np.array([0, 0.5, 2 * q[2] / 3, 0])

        def acceleration(force):
            along = np.repeat([v[:2] @ force[:2], v[2:] @ force[2:]], 2)
            return (force - v * along) / e

        w = v[:2] - v[2:]
        free, per_lam = acceleration(-U_q), acceleration(-G)
        lam = -(2 * w @ w + G @ free) / (G @ per_lam)
        return np.concatenate([v, -U_q - lam * G])

    x = _integrate(f, np.concatenate([q0, p0]), t)
    return x[:4], x[4:]


@cache
def solution(name, t):
    """Return (q, p) of a swept problem at time t.

    A problem of the catalogue for which no equations are written out here is integrated on the index-reduced equation, which has
    tests of its own and shares nothing with the schemes but the problem's derivatives.
    """
    q0, p0 = ivp(name).q0, ivp(name).p0
    if name in CATALOGUE:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("daebench.methods.formulations.constrained._module", uncompiled.kept_module)
            run = ScipyOde("DOP853").solve(ivp(name), Request(value=1e-13, t_end=t)).complete()
        return run.q[-1], run.p[-1]
    if name.startswith("spherical") or name == "planar":
        return pendulum(q0, p0, t, np.eye(len(q0))[-1])
    if name.startswith("stretched"):
        return _stretched(q0, p0, t)
    if name == "relativistic":
        return fast_pair(q0, p0, t)
    M = np.diag([1.0, 1.0, 2.0, 2.0]) if name == "double-pendulum" else np.kron([[2 / 3, 1 / 6], [1 / 6, 1 / 3]], np.eye(2))
    force = -np.array([0, 1.0, 0, 2.0]) if name == "double-pendulum" else -np.array([0, 1.0, 0, 0.5])
    q, v = tied(M, force, q0, np.linalg.solve(M, p0), t)
    return q, M @ v


def _stretched(q0, p0, t):
    """The planar pendulum through its lowest point, carried over to the stretched coordinates by Newton's iteration."""

    def place(x):
        return np.array([x[0] + 0.2 * x[1] ** 2, x[1] + 0.2 * np.sin(x[0])])

    def jacobian(x):
        return np.array([[1, 0.4 * x[1]], [0.2 * np.cos(x[0]), 1]])

    y, v = pendulum(np.array([0.0, -1.0]), np.array([1.0, 0.0]), t, E2)
    x = np.array(q0)
    for _ in range(30):
        x = x - np.linalg.solve(jacobian(x), place(x) - y)
    return x, jacobian(x).T @ v
