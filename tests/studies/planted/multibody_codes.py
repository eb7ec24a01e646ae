"""Pendulum chain of three links and the four-bar linkage as a multibody code writes them: dense matrices and KKT systems."""

import numpy as np


class Chain:
    """Three unit masses on unit rods in the plane."""

    n = 6
    M = np.eye(6)
    gravity = 9.81

    def dU(self, q):
        f = np.zeros(6)
        f[1::2] = self.gravity
        return f

    def g(self, q):
        r = np.vstack([[0.0, 0.0], q.reshape(3, 2)])
        d = r[1:] - r[:-1]
        return (d**2).sum(axis=1) - 1

    def G(self, q):
        r = np.vstack([[0.0, 0.0], q.reshape(3, 2)])
        d = 2 * (r[1:] - r[:-1])
        J = np.zeros((3, 6), dtype=q.dtype)
        for k in range(3):
            J[k, 2 * k : 2 * k + 2] = d[k]
            if k:
                J[k, 2 * k - 2 : 2 * k] = -d[k]
        return J

    def curvature(self, v):
        u = np.vstack([[0.0, 0.0], v.reshape(3, 2)])
        return 2 * ((u[1:] - u[:-1]) ** 2).sum(axis=1)


class FourBar:
    """Three uprights and two couplers, uniform bars of 1 kg and 1 m."""

    n = 6
    M = np.kron(np.array([[4, 1, 0], [1, 6, 1], [0, 1, 4]]) / 6.0, np.eye(2))
    gravity = 9.81

    def dU(self, q):
        return self.gravity * np.array([0, 1, 0, 1.5, 0, 1])

    def g(self, q):
        x, y = q[0::2], q[1::2]
        up = [(x[k] - k) ** 2 + y[k] ** 2 - 1 for k in range(3)]
        across = [(x[k + 1] - x[k]) ** 2 + (y[k + 1] - y[k]) ** 2 - 1 for k in range(2)]
        return np.array(up + across)

    def G(self, q):
        x, y = q[0::2], q[1::2]
        J = np.zeros((5, 6), dtype=q.dtype)
        for k in range(3):
            J[k, 2 * k], J[k, 2 * k + 1] = 2 * (x[k] - k), 2 * y[k]
        for k in range(2):
            dx, dy = 2 * (x[k + 1] - x[k]), 2 * (y[k + 1] - y[k])
            J[3 + k, 2 * k : 2 * k + 4] = [-dx, -dy, dx, dy]
        return J


CHAIN, FOURBAR = Chain(), FourBar()


def kkt(A, B, C, a, b):
    """Solve A x + B^T y = a, C x = b."""
    m = len(b)
    big = np.block([[A, B.T], [C, np.zeros((m, m))]])
    x = np.linalg.solve(big, np.concatenate([a, b]))
    return x[: len(a)], x[len(a) :]


def positions(sys, p, q, h, last=1e-15, most=60):
    """Return p_half, q1: Newton on q1 and the multipliers, stopped when the positions no longer move."""
    G0 = sys.G(q)
    p0 = p - h / 2 * sys.dU(q)
    q1 = q + h * np.linalg.solve(sys.M, p0)
    lam = np.zeros(len(G0))
    for _ in range(most):
        rest = sys.M @ (q1 - q) - h * p0 + h * h / 2 * G0.T @ lam
        dq, dl = kkt(sys.M, h * h / 2 * G0, sys.G(q1), -rest, -sys.g(q1))
        q1 = q1 + dq
        lam = lam + dl
        if np.max(np.abs(dq)) < last:
            break
    return p0 - h / 2 * G0.T @ lam, q1


def momenta(sys, p, q):
    """Return p with the component against the constraints taken out."""
    v, _ = kkt(sys.M, sys.G(q), sys.G(q), p, np.zeros(len(sys.G(q))))
    return sys.M @ v


def correct_fourbar(p, q, h):
    half, q1 = positions(FOURBAR, p, q, h)
    return momenta(FOURBAR, half - h / 2 * FOURBAR.dU(q1), q1), q1


