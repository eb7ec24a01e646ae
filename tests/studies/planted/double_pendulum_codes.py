"""Steps for the double pendulum, masses 1 and 3, rods of length 1, g = 9.81; q = (x1, y1, x2, y2)."""

import numpy as np

GRAV = 9.81
MASS = np.array([1.0, 3.0])
W = 1.0 / MASS
M = np.repeat(MASS, 2)
Minv = 1.0 / M
FORCE = np.array([0.0, -GRAV * 1.0, 0.0, -GRAV * 3.0])
# a rod is (i, j, length); i = -1 is the pivot at the origin
RODS = [(-1, 0, 1.0), (0, 1, 1.0)]


def U_q(q):
    return np.array([0.0, 9.81, 0.0, 3 * 9.81])


def g(q):
    x1, y1, x2, y2 = q
    return np.array([x1 * x1 + y1 * y1 - 1.0, (x2 - x1) ** 2 + (y2 - y1) ** 2 - 1.0])


def G(q):
    x1, y1, x2, y2 = q
    dx, dy = x2 - x1, y2 - y1
    return 2 * np.array([[x1, y1, 0, 0], [-dx, -dy, dx, dy]])


def bond(x, i, j):
    return x[j] - x[i] if i >= 0 else x[j]


def inverse_masses(i, j):
    return (W[i] if i >= 0 else 0.0), W[j]


# ---------------------------------------------------------------- correct


def correct_1(p, q, h):
    """Velocities, rods one after another."""
    x0 = q.reshape(2, 2)
    v = p.reshape(2, 2) / MASS[:, None]
    a = np.array([0.0, -GRAV])
    v = v + 0.5 * h * a
    x = x0 + h * v
    for sweep in range(500):
        worst = 0.0
        for i, j, length in RODS:
            s = bond(x, i, j)
            diff = s @ s - length**2
            worst = max(worst, abs(diff))
            r = bond(x0, i, j)
            wi, wj = inverse_masses(i, j)
            k = diff / (2 * (wi + wj) * (s @ r))
            x[j] -= wj * k * r
            v[j] -= wj * k * r / h
            if i >= 0:
                x[i] += wi * k * r
                v[i] += wi * k * r / h
        if worst < 1e-13:
            break
    v = v + 0.5 * h * a
    for sweep in range(500):
        worst = 0.0
        for i, j, length in RODS:
            r = bond(x, i, j)
            wi, wj = inverse_masses(i, j)
            rate = r @ bond(v, i, j)
            worst = max(worst, abs(rate))
            k = rate / ((wi + wj) * (r @ r))
            v[j] -= wj * k * r
            if i >= 0:
                v[i] += wi * k * r
        if worst < 1e-13:
            break
    return (v * MASS[:, None]).ravel(), x.ravel()


class correct_3:
    """Stoermer's two-step form in positions; momenta from the projected mean of the neighbouring differences."""

    def __init__(self):
        self.before = None

    def constrain(self, guess, ref):
        x = guess.copy()
        J = G(ref)
        for _ in range(60):
            r = g(x)
            if np.abs(r).max() < 2e-14:
                break
            x = x - Minv * (J.T @ np.linalg.solve((G(x) * Minv) @ J.T, r))
        return x

    def step(self, p, q, h):
        if self.before is None:
            u_half = p * Minv + 0.5 * h * FORCE * Minv
            q1 = self.constrain(q + h * u_half, q)
        else:
            q1 = self.constrain(2 * q - self.before + h * h * FORCE * Minv, q)
        u = (q1 - q) / h + 0.5 * h * FORCE * Minv
        J = G(q1)
        u = u - Minv * (J.T @ np.linalg.solve((J * Minv) @ J.T, J @ u))
        self.before = q.copy()
        return u * M, q1


# ---------------------------------------------------------------- one mistake each


def full_kick_1(p, q, h):
    """The first kick is over h."""
    G0 = G(q)
    p_half = p + h * FORCE
    x = q + h * Minv * p_half
    for _ in range(40):
        r = g(x)
        if np.abs(r).max() < 1e-14:
            break
        dl = np.linalg.solve((G(x) * Minv) @ G0.T, r)
        x = x - Minv * (G0.T @ dl)
        p_half = p_half - G0.T @ dl / h
    p1 = p_half + 0.5 * h * FORCE
    G1 = G(x)
    return p1 - G1.T @ np.linalg.solve((G1 * Minv) @ G1.T, G1 @ (Minv * p1)), x


def multiplier_sign_1(p, q, h):
    """Positions go along -lam, momenta along +lam."""
    J0 = G(q)
    p_half = p - h / 2 * U_q(q)
    x = q + h * p_half / M
    total = np.zeros(2)
    for _ in range(60):
        r = g(x)
        if np.abs(r).max() < 1e-14:
            break
        dl = np.linalg.solve((G(x) / M) @ J0.T, r)
        total = total + dl
        x = x - J0.T @ dl / M
    p_half = p_half + J0.T @ total / h
    p1 = p_half - h / 2 * U_q(x)
    J = G(x)
    return p1 - J.T @ np.linalg.solve((J / M) @ J.T, J @ (p1 / M)), x


def multiplier_half_1(p, q, h):
    """Momenta get half of the impulse that positions had."""
    J0 = G(q)
    p_half = p - h / 2 * U_q(q)
    x = q + h * p_half / M
    lam = np.zeros(2)
    for _ in range(60):
        r = g(x)
        if np.abs(r).max() < 1e-14:
            break
        dl = np.linalg.solve(h * h * (G(x) / M) @ J0.T, r)
        lam = lam + dl
        x = x - h * h * (J0.T @ dl) / M
    p_half = p_half - h / 2 * (J0.T @ lam)
    p1 = p_half - h / 2 * U_q(x)
    J = G(x)
    return p1 - J.T @ np.linalg.solve((J / M) @ J.T, J @ (p1 / M)), x


# ---------------------------------------------------------------- others
