"""Steps for spring_pendulum.py: bead 1 on the wire y = x^4/4 + x^2/2, mass 2.5 on a rod, two springs, gravity."""

import numpy as np

M = np.array([1.0, 1.0, 2.5, 2.5])
W = 1 / M


def U_q(q):
    x1, y1, x2, y2 = q
    dx, dy = x2 - 2.0, y2
    d = np.sqrt(dx * dx + dy * dy)
    s = 20.0 * (d - 0.5) / d
    return np.array([8.0 * x1, 8.0 * (y1 - 1.0) + 9.81, s * dx, s * dy + 2.5 * 9.81])


def g(q):
    x1, y1, x2, y2 = q
    return np.array([y1 - x1**4 / 4 - x1**2 / 2, (x2 - x1) ** 2 + (y2 - y1) ** 2 - 1.0])


def G(q):
    x1, y1, x2, y2 = q
    dx, dy = x2 - x1, y2 - y1
    return np.array([[-(x1**3) - x1, 1.0, 0.0, 0.0], [-2 * dx, -2 * dy, 2 * dx, 2 * dy]])


def curvature(q, v):
    """g_qq(v, v)."""
    dv = v[2:] - v[:2]
    return np.array([-(3 * q[0] ** 2 + 1) * v[0] ** 2, 2 * dv @ dv])


def tangential(p, q):
    J = G(q)
    A = (J * W) @ J.T
    return p - J.T @ np.linalg.solve(A, J @ (W * p))


# ---------------------------------------------------------------- correct


def correct_12(p, q, h):
    """Newton with the Jacobian of both ends until increments are small."""
    J0 = G(q)
    base = p - h / 2 * U_q(q)
    lam = np.zeros(2)
    for _ in range(40):
        x = q + h * W * (base - J0.T @ lam)
        d = np.linalg.solve(h * (G(x) * W) @ J0.T, g(x))
        lam = lam + d
        if np.abs(d).max() < 1e-13:
            break
    p = base - J0.T @ lam
    x = q + h * W * p
    return tangential(p - h / 2 * U_q(x), x), x


def correct_13(p, q, h):
    """SHAKE for the positions, velocity from what they did, kick, projection."""
    v = p / M - h / 2 * U_q(q) / M
    x = q + h * v
    normals = G(q)
    for _ in range(300):
        error = 0.0
        for k in range(2):
            r = g(x)[k]
            error = max(error, abs(r))
            n = normals[k] / M
            x = x - n * r / (G(x)[k] @ n)
        if error < 1e-14:
            break
    v = (x - q) / h - h / 2 * U_q(x) / M
    J = G(x)
    for _ in range(1000):
        error = 0.0
        for k in range(2):
            r = J[k] @ v
            error = max(error, abs(r))
            v = v - J[k] / M * r / (J[k] @ (J[k] / M))
        if error < 1e-14:
            break
    return M * v, x


class correct_14:
    """Keeps force and multipliers."""

    tolerance = 1e-12

    def __init__(self):
        self.grad = None
        self.lam = np.zeros(2)

    def positions(self, q, p, h):
        J0 = G(q)
        while True:
            ph = p - h / 2 * J0.T @ self.lam
            x = q + h * ph / M
            r = g(x)
            if max(abs(r)) < self.tolerance:
                return ph, x
            self.lam = self.lam + np.linalg.solve(h * h / 2 * G(x) @ (J0 / M).T, r)

    def step(self, p, q, h):
        if self.grad is None:
            self.grad = U_q(q)
        p, x = self.positions(q, p - h / 2 * self.grad, h)
        self.grad = U_q(x)
        return tangential(p - h / 2 * self.grad, x), x


# ---------------------------------------------------------------- one mistake each


