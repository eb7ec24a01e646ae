"""Two beads and a rod (problem file beads.py): vectors of six, inverse masses W as a vector, Newton on the multipliers."""

import numpy as np

m1, m2, length, stiffness, gravity = 1.0, 4.0, 1.0, 5.0, 9.81
M = np.array([m1, m1, m1, m2, m2, m2])
W = 1 / M
TOP = np.array([0.0, 0.0, 1.0])


def grad(q):
    d = q[3:] - TOP
    pull = stiffness * (d @ d) * d
    return np.concatenate([[0, 0, gravity * m1], pull + np.array([0, 0, gravity * m2])])


def cons(q):
    x, y, z = q[:3]
    d = q[3:] - q[:3]
    return np.array([z - 0.3 * x**2 + 0.2 * y**2 - 0.05 * x**4, d @ d - length**2])


def jac(q):
    x, y, z = q[:3]
    d = 2 * (q[3:] - q[:3])
    return np.array([[-0.6 * x - 0.2 * x**3, 0.4 * y, 1, 0, 0, 0], [-d[0], -d[1], -d[2], d[0], d[1], d[2]]])


def bend(q, v):
    """g_qq(v, v)."""
    d = v[3:] - v[:3]
    return np.array([(-0.6 - 0.6 * q[0] ** 2) * v[0] ** 2 + 0.4 * v[1] ** 2, 2 * d @ d])


def to_surface(half, q, h, sweeps=50):
    """Return p_half and q1 after Newton's iteration on lam."""
    G0 = jac(q)
    lam = np.zeros(2)
    p, q1 = half, q + h * W * half
    for _ in range(sweeps):
        d = np.linalg.solve(h * h / 2 * (jac(q1) * W) @ G0.T, cons(q1))
        lam = lam + d
        p = half - h / 2 * G0.T @ lam
        q1 = q + h * W * p
        if h * h * np.max(np.abs(d)) < 1e-15:
            break
    return p, q1


def to_tangent(p, q):
    G = jac(q)
    return p - G.T @ np.linalg.solve((G * W) @ G.T, G @ (W * p))


def correct_newton(p, q, h):
    half, q1 = to_surface(p - h / 2 * grad(q), q, h)
    return to_tangent(half - h / 2 * grad(q1), q1), q1


class CorrectStored:
    """Keeps the force of the end of a step for the next one; quasi-Newton with the matrix of the start."""

    def __init__(self):
        self.q = None
        self.force = None

    def step(self, p, q, h):
        if self.q is None or not np.array_equal(self.q, q):
            self.force = -grad(q)
        G0 = jac(q)
        inverse = np.linalg.inv((G0 * W) @ G0.T)
        half = p + h / 2 * self.force
        q1 = q + h * W * half
        best = np.inf
        for _ in range(200):
            r = cons(q1)
            size = np.max(np.abs(r))
            if size == 0 or (size < 1e-14 and size >= best):
                break
            best = size
            s = inverse @ r
            half = half - G0.T @ s / h
            q1 = q1 - W * (G0.T @ s)
        self.q, self.force = q1.copy(), -grad(q1)
        return to_tangent(half + h / 2 * self.force, q1), q1


def current_gradient(p, q, h):
    """Every sweep corrects along the gradients of where the beads are by then."""
    half = p - h / 2 * grad(q)
    q1 = q + h * W * half
    for _ in range(100):
        G = jac(q1)
        s = G.T @ np.linalg.solve((G * W) @ G.T, cons(q1))
        q1 = q1 - W * s
        half = half - s / h
        if np.max(np.abs(W * s)) < 1e-15:
            break
    return to_tangent(half - h / 2 * grad(q1), q1), q1


def end_gradient(p, q, h):
    """Gradients at q1 in the position stage, by repeating it with those of the last answer."""
    kicked = p - h / 2 * grad(q)
    q1 = q + h * W * kicked
    for _ in range(100):
        G, start = jac(q1), q1
        lam = np.zeros(2)
        for _ in range(50):
            half = kicked - h / 2 * G.T @ lam
            q1 = q + h * W * half
            d = np.linalg.solve(h * h / 2 * (jac(q1) * W) @ G.T, cons(q1))
            lam = lam + d
            if h * h * np.max(np.abs(d)) < 1e-16:
                break
        half = kicked - h / 2 * G.T @ lam
        q1 = q + h * W * half
        if np.max(np.abs(q1 - start)) < 1e-15:
            break
    return to_tangent(half - h / 2 * grad(q1), q1), q1


def uncorrected_momentum(p, q, h):
    half = p - h / 2 * grad(q)
    _, q1 = to_surface(half, q, h)
    return to_tangent(half - h / 2 * grad(q1), q1), q1


def only_positions(p, q, h):
    half, q1 = to_surface(p - h / 2 * grad(q), q, h)
    return half - h / 2 * grad(q1), q1


def two_full_kicks(p, q, h):
    half, q1 = to_surface(p - h * grad(q), q, h)
    return to_tangent(half - h * grad(q1), q1), q1


class StaleForce:
    """Evaluates the force once a step, and kicks with it before and after the move."""

    def step(self, p, q, h):
        self.force = -grad(q)
        half, q1 = to_surface(p + h / 2 * self.force, q, h)
        return to_tangent(half + h / 2 * self.force, q1), q1


