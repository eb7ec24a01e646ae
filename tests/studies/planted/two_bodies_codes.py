"""Steps for two attracting points on the unit sphere, masses 1 and 3, strength 1; q = (r1, r2)."""

import numpy as np

m1, m2 = 1.0, 3.0
M = np.array([m1, m1, m1, m2, m2, m2])
MASS = np.array([[m1], [m2]])


def U_q(q):
    a, b = q[:3], q[3:]
    c = a @ b
    t = 1.0 / (np.sqrt(1 - c * c) * np.arccos(c) ** 2)
    return np.concatenate([-t * b, -t * a])


def forces(r):
    """Forces on both points, shape(2, 3)."""
    c = np.dot(r[0], r[1])
    f = 1.0 / (np.sqrt(1.0 - c**2) * np.arccos(c) ** 2)
    return f * r[::-1]


def g(q):
    return np.array([q[:3] @ q[:3] - 1, q[3:] @ q[3:] - 1])


def G(q):
    J = np.zeros((2, 6))
    J[0, :3] = 2 * q[:3]
    J[1, 3:] = 2 * q[3:]
    return J


def back_to_sphere(free, ref):
    """Factor c so that free - c ref has length 1, for each point."""
    b = np.sum(free * ref, axis=1, keepdims=True)
    return b - np.sqrt(b * b - np.sum(free * free, axis=1, keepdims=True) + 1.0)


def tangent(v, r):
    return v - np.sum(v * r, axis=1, keepdims=True) / np.sum(r * r, axis=1, keepdims=True) * r


# ---------------------------------------------------------------- correct


def correct_4(p, q, h):
    """The multipliers in closed form."""
    r = q.reshape(2, 3)
    v = p.reshape(2, 3) / MASS
    v = v + 0.5 * h * forces(r) / MASS
    free = r + h * v
    c = back_to_sphere(free, r)
    new = free - c * r
    v = v - c * r / h
    v = v + 0.5 * h * forces(new) / MASS
    v = tangent(v, new)
    return (MASS * v).ravel(), new.ravel()


class correct_5:
    """Keeps the force from step to step."""

    def __init__(self):
        self.f = None

    def step(self, p, q, h):
        if self.f is None:
            self.f = -U_q(q)
        p = p + 0.5 * h * self.f
        J0 = G(q)
        lam = np.zeros(2)
        for _ in range(50):
            x = q + h * (p - 0.5 * h * J0.T @ lam) / M
            res = g(x)
            if np.abs(res).max() < 1e-13:
                break
            lam = lam + np.linalg.solve(0.5 * h**2 * G(x) @ (J0 / M).T, res)
        p = p - 0.5 * h * J0.T @ lam
        self.f = -U_q(x)
        p = p + 0.5 * h * self.f
        J = G(x)
        mu = np.linalg.solve(J @ (J / M).T, J @ (p / M))
        return p - J.T @ mu, x


# ---------------------------------------------------------------- one mistake each


def reference_gradient_at_q1_2(p, q, h):
    """Points are put back by normalizing, and the velocity is what they did."""
    r = q.reshape(2, 3)
    v = p.reshape(2, 3) / MASS + h / 2 * forces(r) / MASS
    new = r + h * v
    new = new / np.linalg.norm(new, axis=1, keepdims=True)
    v = (new - r) / h
    v = tangent(v + h / 2 * forces(new) / MASS, new)
    return (MASS * v).ravel(), new.ravel()


def momentum_not_corrected_2(p, q, h):
    r = q.reshape(2, 3)
    v = p.reshape(2, 3) / MASS
    v = v + 0.5 * h * forces(r) / MASS
    free = r + h * v
    new = free - back_to_sphere(free, r) * r
    v = v + 0.5 * h * forces(new) / MASS
    v = tangent(v, new)
    return (MASS * v).ravel(), new.ravel()


def full_kick_2(p, q, h):
    """The second kick is over h."""
    r = q.reshape(2, 3)
    mom = p.reshape(2, 3) + h / 2 * forces(r)
    free = r + h * mom / MASS
    c = back_to_sphere(free, r)
    new = free - c * r
    mom = mom - MASS * c * r / h
    mom = tangent(mom + h * forces(new), new)
    return mom.ravel(), new.ravel()


def old_force_1(p, q, h):
    """Both kicks with the force of the beginning."""
    r = q.reshape(2, 3)
    f = forces(r)
    v = p.reshape(2, 3) / MASS
    v = v + 0.5 * h * f / MASS
    free = r + h * v
    c = back_to_sphere(free, r)
    new = free - c * r
    v = v - c * r / h
    v = v + 0.5 * h * f / MASS
    return (MASS * tangent(v, new)).ravel(), new.ravel()