def reference_gradient_at_q1_4(p, q, h):
    """Implicit in the normal: Newton on x, with differences for the Jacobian."""
    base = p - h / 2 * U_q(q)

    def F(z):
        x, lam = z[:4], z[4:]
        return np.concatenate([M * (x - q) / h - base + h / 2 * G(x).T @ lam, g(x)])

    z = np.concatenate([q + h * base / M, np.zeros(2)])
    for _ in range(60):
        f = F(z)
        K = np.empty((6, 6))
        for k in range(6):
            e = np.zeros(6)
            e[k] = 1e-7
            K[:, k] = (F(z + e) - F(z - e)) / 2e-7
        d = np.linalg.solve(K, f)
        z = z - d
        if np.abs(d[:4]).max() < 1e-15:
            break
    x = z[:4]
    p_half = M * (x - q) / h
    return tangential(p_half - h / 2 * U_q(x), x), x


def reference_gradient_each_sweep_4(p, q, h):
    p = p - h / 2 * U_q(q)
    x = q + h * W * p
    for _ in range(50):
        J = G(x)
        dl = np.linalg.solve((J * W) @ J.T, g(x))
        x = x - W * (J.T @ dl)
        p = p - J.T @ dl / h
        if np.abs(g(x)).max() < 1e-14:
            break
    return tangential(p - h / 2 * U_q(x), x), x


def momentum_not_corrected_4(p, q, h):
    J0 = G(q)
    p = p - h / 2 * U_q(q)
    x = q + h * W * p
    for _ in range(50):
        if np.abs(g(x)).max() < 1e-14:
            break
        x = x - W * (J0.T @ np.linalg.solve((G(x) * W) @ J0.T, g(x)))
    return tangential(p - h / 2 * U_q(x), x), x


def velocity_not_projected_5(p, q, h):
    J0 = G(q)
    p = p - h / 2 * U_q(q)
    x = q + h * W * p
    for _ in range(50):
        if np.abs(g(x)).max() < 1e-14:
            break
        dl = np.linalg.solve((G(x) * W) @ J0.T, g(x))
        x = x - W * (J0.T @ dl)
        p = p - J0.T @ dl / h
    return p - h / 2 * U_q(x), x


def full_kick_4(p, q, h):
    """Both kicks are over h."""
    J0 = G(q)
    p = p - h * U_q(q)
    x = q + h * W * p
    for _ in range(50):
        if np.abs(g(x)).max() < 1e-14:
            break
        dl = np.linalg.solve((G(x) * W) @ J0.T, g(x))
        x = x - W * (J0.T @ dl)
        p = p - J0.T @ dl / h
    return tangential(p - h * U_q(x), x), x


class old_force_4:
    """The force is found at the first step, and never again."""

    def __init__(self):
        self.grad = None

    def step(self, p, q, h):
        if self.grad is None:
            self.grad = U_q(q)
        J0 = G(q)
        p = p - h / 2 * self.grad
        lam = np.zeros(2)
        for _ in range(50):
            x = q + h * W * (p - J0.T @ lam)
            if np.abs(g(x)).max() < 1e-14:
                break
            lam = lam + np.linalg.solve(h * (G(x) * W) @ J0.T, g(x))
        p = tangential(p - J0.T @ lam - h / 2 * self.grad, x)
        return p, x


def old_force_5(p, q, h):
    J0 = G(q)
    grad = U_q(q)
    p = p - h / 2 * grad
    x = q + h * W * p
    for _ in range(50):
        if np.abs(g(x)).max() < 1e-14:
            break
        dl = np.linalg.solve((G(x) * W) @ J0.T, g(x))
        x = x - W * (J0.T @ dl)
        p = p - J0.T @ dl / h
    return tangential(p - h / 2 * grad, x), x


def one_sweep_5(p, q, h):
    """One pass over both constraints for the positions."""
    J0 = G(q)
    v = (p - h / 2 * U_q(q)) / M
    x = q + h * v
    for k in range(2):
        n = J0[k] / M
        move = n * g(x)[k] / (G(x)[k] @ n)
        x = x - move
        v = v - move / h
    return tangential(M * v - h / 2 * U_q(x), x), x