def correct_chain_sweeps(p, q, h):
    """Rod after rod until all are right."""
    G0 = CHAIN.G(q)
    half = p - h / 2 * CHAIN.dU(q)
    q1 = q + h * half
    for _ in range(3000):
        for k in range(3):
            miss, row = CHAIN.g(q1)[k], CHAIN.G(q1)[k]
            s = miss / (row @ G0[k])
            q1 = q1 - s * G0[k]
            half = half - s * G0[k] / h
        if np.max(np.abs(CHAIN.g(q1))) < 2e-15 * 4:
            break
    p1 = half - h / 2 * CHAIN.dU(q1)
    G1 = CHAIN.G(q1)
    for _ in range(3000):
        for row in G1:
            p1 = p1 - row * (row @ p1) / (row @ row)
        if np.max(np.abs(G1 @ p1)) < 1e-14:
            break
    return p1, q1


def chain_momentum_left_alone(p, q, h):
    """Positions are put right, and the momentum at the half step is that of the free motion."""
    free = p - h / 2 * CHAIN.dU(q)
    _, q1 = positions(CHAIN, p, q, h)
    return momenta(CHAIN, free - h / 2 * CHAIN.dU(q1), q1), q1


def chain_no_velocity_stage(p, q, h):
    half, q1 = positions(CHAIN, p, q, h)
    return half - h / 2 * CHAIN.dU(q1), q1


def chain_loose(p, q, h):
    """Chord iteration with the matrix of the start of the step, given up at 1e-5."""
    G0 = CHAIN.G(q)
    half = p - h / 2 * CHAIN.dU(q)
    q1 = q + h * half
    A = G0 @ G0.T
    for _ in range(100):
        miss = CHAIN.g(q1)
        if np.max(np.abs(miss)) < 1e-5:
            break
        dl = np.linalg.solve(A, miss)
        q1 = q1 - G0.T @ dl
        half = half - G0.T @ dl / h
    return momenta(CHAIN, half - h / 2 * CHAIN.dU(q1), q1), q1


def chain_half_impulse(p, q, h):
    """The impulse of the rods enters with h/4."""
    free = p - h / 2 * CHAIN.dU(q)
    right, q1 = positions(CHAIN, p, q, h)
    impulse = right - free
    return momenta(CHAIN, free + impulse / 2 - h / 2 * CHAIN.dU(q1), q1), q1


def fourbar_identity_in_positions(p, q, h):
    """The correction of the positions uses the unit matrix where M^-1 belongs, in dq and in its matrix; the impulse is G^T lam."""
    G0 = FOURBAR.G(q)
    half = p - h / 2 * FOURBAR.dU(q)
    free = q + h * np.linalg.solve(FOURBAR.M, half)
    lam = np.zeros(5)
    q1 = free
    for _ in range(100):
        dl = np.linalg.solve(FOURBAR.G(q1) @ G0.T, FOURBAR.g(q1)) * 2 / h**2
        lam = lam + dl
        new = free - h * h / 2 * G0.T @ lam
        moved = np.max(np.abs(new - q1))
        q1 = new
        if moved < 1e-15:
            break
    half = half - h / 2 * G0.T @ lam
    return momenta(FOURBAR, half - h / 2 * FOURBAR.dU(q1), q1), q1


def fourbar_identity_in_velocities(p, q, h):
    """Velocities are projected orthogonally, as if the mass matrix were the unit matrix."""
    half, q1 = positions(FOURBAR, p, q, h)
    v = np.linalg.solve(FOURBAR.M, half - h / 2 * FOURBAR.dU(q1))
    J = FOURBAR.G(q1)
    v = v - J.T @ np.linalg.solve(J @ J.T, J @ v)
    return FOURBAR.M @ v, q1


def fourbar_reduced_verlet(p, q, h):
    """Multipliers from the accelerations, Stoermer-Verlet with an implicit first half: on quadratic constraints the same as RATTLE."""
    return _verlet(FOURBAR, p, q, h)


def _multipliers(sys, p, q):
    v = np.linalg.solve(sys.M, p)
    J = sys.G(q)
    if isinstance(sys, Chain):
        bent = sys.curvature(v)
    else:
        x, y = v[0::2], v[1::2]
        bent = np.array(
            [2 * (x[k] ** 2 + y[k] ** 2) for k in range(3)] + [2 * ((x[k + 1] - x[k]) ** 2 + (y[k + 1] - y[k]) ** 2) for k in range(2)]
        )
    A = J @ np.linalg.solve(sys.M, J.T)
    return J, np.linalg.solve(A, bent - J @ np.linalg.solve(sys.M, sys.dU(q)))


def _force(sys, p, q):
    J, lam = _multipliers(sys, p, q)
    return -sys.dU(q) - J.T @ lam