def once(p, q, h):
    half, q1 = to_surface(p - h / 2 * grad(q), q, h, sweeps=1)
    return to_tangent(half - h / 2 * grad(q1), q1), q1


def thousandth(p, q, h):
    """Row after row, until both constraints are within 1e-3."""
    G0 = jac(q)
    half = p - h / 2 * grad(q)
    q1 = q + h * W * half
    for _ in range(500):
        if np.max(np.abs(cons(q1))) < 1e-3:
            break
        for k in range(2):
            s = cons(q1)[k] / (jac(q1)[k] @ (W * G0[k]))
            q1 = q1 - W * G0[k] * s
            half = half - G0[k] * s / h
    return to_tangent(half - h / 2 * grad(q1), q1), q1


def massless_positions(p, q, h):
    """q is corrected by G^T s, without the inverse masses; p_half by the same impulse."""
    G0 = jac(q)
    half = p - h / 2 * grad(q)
    q1 = q + h * W * half
    for _ in range(100):
        s = G0.T @ np.linalg.solve(jac(q1) @ G0.T, cons(q1))
        q1 = q1 - s
        half = half - s / h
        if np.max(np.abs(s)) < 1e-15:
            break
    return to_tangent(half - h / 2 * grad(q1), q1), q1


def massless_condition(p, q, h):
    """At the end G p = 0 in place of G M^-1 p = 0."""
    half, q1 = to_surface(p - h / 2 * grad(q), q, h)
    p1 = half - h / 2 * grad(q1)
    G = jac(q1)
    return p1 - G.T @ np.linalg.solve(G @ G.T, G @ p1), q1


def p_is_v(p, q, h):
    """q' = p, p' = -M^-1 (U_q + G^T lam): right for velocities."""
    G0 = jac(q)
    half = p - h / 2 * W * grad(q)
    q1 = q + h * half
    for _ in range(60):
        s = W * (G0.T @ np.linalg.solve((jac(q1) * W) @ G0.T, cons(q1)))
        q1 = q1 - s
        half = half - s / h
        if np.max(np.abs(s)) < 1e-15:
            break
    p1 = half - h / 2 * W * grad(q1)
    G = jac(q1)
    return p1 - W * (G.T @ np.linalg.solve((G * W) @ G.T, G @ p1)), q1


def plus_multiplier(p, q, h):
    free = p - h / 2 * grad(q)
    right, q1 = to_surface(free, q, h)
    half = free - (right - free)
    return to_tangent(half - h / 2 * grad(q1), q1), q1


def free_then_projected(p, q, h):
    """Velocity Verlet as if there were no constraints, then positions and momenta projected, each once to the end."""
    half = p - h / 2 * grad(q)
    x = q + h * W * half
    p1 = half - h / 2 * grad(x)
    G = jac(x)
    q1 = x
    for _ in range(60):
        s = W * (G.T @ np.linalg.solve((jac(q1) * W) @ G.T, cons(q1)))
        q1 = q1 - s
        if np.max(np.abs(s)) < 1e-15:
            break
    return to_tangent(p1, q1), q1


def stabilised(p, q, h):
    """Velocity Verlet with Baumgarte's multiplier (alpha = beta = 8), at the end with the predicted momentum, iterated."""

    def force(p, q):
        v, G = W * p, jac(q)
        right = bend(q, v) + 16 * G @ v + 64 * cons(q) - G @ (W * grad(q))
        return -grad(q) - G.T @ np.linalg.solve((G * W) @ G.T, right)

    half = p + h / 2 * force(p, q)
    q1 = q + h * W * half
    p1 = half
    for _ in range(200):
        new = half + h / 2 * force(p1, q1)
        moved = np.max(np.abs(new - p1))
        p1 = new
        if moved < 1e-14:
            break
    return p1, q1


def reduced_verlet(p, q, h):
    """Multipliers from the twice differentiated constraints, Stoermer-Verlet with an implicit first half."""

    def force(p, q):
        v, G = W * p, jac(q)
        return -grad(q) - G.T @ np.linalg.solve((G * W) @ G.T, bend(q, v) - G @ (W * grad(q)))

    half = p
    for _ in range(200):
        new = p + h / 2 * force(half, q)
        moved = np.max(np.abs(new - half))
        half = new
        if moved < 1e-14:
            break
    q1 = q + h * W * half
    return half + h / 2 * force(half, q1), q1


def spring_is_weak(p, q, h):
    """The spring's gradient lost the term along z."""

    def lame(q):
        f = grad(q)
        f[5] = gravity * m2
        return f

    half, q1 = to_surface(p - h / 2 * lame(q), q, h)
    return to_tangent(half - h / 2 * lame(q1), q1), q1


def solve_one_too_far(p, q, h, t):
    """range(n + 1) steps where there should be n."""
    P, Q = [], []
    done = -1
    for time in t:
        n = int(np.rint(time / h))
        for _ in range(done + 1, n + 1):
            half, q1 = to_surface(p - h / 2 * grad(q), q, h)
            p, q = to_tangent(half - h / 2 * grad(q1), q1), q1
        done = n
        P.append(p)
        Q.append(q)
    return np.array(P), np.array(Q)