def loose_tolerance_5(p, q, h):
    """Sweeps until |g| < 1e-3."""
    J0 = G(q)
    v = (p - h / 2 * U_q(q)) / M
    x = q + h * v
    while np.abs(g(x)).max() > 1e-3:
        for k in range(2):
            n = J0[k] / M
            move = n * g(x)[k] / (G(x)[k] @ n)
            x = x - move
            v = v - move / h
    return tangential(M * v - h / 2 * U_q(x), x), x


def mass_missing_in_position_4(p, q, h):
    """lam solves g = 0 with a position correction that has no M^-1; the momenta get the force G^T lam."""
    J0 = G(q)
    free = q + h * (p - h / 2 * U_q(q)) / M
    lam = np.zeros(2)
    for _ in range(50):
        x = free - h * h / 2 * J0.T @ lam
        if np.abs(g(x)).max() < 1e-14:
            break
        lam = lam + np.linalg.solve(h * h / 2 * G(x) @ J0.T, g(x))
    p = p - h / 2 * (U_q(q) + J0.T @ lam)
    return tangential(p - h / 2 * U_q(x), x), x


def mass_missing_in_position_5(p, q, h):
    """The same in velocities: position and velocity are moved along the normals themselves."""
    J0 = G(q)
    v = (p - h / 2 * U_q(q)) / M
    x = q + h * v
    for _ in range(50):
        if np.abs(g(x)).max() < 1e-14:
            break
        move = J0.T @ np.linalg.solve(G(x) @ J0.T, g(x))
        x = x - move
        v = v - move / h
    return tangential(M * v - h / 2 * U_q(x), x), x


def mass_missing_in_velocity_3(p, q, h):
    """The momentum is projected as if it were the velocity: G p = 0."""
    J0 = G(q)
    p = p - h / 2 * U_q(q)
    x = q + h * W * p
    for _ in range(50):
        if np.abs(g(x)).max() < 1e-14:
            break
        dl = np.linalg.solve((G(x) * W) @ J0.T, g(x))
        x = x - W * (J0.T @ dl)
        p = p - J0.T @ dl / h
    p = p - h / 2 * U_q(x)
    J = G(x)
    return p - J.T @ np.linalg.solve(J @ J.T, J @ p), x


def mass_missing_in_velocity_4(p, q, h):
    """v is projected along the normals themselves."""
    J0 = G(q)
    v = (p - h / 2 * U_q(q)) / M
    x = q + h * v
    for _ in range(50):
        if np.abs(g(x)).max() < 1e-14:
            break
        move = W * (J0.T @ np.linalg.solve((G(x) * W) @ J0.T, g(x)))
        x = x - move
        v = v - move / h
    v = v - h / 2 * U_q(x) / M
    J = G(x)
    v = v - np.linalg.pinv(J) @ (J @ v)
    return M * v, x


def multiplier_sign_4(p, q, h):
    """The impulse of lam is added to the momenta."""
    J0 = G(q)
    p = p - h / 2 * U_q(q)
    lam = np.zeros(2)
    for _ in range(50):
        x = q + h * W * (p - J0.T @ lam)
        if np.abs(g(x)).max() < 1e-14:
            break
        lam = lam + np.linalg.solve(h * (G(x) * W) @ J0.T, g(x))
    p = p + J0.T @ lam - h / 2 * U_q(x)
    return tangential(p, x), x


def multiplier_half_4(p, q, h):
    """h where h/2 is due, for G^T lam in the momenta only."""
    J0 = G(q)
    lam = np.zeros(2)
    for _ in range(50):
        x = q + h * W * (p - h / 2 * (U_q(q) + J0.T @ lam))
        if np.abs(g(x)).max() < 1e-14:
            break
        lam = lam + np.linalg.solve(h * h / 2 * (G(x) * W) @ J0.T, g(x))
    p_half = p - h / 2 * U_q(q) - h * J0.T @ lam
    return tangential(p_half - h / 2 * U_q(x), x), x


