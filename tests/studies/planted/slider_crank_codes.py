"""Steps for the slider crank, q = (x1, y1, x2), crank 1, rod 2, all masses 1, gravity 9.81."""

import numpy as np
from numpy.linalg import solve

M = np.array([[2 / 3, 0.0, 1 / 6], [0.0, 2 / 3, 0.0], [1 / 6, 0.0, 4 / 3]])
Minv = np.linalg.inv(M)
WEIGHT = np.array([0.0, -9.81, 0.0])


def U_q(q):
    return np.array([0.0, 9.81, 0.0])


def g(q):
    return np.array([q[0] ** 2 + q[1] ** 2 - 1, (q[0] - q[2]) ** 2 + q[1] ** 2 - 4])


def G(q):
    d = q[0] - q[2]
    return 2 * np.array([[q[0], q[1], 0], [d, q[1], -d]])


def g_qq(v, w):
    return 2 * np.array([v[0] * w[0] + v[1] * w[1], (v[0] - v[2]) * (w[0] - w[2]) + v[1] * w[1]])


def kkt(J, r, s):
    """Solve M x + J^T y = r, J x = s."""
    d, m = len(r), len(s)
    K = np.zeros((d + m, d + m))
    K[:d, :d] = M
    K[:d, d:] = J.T
    K[d:, :d] = J
    z = solve(K, np.concatenate([r, s]))
    return z[:d], z[d:]


# ---------------------------------------------------------------- correct


def correct_6(p, q, h):
    """Half kick, drift on the manifold, half kick, momenta projected after each."""

    def project(p, q):
        J = G(q)
        return p - J.T @ solve(J @ Minv @ J.T, J @ Minv @ p)

    p = project(p - h / 2 * U_q(q), q)
    J0 = G(q)
    x = q + h * Minv @ p
    for _ in range(50):
        r = g(x)
        if np.abs(r).max() < 1e-14:
            break
        x = x - Minv @ J0.T @ solve(G(x) @ Minv @ J0.T, r)
    p = project(M @ (x - q) / h, x)
    return project(p - h / 2 * U_q(x), x), x


def correct_7(p, q, h):
    """Newton for velocity and multipliers together, until increments are rounding."""
    J0 = G(q)
    v = solve(M, p)
    lam = np.zeros(2)
    base = p + h / 2 * WEIGHT
    for _ in range(30):
        x = q + h * v
        res = np.concatenate([M @ v - base + h / 2 * J0.T @ lam, g(x) / h])
        K = np.block([[M, h / 2 * J0.T], [G(x), np.zeros((2, 2))]])
        dz = solve(K, -res)
        v = v + dz[:3]
        lam = lam + dz[3:]
        if np.linalg.norm(dz[:3]) < 1e-13 * (1 + np.linalg.norm(v)):
            break
    x = q + h * v
    w, _ = kkt(G(x), M @ v + h / 2 * WEIGHT, np.zeros(2))
    return M @ w, x


class correct_8:
    """Velocities, chord iteration with the matrix of the beginning, multipliers of the last step to begin with."""

    def __init__(self):
        self.lam = np.zeros(2)

    def step(self, p, q, h):
        J0 = G(q)
        D = Minv @ J0.T
        v0 = Minv @ (p + h / 2 * WEIGHT)
        A = J0 @ D
        lam = self.lam
        for _ in range(300):
            x = q + h * (v0 - D @ lam)
            r = g(x)
            if max(abs(r)) < 2e-14:
                break
            lam = lam + solve(A, r) / h
        self.lam = lam
        v = v0 - D @ lam + h / 2 * Minv @ WEIGHT
        J = G(x)
        v = v - Minv @ J.T @ solve(J @ Minv @ J.T, J @ v)
        return M @ v, x


# ---------------------------------------------------------------- one mistake each


def reference_gradient_at_q1_3(p, q, h):
    """Fixed point: the direction at the latest q1, the multipliers found anew."""
    p_free = p - h / 2 * U_q(q)
    x_free = q + h * Minv @ p_free
    x = x_free
    lam = np.zeros(2)
    for _ in range(400):
        J = G(x)
        new = x_free - h * h / 2 * Minv @ J.T @ lam
        r = g(new)
        dl = solve(h * h / 2 * J @ Minv @ J.T, r)
        lam = lam + dl
        moved = np.abs(new - x).max()
        x = new
        if moved < 1e-15 and np.abs(r).max() < 1e-14:
            break
    J = G(x)
    p_half = p_free - h / 2 * J.T @ lam
    p1 = p_half - h / 2 * U_q(x)
    return p1 - J.T @ solve(J @ Minv @ J.T, J @ Minv @ p1), x


