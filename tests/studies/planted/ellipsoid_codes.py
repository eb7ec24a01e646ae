"""A point of 2 kg on the ellipsoid with semi-axes 1.8, 1.5, 0.7: everything with scalars, one multiplier."""

import numpy as np

m = 2.0
D = 1 / np.array([1.8, 1.5, 0.7]) ** 2


def miss(q):
    return D @ (q * q) - 1


def normal(q):
    return 2 * D * q


def tangential(p, q):
    n = normal(q)
    return p - n * ((n @ p) / (n @ n))


def root(free, n):
    """The nearer s with miss(free - s n) = 0: a quadratic equation, solved in the form without cancellation."""
    a, b, c = D @ (n * n), D @ (n * free), miss(free)
    return c / (b + np.sqrt(b * b - a * c))


def correct_newton_full(p, q, h):
    """All six unknowns q1, lam, mu, p1 ... by Newton's method on (q1, lam) with its 4 x 4 matrix."""
    n0 = normal(q)
    x = np.concatenate([q + h * p / m, [0.0]])
    for _ in range(60):
        q1, lam = x[:3], x[3]
        r = np.concatenate([q1 - q - h / m * (p - h / 2 * lam * n0), [miss(q1)]])
        A = np.zeros((4, 4), dtype=x.dtype)
        A[:3, :3] = np.eye(3)
        A[:3, 3] = h * h / (2 * m) * n0
        A[3, :3] = normal(q1)
        d = np.linalg.solve(A, r)
        x = x - d
        if np.max(np.abs(d[:3])) < 1e-15:
            break
    return tangential(p - h / 2 * x[3] * n0, x[:3]), x[:3].copy()


def correct_solve(p, q, h, t):
    """The whole run; the constraint's parabola is solved in closed form, and polished by Newton."""
    last = int(round(float(np.max(t)) / h))
    keep = {int(round(float(s) / h)) for s in np.atleast_1d(t)}
    ps, qs = [], []
    for k in range(1, last + 1):
        n0 = normal(q)
        free = q + h * p / m
        s = root(free, n0)
        for _ in range(2):
            y = free - s * n0
            s = s + miss(y) / (normal(y) @ n0)
        q, p = free - s * n0, p - m / h * s * n0
        p = tangential(p, q)
        if k in keep:
            ps.append(p)
            qs.append(q)
    return np.array(ps), np.array(qs)


def normal_of_the_end(p, q, h):
    """The force of constraint stands on the surface where the point arrives."""
    q1 = q + h * p / m
    lam = 0.0
    for _ in range(60):
        r = q1 + h * h / (2 * m) * lam * normal(q1) - q - h * p / m
        A = np.zeros((4, 4), dtype=q1.dtype)
        A[:3, :3] = np.eye(3) + h * h / (2 * m) * lam * 2 * np.diag(D)
        A[:3, 3] = h * h / (2 * m) * normal(q1)
        A[3, :3] = normal(q1)
        d = np.linalg.solve(A, np.concatenate([r, [miss(q1)]]))
        q1 = q1 - d[:3]
        lam = lam - d[3]
        if np.max(np.abs(d[:3])) < 1e-15:
            break
    return tangential(p - h / 2 * lam * normal(q1), q1), q1


def normal_of_the_moment(p, q, h):
    y, half = q + h * p / m, p
    for _ in range(100):
        n = normal(y)
        s = miss(y) / (n @ n)
        y = y - s * n
        half = half - m / h * s * n
        if abs(miss(y)) < 1e-15:
            break
    return tangential(half, y), y


def minus(p, q, h):
    """A sign: the impulse is added that should be taken away."""
    n0 = normal(q)
    free = q + h * p / m
    s = root(free, n0)
    q1 = free - s * n0
    return tangential(p + m / h * s * n0, q1), q1


def halved(p, q, h):
    """lam found with h^2 / m in place of h^2 / (2 m), and put into the momentum with h / 2."""
    n0 = normal(q)
    free = q + h * p / m
    s = root(free, n0)
    lam = s * m / (h * h)
    q1 = free - h * h / m * lam * n0
    return tangential(p - h / 2 * lam * n0, q1), q1


def coarse(p, q, h):
    """Chord iteration, satisfied with 1e-6."""
    n0 = normal(q)
    y, half = q + h * p / m, p
    for _ in range(100):
        if abs(miss(y)) < 1e-6:
            break
        s = miss(y) / (n0 @ n0)
        y = y - s * n0
        half = half - m / h * s * n0
    return tangential(half, y), y


def lam(p, q):
    v = p / m
    n = normal(q)
    return (2 * D @ (v * v)) / (n @ n / m)


def reduced_euler(p, q, h):
    """lam(p, q) inserted; symplectic Euler, its momentum equation iterated to rounding."""
    P = p
    for _ in range(300):
        new = p - h * lam(P, q) * normal(q)
        moved = np.max(np.abs(new - P))
        P = new
        if moved < 1e-15:
            break
    return P, q + h * P / m


def reduced_euler_baumgarte(p, q, h):
    """Symplectic Euler with stabilised multiplier, alpha = beta = 10."""

    def stabilised(p, q):
        v, n = p / m, normal(q)
        return (2 * D @ (v * v) + 2 * 10 * n @ v + 100 * miss(q)) / (n @ n / m)

    P = p
    for _ in range(300):
        new = p - h * stabilised(P, q) * normal(q)
        moved = np.max(np.abs(new - P))
        P = new
        if moved < 1e-15:
            break
    return P, q + h * P / m


def straight_then_down(p, q, h):
    """Goes straight on, drops to the foot of the perpendicular, turns the momentum into the tangent plane."""
    x = q + h * p / m
    s = 0.0
    for _ in range(60):
        y = x / (1 + 2 * s * D)
        slope = -np.sum(4 * D * D * y * y / (1 + 2 * s * D))
        d = miss(y) / slope
        s = s - d
        if abs(d) < 1e-16:
            break
    y = x / (1 + 2 * s * D)
    return tangential(p, y), y


def runge_kutta_then_down(p, q, h):
    """Explicit midpoint rule with lam(p, q), then down along the normal of the predicted point, and into the tangent plane."""
    pm, qm = p - h / 2 * lam(p, q) * normal(q), q + h / 2 * p / m
    P, x = p - h * lam(pm, qm) * normal(qm), q + h * pm / m
    n = normal(x)
    y = x - root(x, n) * n
    return tangential(P, y), y


class OneBehind:
    """Hands out the state before the one that it has just computed."""

    def __init__(self):
        self.state = None

    def step(self, p, q, h):
        p, q = (p, q) if self.state is None else self.state
        n0 = normal(q)
        free = q + h * p / m
        s = root(free, n0)
        q1 = free - s * n0
        self.state = tangential(p - m / h * s * n0, q1), q1
        return p.copy(), q.copy()


def dragged(p, q, h):
    """A little friction, 0.05 v, that nobody asked for."""
    n0 = normal(q)
    half = p * (1 - 0.05 * h / (2 * m))
    free = q + h * half / m
    s = root(free, n0)
    q1 = free - s * n0
    return tangential((half - m / h * s * n0) / (1 + 0.05 * h / (2 * m)), q1), q1
