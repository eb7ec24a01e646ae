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


def correct_2(p, q, h):
    """Newton on the multipliers until |g| < 1e-10."""
    G0 = G(q)
    p_free = p - 0.5 * h * U_q(q)
    lam = np.zeros(2)
    while True:
        p_half = p_free - 0.5 * h * G0.T @ lam
        q1 = q + h * p_half / M
        r = g(q1)
        if np.abs(r).max() < 1e-10:
            break
        lam = lam + np.linalg.solve(0.5 * h * h * (G(q1) / M) @ G0.T, r)
    G1 = G(q1)
    p1 = p_half - 0.5 * h * U_q(q1)
    mu = np.linalg.solve((G1 / M) @ G1.T, G1 @ (p1 / M))
    return p1 - G1.T @ mu, q1


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


def reference_gradient_each_sweep_1(p, q, h):
    """As games do it: rods are corrected along where they point now, velocity from the change of position."""
    old = q.reshape(2, 2)
    v = p.reshape(2, 2) / MASS[:, None]
    v = v + h / 2 * np.array([0.0, -GRAV])
    pos = old + h * v
    for it in range(1000):
        err = 0.0
        for i, j, length in RODS:
            d = bond(pos, i, j)
            dist = np.sqrt(d @ d)
            n = d / dist
            wi, wj = inverse_masses(i, j)
            c = (dist - length) / (wi + wj)
            err = max(err, abs(dist - length))
            pos[j] -= wj * c * n
            if i >= 0:
                pos[i] += wi * c * n
        if err < 1e-14:
            break
    v = (pos - old) / h
    v = v + h / 2 * np.array([0.0, -GRAV])
    for it in range(1000):
        err = 0.0
        for i, j, length in RODS:
            n = bond(pos, i, j)
            wi, wj = inverse_masses(i, j)
            s = n @ bond(v, i, j) / (n @ n)
            err = max(err, abs(s))
            v[j] -= wj / (wi + wj) * s * n
            if i >= 0:
                v[i] += wi / (wi + wj) * s * n
        if err < 1e-14:
            break
    return (MASS[:, None] * v).ravel(), pos.ravel()


def reference_gradient_at_q1_1(p, q, h):
    """Newton for q1 and the multipliers together."""
    p_free = p - 0.5 * h * U_q(q)
    x = q + h * p_free / M
    lam = np.zeros(2)
    for _ in range(50):
        J = G(x)
        res = np.concatenate([M * (x - q) / h - p_free + 0.5 * h * J.T @ lam, g(x)])
        # second derivatives of g, contracted with lam
        a, b = 2 * lam
        H = np.array([[a + b, 0, -b, 0], [0, a + b, 0, -b], [-b, 0, b, 0], [0, -b, 0, b]])
        K = np.block([[np.diag(M) / h + 0.5 * h * H, 0.5 * h * J.T], [J, np.zeros((2, 2))]])
        d = np.linalg.solve(K, -res)
        x = x + d[:4]
        lam = lam + d[4:]
        if np.abs(d[:4]).max() < 1e-15:
            break
    p_half = M * (x - q) / h
    J = G(x)
    p1 = p_half - 0.5 * h * U_q(x)
    mu = np.linalg.solve((J / M) @ J.T, J @ (p1 / M))
    return p1 - J.T @ mu, x


def momentum_not_corrected_1(p, q, h):
    x0 = q.reshape(2, 2)
    v = p.reshape(2, 2) / MASS[:, None] + 0.5 * h * np.array([0.0, -GRAV])
    x = x0 + h * v
    for sweep in range(500):
        done = True
        for i, j, length in RODS:
            s = bond(x, i, j)
            diff = s @ s - length**2
            if abs(diff) > 1e-13:
                done = False
                r = bond(x0, i, j)
                wi, wj = inverse_masses(i, j)
                k = diff / (2 * (wi + wj) * (s @ r))
                x[j] -= wj * k * r
                if i >= 0:
                    x[i] += wi * k * r
        if done:
            break
    v = v + 0.5 * h * np.array([0.0, -GRAV])
    for sweep in range(500):
        done = True
        for i, j, length in RODS:
            r = bond(x, i, j)
            wi, wj = inverse_masses(i, j)
            rate = r @ bond(v, i, j)
            if abs(rate) > 1e-13:
                done = False
                k = rate / ((wi + wj) * (r @ r))
                v[j] -= wj * k * r
                if i >= 0:
                    v[i] += wi * k * r
        if done:
            break
    return (v * MASS[:, None]).ravel(), x.ravel()