def reference_gradient_each_sweep_2(p, q, h):
    """Newton's matrix and the correction are both of the current iterate."""
    p_half = p - h / 2 * U_q(q)
    x = q + h * Minv @ p_half
    for _ in range(50):
        r = g(x)
        if np.abs(r).max() < 1e-14:
            break
        J = G(x)
        dl = solve(J @ Minv @ J.T, r)
        x = x - Minv @ J.T @ dl
        p_half = p_half - J.T @ dl / h
    p1 = p_half - h / 2 * U_q(x)
    J = G(x)
    return p1 - J.T @ solve(J @ Minv @ J.T, J @ Minv @ p1), x


def momentum_not_corrected_3(p, q, h):
    p_half = p - h / 2 * U_q(q)
    x = q + h * Minv @ p_half
    J0 = G(q)
    for _ in range(50):
        r = g(x)
        if np.abs(r).max() < 1e-14:
            break
        x = x - Minv @ J0.T @ solve(G(x) @ Minv @ J0.T, r)
    p1 = p_half - h / 2 * U_q(x)
    J = G(x)
    return p1 - J.T @ solve(J @ Minv @ J.T, J @ Minv @ p1), x


def velocity_not_projected_3(p, q, h):
    """Positions and multipliers by Newton; momenta from the multipliers."""
    J0 = G(q)
    lam = np.zeros(2)
    for _ in range(50):
        p_half = p - h / 2 * (U_q(q) + J0.T @ lam)
        x = q + h * Minv @ p_half
        r = g(x)
        if np.abs(r).max() < 1e-14:
            break
        lam = lam + solve(h * h / 2 * G(x) @ Minv @ J0.T, r)
    return p_half - h / 2 * U_q(x), x


def full_kick_3(p, q, h):
    """The second kick is over h."""
    v = Minv @ p + h / 2 * Minv @ WEIGHT
    J0 = G(q)
    x = q + h * v
    for _ in range(50):
        r = g(x)
        if np.abs(r).max() < 1e-14:
            break
        dx = Minv @ J0.T @ solve(G(x) @ Minv @ J0.T, r)
        x = x - dx
        v = v - dx / h
    v, _ = kkt(G(x), M @ v + h * WEIGHT, np.zeros(2))
    return M @ v, x


def one_sweep_3(p, q, h):
    """One linearized solve."""
    p_half = p - h / 2 * U_q(q)
    x = q + h * Minv @ p_half
    J0 = G(q)
    dx, dl = kkt(J0, np.zeros(3), -g(x))
    x = x + dx
    p_half = p_half + M @ dx / h
    v, mu = kkt(G(x), p_half - h / 2 * U_q(x), np.zeros(2))
    return M @ v, x


def loose_tolerance_2(p, q, h):
    """Chord iteration until |g| < 1e-5."""
    J0 = G(q)
    D = Minv @ J0.T
    v = Minv @ (p + h / 2 * WEIGHT)
    A = J0 @ D
    x = q + h * v
    while np.linalg.norm(g(x)) > 1e-5:
        dx = D @ solve(A, g(x))
        x = x - dx
        v = v - dx / h
    v = v + h / 2 * Minv @ WEIGHT
    J = G(x)
    v = v - Minv @ J.T @ solve(J @ Minv @ J.T, J @ v)
    return M @ v, x


def mass_missing_in_position_2(p, q, h):
    p_half = p - h / 2 * U_q(q)
    x = q + h * Minv @ p_half
    J0 = G(q)
    lam = np.zeros(2)
    for _ in range(50):
        r = g(x)
        if np.abs(r).max() < 1e-14:
            break
        dl = solve(G(x) @ J0.T, r)
        x = x - J0.T @ dl
        lam = lam + dl
    p_half = p_half - J0.T @ lam / h
    p1 = p_half - h / 2 * U_q(x)
    J = G(x)
    return p1 - J.T @ solve(J @ Minv @ J.T, J @ Minv @ p1), x


def mass_missing_in_velocity_2(p, q, h):
    """Matrix G G^T where G M^-1 G^T is due."""
    p_half = p - h / 2 * U_q(q)
    x = q + h * Minv @ p_half
    J0 = G(q)
    for _ in range(50):
        r = g(x)
        if np.abs(r).max() < 1e-14:
            break
        dl = solve(G(x) @ Minv @ J0.T, r)
        x = x - Minv @ J0.T @ dl
        p_half = p_half - J0.T @ dl / h
    p1 = p_half - h / 2 * U_q(x)
    J = G(x)
    mu = solve(J @ J.T, J @ Minv @ p1)
    return p1 - J.T @ mu, x