class old_force_2:
    """Keeps the force, and renews it before the move instead of after it."""

    def __init__(self):
        self.f = None

    def step(self, p, q, h):
        if self.f is None:
            self.f = -U_q(q)
        p = p + 0.5 * h * self.f
        self.f = -U_q(q)
        J0 = G(q)
        lam = np.zeros(2)
        for _ in range(50):
            x = q + h * (p - 0.5 * h * J0.T @ lam) / M
            res = g(x)
            if np.abs(res).max() < 1e-14:
                break
            lam = lam + np.linalg.solve(0.5 * h**2 * G(x) @ (J0 / M).T, res)
        p = p - 0.5 * h * J0.T @ lam
        p = p + 0.5 * h * self.f
        J = G(x)
        mu = np.linalg.solve(J @ (J / M).T, J @ (p / M))
        return p - J.T @ mu, x


def one_sweep_2(p, q, h):
    """One Newton step for the multipliers, from 0."""
    J0 = G(q)
    p = p - 0.5 * h * U_q(q)
    x = q + h * p / M
    lam = np.linalg.solve(0.5 * h**2 * G(x) @ (J0 / M).T, g(x))
    p = p - 0.5 * h * J0.T @ lam
    x = q + h * p / M
    p = p - 0.5 * h * U_q(x)
    J = G(x)
    return p - J.T @ np.linalg.solve(J @ (J / M).T, J @ (p / M)), x


def velocity_for_momentum_2(p, q, h):
    """Gives velocities back."""
    r = q.reshape(2, 3)
    v = p.reshape(2, 3) / MASS
    v = v + 0.5 * h * forces(r) / MASS
    free = r + h * v
    c = back_to_sphere(free, r)
    new = free - c * r
    v = v - c * r / h
    v = v + 0.5 * h * forces(new) / MASS
    v = tangent(v, new)
    return v.ravel(), new.ravel()


def multiplier_sign_2(p, q, h):
    """The velocity gets +c r/h."""
    r = q.reshape(2, 3)
    v = p.reshape(2, 3) / MASS
    v = v + 0.5 * h * forces(r) / MASS
    free = r + h * v
    c = back_to_sphere(free, r)
    new = free - c * r
    v = v + c * r / h
    v = v + 0.5 * h * forces(new) / MASS
    v = tangent(v, new)
    return (MASS * v).ravel(), new.ravel()


def velocity_not_projected_2(p, q, h):
    r = q.reshape(2, 3)
    v = p.reshape(2, 3) / MASS
    v = v + 0.5 * h * forces(r) / MASS
    free = r + h * v
    c = back_to_sphere(free, r)
    new = free - c * r
    v = (new - r) / h
    v = v + 0.5 * h * forces(new) / MASS
    return (MASS * v).ravel(), new.ravel()


def reduced(r, v):
    """Acceleration tangential to the sphere, and centripetal."""
    a = forces(r) / MASS
    s = np.sum(r * r, axis=1, keepdims=True)
    return a - (np.sum(a * r, axis=1, keepdims=True) + np.sum(v * v, axis=1, keepdims=True)) / s * r


def index_reduced_2(p, q, h):
    """Leapfrog: drift, kick, drift."""
    r = q.reshape(2, 3)
    v = p.reshape(2, 3) / MASS
    r = r + 0.5 * h * v
    v = v + h * reduced(r, v)
    r = r + 0.5 * h * v
    return (MASS * v).ravel(), r.ravel()


def projected_after_3(p, q, h):
    """Heun's second-order step of the reduced equations, then back onto the sphere."""
    r = q.reshape(2, 3)
    v = p.reshape(2, 3) / MASS
    a = reduced(r, v)
    r2, v2 = r + h * v, v + h * a
    r, v = r + h / 2 * (v + v2), v + h / 2 * (a + reduced(r2, v2))
    r = r / np.sqrt((r * r).sum(axis=1, keepdims=True))
    v = tangent(v, r)
    return (MASS * v).ravel(), r.ravel()


def baumgarte_2(p, q, h, alpha=5.0, beta=30.0):
    """Explicit midpoint with feedback."""

    def rhs(x, p):
        J = G(x)
        v = p / M
        lam = np.linalg.solve(
            J @ (J / M).T,
            -J @ (U_q(x) / M) + 2 * np.array([v[:3] @ v[:3], v[3:] @ v[3:]]) + 2 * alpha * J @ v + beta**2 * g(x),
        )
        return v, -U_q(x) - J.T @ lam

    v, f = rhs(q, p)
    v, f = rhs(q + h / 2 * v, p + h / 2 * f)
    return p + h * f, q + h * v


class step_off_by_one_2:
    """Gives back the state it had, and keeps the new one."""

    def __init__(self):
        self.state = None

    def step(self, p, q, h):
        if self.state is None:
            self.state = p.copy(), q.copy()
        given = self.state
        self.state = correct_4(given[0], given[1], h)
        return given


# ---------------------------------------------------------------- others


def other_3(p, q, h):
    """The points repel each other."""
    r = q.reshape(2, 3)
    v = p.reshape(2, 3) / MASS
    v = v - 0.5 * h * forces(r) / MASS
    free = r + h * v
    c = back_to_sphere(free, r)
    new = free - c * r
    v = v - c * r / h
    v = v - 0.5 * h * forces(new) / MASS
    v = tangent(v, new)
    return (MASS * v).ravel(), new.ravel()