def velocity_not_projected_1(p, q, h):
    G0 = G(q)
    p_half = p + 0.5 * h * FORCE
    x = q + h * Minv * p_half
    for _ in range(40):
        r = g(x)
        if np.abs(r).max() < 1e-14:
            break
        dl = np.linalg.solve((G(x) * Minv) @ G0.T, r)
        x = x - Minv * (G0.T @ dl)
        p_half = p_half - G0.T @ dl / h
    return p_half + 0.5 * h * FORCE, x


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


def one_sweep_1(p, q, h):
    """One pass over the rods for the positions; velocities to convergence."""
    x0 = q.reshape(2, 2)
    a = np.array([0.0, -GRAV])
    v = p.reshape(2, 2) / MASS[:, None] + 0.5 * h * a
    x = x0 + h * v
    for i, j, length in RODS:
        s, r = bond(x, i, j), bond(x0, i, j)
        wi, wj = inverse_masses(i, j)
        k = (s @ s - length**2) / (2 * (wi + wj) * (s @ r))
        x[j] -= wj * k * r
        v[j] -= wj * k * r / h
        if i >= 0:
            x[i] += wi * k * r
            v[i] += wi * k * r / h
    v = (v + 0.5 * h * a).ravel()
    x = x.ravel()
    J = G(x)
    v = v - Minv * (J.T @ np.linalg.solve((J * Minv) @ J.T, J @ v))
    return v * M, x


def loose_tolerance_1(p, q, h, tol=1e-4):
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
            if abs(diff) < tol:
                continue
            r = bond(x0, i, j)
            wi, wj = inverse_masses(i, j)
            k = diff / (2 * (wi + wj) * (s @ r))
            x[j] -= wj * k * r
            v[j] -= wj * k * r / h
            if i >= 0:
                x[i] += wi * k * r
                v[i] += wi * k * r / h
        if worst < tol:
            break
    v = (v + 0.5 * h * a).ravel()
    x = x.ravel()
    J = G(x)
    v = v - Minv * (J.T @ np.linalg.solve((J * Minv) @ J.T, J @ v))
    return v * M, x


def mass_missing_in_position_1(p, q, h):
    """Both ends of a rod are moved by the same amount."""
    x0 = q.reshape(2, 2)
    a = np.array([0.0, -GRAV])
    v = p.reshape(2, 2) / MASS[:, None] + 0.5 * h * a
    x = x0 + h * v
    for sweep in range(500):
        worst = 0.0
        for i, j, length in RODS:
            s, r = bond(x, i, j), bond(x0, i, j)
            diff = s @ s - length**2
            worst = max(worst, abs(diff))
            if i < 0:
                k = diff / (2 * (s @ r))
            else:
                k = diff / (4 * (s @ r))
                x[i] += k * r
                v[i] += k * r / h
            x[j] -= k * r
            v[j] -= k * r / h
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


def mass_missing_in_velocity_1(p, q, h):
    """The velocities of both ends of a rod are changed by the same amount."""
    x0 = q.reshape(2, 2)
    a = np.array([0.0, -GRAV])
    v = p.reshape(2, 2) / MASS[:, None] + 0.5 * h * a
    x = x0 + h * v
    for sweep in range(500):
        worst = 0.0
        for i, j, length in RODS:
            s, r = bond(x, i, j), bond(x0, i, j)
            diff = s @ s - length**2
            worst = max(worst, abs(diff))
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
            rate = r @ bond(v, i, j)
            worst = max(worst, abs(rate))
            k = rate / (r @ r)
            if i >= 0:
                v[i] += 0.5 * k * r
                v[j] -= 0.5 * k * r
            else:
                v[j] -= k * r
        if worst < 1e-13:
            break
    return (v * MASS[:, None]).ravel(), x.ravel()


def velocity_for_momentum_1(p, q, h):
    """A code in velocities, called with momenta."""
    v, x0 = p, q
    J0 = G(x0)
    v = v + 0.5 * h * FORCE * Minv
    x = x0 + h * v
    for _ in range(60):
        r = g(x)
        if np.abs(r).max() < 1e-14:
            break
        k = Minv * (J0.T @ np.linalg.solve((G(x) * Minv) @ J0.T, r))
        x = x - k
        v = v - k / h
    v = v + 0.5 * h * FORCE * Minv
    J = G(x)
    v = v - Minv * (J.T @ np.linalg.solve((J * Minv) @ J.T, J @ v))
    return v, x


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