def velocity_for_momentum_3(p, q, h):
    """q1 = q0 + h p_half."""
    p_half = p - h / 2 * U_q(q)
    x = q + h * p_half
    J0 = G(q)
    for _ in range(50):
        r = g(x)
        if np.abs(r).max() < 1e-14:
            break
        dl = solve(G(x) @ Minv @ J0.T, r)
        x = x - Minv @ J0.T @ dl
        p_half = p_half - J0.T @ dl / h
    p1 = p_half - h / 2 * U_q(x)
    J = G(x)
    return p1 - J.T @ solve(J @ Minv @ J.T, J @ Minv @ p1), x


def multiplier_sign_3(p, q, h):
    """The second multiplier is added."""
    p_half = p - h / 2 * U_q(q)
    x = q + h * Minv @ p_half
    J0 = G(q)
    for _ in range(50):
        r = g(x)
        if np.abs(r).max() < 1e-14:
            break
        dl = solve(G(x) @ Minv @ J0.T, r)
        x = x - Minv @ J0.T @ dl
        p_half = p_half - J0.T @ dl / h
    p1 = p_half - h / 2 * U_q(x)
    J = G(x)
    mu = solve(J @ Minv @ J.T, J @ Minv @ p1)
    return p1 + J.T @ mu, x


def multiplier_half_2(p, q, h):
    """The second multiplier is for h/2, and is multiplied by h/2 once more: half of it is used."""
    J0 = G(q)
    lam = np.zeros(2)
    for _ in range(50):
        p_half = p - h / 2 * (U_q(q) + J0.T @ lam)
        x = q + h * Minv @ p_half
        r = g(x)
        if np.abs(r).max() < 1e-14:
            break
        lam = lam + solve(h * h / 2 * G(x) @ Minv @ J0.T, r)
    p1 = p_half - h / 2 * U_q(x)
    J = G(x)
    mu = solve(h * J @ Minv @ J.T, J @ Minv @ p1)
    return p1 - h / 2 * J.T @ mu, x


def index_reduced_3(p, q, h):
    """Implicit midpoint by fixed-point iteration, accelerations from the KKT system."""
    v = solve(M, p)
    v1, x1 = v, q + h * v
    for _ in range(100):
        vm, xm = (v + v1) / 2, (q + x1) / 2
        a, _ = kkt(G(xm), WEIGHT, -g_qq(vm, vm))
        last = v1
        v1 = v + h * a
        x1 = q + h / 2 * (v + v1)
        if np.abs(v1 - last).max() < 1e-14:
            break
    return M @ v1, x1


def projected_after_4(p, q, h):
    """Velocity Verlet on the accelerations of the KKT system, then both projections in the metric of M."""
    v = solve(M, p)
    a, _ = kkt(G(q), WEIGHT, -g_qq(v, v))
    v = v + h / 2 * a
    x = q + h * v
    a, _ = kkt(G(x), WEIGHT, -g_qq(v, v))
    v = v + h / 2 * a
    for _ in range(20):
        dx, _ = kkt(G(x), np.zeros(3), -g(x))
        x = x + dx
        if np.abs(dx).max() < 1e-15:
            break
    v, _ = kkt(G(x), M @ v, np.zeros(2))
    return M @ v, x


def baumgarte_3(p, q, h):
    """Implicit midpoint, alpha = beta = 5."""
    alpha = beta = 5.0
    v = solve(M, p)
    v1, x1 = v, q + h * v
    for _ in range(100):
        vm, xm = (v + v1) / 2, (q + x1) / 2
        J = G(xm)
        a, _ = kkt(J, WEIGHT, -g_qq(vm, vm) - 2 * alpha * J @ vm - beta**2 * g(xm))
        last = v1
        v1 = v + h * a
        x1 = q + h / 2 * (v + v1)
        if np.abs(v1 - last).max() < 1e-14:
            break
    return M @ v1, x1


def step_off_by_one_3(p, q, h, substeps=1):
    """Substeps, one too many of them."""
    dt = h / substeps
    for _ in range(substeps + 1):
        p, q = correct_7(p, q, dt)
    return p, q


# ---------------------------------------------------------------- others


def other_4(p, q, h):
    """A rod of length 2.01."""

    def g(q):
        return np.array([q[0] ** 2 + q[1] ** 2 - 1, (q[0] - q[2]) ** 2 + q[1] ** 2 - 2.01**2])

    p_half = p - h / 2 * U_q(q)
    x = q + h * Minv @ p_half
    J0 = G(q)
    for _ in range(50):
        r = g(x)
        if np.abs(r).max() < 1e-14:
            break
        dl = solve(G(x) @ Minv @ J0.T, r)
        x = x - Minv @ J0.T @ dl
        p_half = p_half - J0.T @ dl / h
    p1 = p_half - h / 2 * U_q(x)
    J = G(x)
    return p1 - J.T @ solve(J @ Minv @ J.T, J @ Minv @ p1), x