def fourbar_reduced_euler(p, q, h):
    """Multipliers from the accelerations, and symplectic Euler."""
    P = p
    for _ in range(300):
        new = p + h * _force(FOURBAR, P, q)
        moved = np.max(np.abs(new - P))
        P = new
        if moved < 1e-15:
            break
    return P, q + h * np.linalg.solve(FOURBAR.M, P)


def _verlet(sys, p, q, h):
    half = p
    for _ in range(200):
        new = p + h / 2 * _force(sys, half, q)
        moved = np.max(np.abs(new - half))
        half = new
        if moved < 1e-15:
            break
    q1 = q + h * np.linalg.solve(sys.M, half)
    return half + h / 2 * _force(sys, half, q1), q1


def chain_midpoint_on_reduced(p, q, h):
    """Implicit midpoint rule on the equations with lam(p, q)."""
    P, Q = p, q
    for _ in range(300):
        mp, mq = (p + P) / 2, (q + Q) / 2
        Pn, Qn = p + h * _force(CHAIN, mp, mq), q + h * mp
        moved = max(np.max(np.abs(Pn - P)), np.max(np.abs(Qn - Q)))
        P, Q = Pn, Qn
        if moved < 2e-15:
            break
    return P, Q


def chain_euler_then_projection(p, q, h):
    """Symplectic Euler on the equations with lam(p, q), then back to the manifold at right angles, positions first."""
    P = p
    for _ in range(300):
        new = p + h * _force(CHAIN, P, q)
        moved = np.max(np.abs(new - P))
        P = new
        if moved < 1e-15:
            break
    Q = q + h * P
    J = CHAIN.G(Q)
    for _ in range(50):
        d = J.T @ np.linalg.solve(CHAIN.G(Q) @ J.T, CHAIN.g(Q))
        Q = Q - d
        if np.max(np.abs(d)) < 1e-15:
            break
    J = CHAIN.G(Q)
    return P - J.T @ np.linalg.solve(J @ J.T, J @ P), Q


def chain_baumgarte_rk4(p, q, h, alpha=5.0, beta=5.0):
    """Stabilised accelerations under the classical Runge-Kutta method."""

    def rhs(p, q):
        J = CHAIN.G(q)
        right = CHAIN.curvature(p) + 2 * alpha * J @ p + beta**2 * CHAIN.g(q) - J @ CHAIN.dU(q)
        return -CHAIN.dU(q) - J.T @ np.linalg.solve(J @ J.T, right), p

    a1, b1 = rhs(p, q)
    a2, b2 = rhs(p + h / 2 * a1, q + h / 2 * b1)
    a3, b3 = rhs(p + h / 2 * a2, q + h / 2 * b2)
    a4, b4 = rhs(p + h * a3, q + h * b3)
    return p + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4), q + h / 6 * (b1 + 2 * b2 + 2 * b3 + b4)


class UpsideDown(Chain):
    gravity = -9.81


def chain_falls_upwards(p, q, h):
    sys = UpsideDown()
    half, q1 = positions(sys, p, q, h)
    return momenta(sys, half - h / 2 * sys.dU(q1), q1), q1


class ChainVerletShake:
    """SHAKE with a memory of the position before: q1 - 2 q + q_before, and a momentum carried to the end of the step by the force alone."""

    def __init__(self):
        self.before = None

    def step(self, p, q, h):
        if self.before is None or self.before[1] != h or not np.array_equal(self.before[2], q):
            half, q1 = positions(CHAIN, p, q, h)
        else:
            old = self.before[0]
            G0 = CHAIN.G(q)
            free = 2 * q - old - h * h * CHAIN.dU(q)
            q1, change = free, 0.0
            for _ in range(60):
                change = G0.T @ np.linalg.solve(CHAIN.G(q1) @ G0.T, CHAIN.g(q1))
                q1 = q1 - change
                if np.max(np.abs(change)) < 1e-15:
                    break
            half = (q1 - q) / h
        self.before = (q.copy(), h, q1.copy())
        return half - h / 2 * CHAIN.dU(q1), q1


def chain_solve_one_short(p, q, h, t):
    """The loop writes a state down before it takes the step."""
    wanted = np.rint(np.asarray(t) / h).astype(int)
    P, Q = [], []
    for k in range(1, wanted.max() + 1):
        if k in wanted:
            P.append(p)
            Q.append(q)
        half, q1 = positions(CHAIN, p, q, h)
        p, q = momenta(CHAIN, half - h / 2 * CHAIN.dU(q1), q1), q1
    return np.array(P), np.array(Q)