def multiplier_half_5(p, q, h):
    """Twice the multiplier in the velocity projection."""
    J0 = G(q)
    p = p - h / 2 * U_q(q)
    x = q + h * W * p
    for _ in range(50):
        if np.abs(g(x)).max() < 1e-14:
            break
        dl = np.linalg.solve((G(x) * W) @ J0.T, g(x))
        x = x - W * (J0.T @ dl)
        p = p - J0.T @ dl / h
    p = p - h / 2 * U_q(x)
    J = G(x)
    mu = np.linalg.solve(h / 2 * (J * W) @ J.T, J @ (W * p))
    return p - h * J.T @ mu, x


def reduced_force(q, p, alpha=0.0, beta=0.0):
    v = p / M
    J = G(q)
    b = -J @ (U_q(q) / M) + curvature(q, v) + 2 * alpha * J @ v + beta * beta * g(q)
    return -U_q(q) - J.T @ np.linalg.solve((J * W) @ J.T, b)


def index_reduced_5(p, q, h):
    """Stoermer-Verlet, implicit in the momenta of the half step."""
    ph = p
    for _ in range(100):
        last = ph
        ph = p + h / 2 * reduced_force(q, last)
        if np.abs(ph - last).max() < 1e-14:
            break
    q1 = q + h * ph / M
    return ph + h / 2 * reduced_force(q1, ph), q1


def projected_after_5(p, q, h):
    """Velocity Verlet without the constraints, then positions and momenta onto the manifold."""
    p = p - h / 2 * U_q(q)
    x = q + h * p / M
    p = p - h / 2 * U_q(x)
    for _ in range(50):
        J = G(x)
        x = x - W * (J.T @ np.linalg.solve((J * W) @ J.T, g(x)))
        if np.abs(g(x)).max() < 1e-14:
            break
    return tangential(p, x), x


def projected_after_6(p, q, h):
    """Explicit midpoint of the reduced equations, then onto the manifold, orthogonally."""
    pm, xm = p + h / 2 * reduced_force(q, p), q + h / 2 * p / M
    x = q + h * pm / M
    p = p + h * reduced_force(xm, pm)
    start, lam = x, np.zeros(2)
    for _ in range(50):
        J = G(x)
        lam = lam + np.linalg.solve(J @ J.T, g(x))
        x = start - J.T @ lam
        if np.abs(g(x)).max() < 1e-14:
            break
    return tangential(p, x), x


def baumgarte_4(p, q, h):
    """Velocity Verlet with alpha = 20, beta = 20."""
    p = p + h / 2 * reduced_force(q, p, 20.0, 20.0)
    x = q + h * p / M
    return p + h / 2 * reduced_force(x, p, 20.0, 20.0), x


class step_off_by_one_5:
    """Makes a step ahead at the beginning, and then one more for each that it is asked for."""

    def __init__(self):
        self.ahead = None

    def step(self, p, q, h):
        if self.ahead is None:
            self.ahead = correct_12(p, q, h)
        self.ahead = correct_12(*self.ahead, h)
        return self.ahead


# ---------------------------------------------------------------- others


def other_6(p, q, h):
    """The classical Runge-Kutta method on the reduced equations."""
    k1, l1 = reduced_force(q, p), p / M
    k2, l2 = reduced_force(q + h / 2 * l1, p + h / 2 * k1), (p + h / 2 * k1) / M
    k3, l3 = reduced_force(q + h / 2 * l2, p + h / 2 * k2), (p + h / 2 * k2) / M
    k4, l4 = reduced_force(q + h * l3, p + h * k3), (p + h * k3) / M
    return p + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4), q + h / 6 * (l1 + 2 * l2 + 2 * l3 + l4)


def other_7(p, q, h):
    """The force is 2 per cent too large where the masses move along it."""

    def kick(p, q):
        f = -U_q(q)
        return p + h / 2 * np.where(f * p > 0, 1.02, 1.0) * f

    J0 = G(q)
    p = kick(p, q)
    x = q + h * W * p
    for _ in range(50):
        if np.abs(g(x)).max() < 1e-14:
            break
        dl = np.linalg.solve((G(x) * W) @ J0.T, g(x))
        x = x - W * (J0.T @ dl)
        p = p - J0.T @ dl / h
    return tangential(kick(p, x), x), x