def acceleration(q, v):
    """From the twice differentiated constraints: G v' + g_qq(v, v) = 0."""
    J = G(q)
    x1, y1, x2, y2 = v
    curved = 2 * np.array([x1**2 + y1**2, (x2 - x1) ** 2 + (y2 - y1) ** 2])
    lam = np.linalg.solve((J * Minv) @ J.T, (J * Minv) @ FORCE + curved)
    return Minv * (FORCE - J.T @ lam)


def index_reduced_1(p, q, h):
    """Velocity Verlet with the constrained acceleration."""
    v = p * Minv
    a = acceleration(q, v)
    v_half = v + 0.5 * h * a
    q1 = q + h * v_half
    a = acceleration(q1, v_half)
    return (v_half + 0.5 * h * a) * M, q1


def projected_after_1(p, q, h):
    """Verlet with the constrained acceleration, and back onto the manifold."""
    v = p * Minv
    v = v + 0.5 * h * acceleration(q, v)
    x = q + h * v
    v = v + 0.5 * h * acceleration(x, v)
    for _ in range(30):
        J = G(x)
        r = g(x)
        x = x - Minv * (J.T @ np.linalg.solve((J * Minv) @ J.T, r))
        if np.abs(r).max() < 1e-14:
            break
    J = G(x)
    v = v - Minv * (J.T @ np.linalg.solve((J * Minv) @ J.T, J @ v))
    return M * v, x


def projected_after_2(p, q, h):
    """A ballistic step, then the rods are put right as in a game, and velocities along rods taken away."""
    x = (q + h * p * Minv + 0.5 * h * h * FORCE * Minv).reshape(2, 2)
    v = (p * Minv + h * FORCE * Minv).reshape(2, 2)
    for it in range(1000):
        err = 0.0
        for i, j, length in RODS:
            d = bond(x, i, j)
            dist = np.hypot(*d)
            wi, wj = inverse_masses(i, j)
            c = (dist - length) / (wi + wj) / dist
            err = max(err, abs(dist - length))
            x[j] -= wj * c * d
            if i >= 0:
                x[i] += wi * c * d
        if err < 1e-14:
            break
    for it in range(1000):
        err = 0.0
        for i, j, length in RODS:
            d = bond(x, i, j)
            wi, wj = inverse_masses(i, j)
            c = d @ bond(v, i, j) / (wi + wj) / (d @ d)
            err = max(err, abs(c))
            v[j] -= wj * c * d
            if i >= 0:
                v[i] += wi * c * d
        if err < 1e-14:
            break
    return M * v.ravel(), x.ravel()


ALPHA = BETA = 10.0


def baumgarte_1(p, q, h):
    """Velocity Verlet, constraints held by feedback."""

    def acc(x, v):
        J = G(x)
        a, b, c, d = v
        gdd = 2 * np.array([a * a + b * b, (c - a) ** 2 + (d - b) ** 2])
        rhs = J @ (FORCE / M) + gdd + 2 * ALPHA * (J @ v) + BETA**2 * g(x)
        return (FORCE - J.T @ np.linalg.solve(J @ (J / M).T, rhs)) / M

    v = p / M
    v = v + h / 2 * acc(q, v)
    x = q + h * v
    v = v + h / 2 * acc(x, v)
    return v * M, x


def step_off_by_one_1(p, q, h, t):
    """States at the times t."""
    P, Q = [], []
    n = 0
    for time in t:
        while n * h < time + h / 2:
            p, q = correct_2(p, q, h)
            n += 1
        P.append(p)
        Q.append(q)
    return np.array(P), np.array(Q)


# ---------------------------------------------------------------- others


def other_1(p, q, h):
    """Symplectic Euler on the reduced equations."""
    v = p * Minv
    new = v
    for _ in range(100):
        last = new
        new = v + h * acceleration(q, last)
        if np.abs(new - last).max() < 1e-15:
            break
    return M * new, q + h * new


def other_2(p, q, h):
    """g = 9.18."""
    weight = np.array([0.0, -9.18, 0.0, -3 * 9.18])
    J0 = G(q)
    p_half = p + h / 2 * weight
    x = q + h * p_half / M
    for _ in range(60):
        r = g(x)
        if np.abs(r).max() < 1e-14:
            break
        dl = np.linalg.solve((G(x) / M) @ J0.T, r)
        p_half = p_half - J0.T @ dl / h
        x = x - J0.T @ dl / M
    p1 = p_half + h / 2 * weight
    J = G(x)
    return p1 - J.T @ np.linalg.solve((J / M) @ J.T, J @ (p1 / M)), x
