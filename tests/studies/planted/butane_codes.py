"""Steps for butane with rigid bonds and angles, in the manner of MD programs: r has shape (4, 3)."""

import math

import numpy as np

mass = np.array([15.035, 14.027, 14.027, 15.035])
im = 1.0 / mass
B = 1.53
THETA = math.radians(109.47)
B2 = B * B
D2 = 2 * B2 * (1 - math.cos(THETA))
PAIRS = [(0, 1, B2), (1, 2, B2), (2, 3, B2), (0, 2, D2), (1, 3, D2)]
C = (9.28, 12.16, -13.12, -3.06, 26.24, -31.50)
A_OUT = B * (1 - 2 * math.cos(THETA))
B_OUT2 = (B * math.sin(THETA)) ** 2


def force(r):
    d = r[3] - r[0]
    c = (d.dot(d) - A_OUT**2) / (2 * B_OUT2) - 1
    dU = C[1] + c * (2 * C[2] + c * (3 * C[3] + c * (4 * C[4] + c * 5 * C[5])))
    f = np.zeros((4, 3))
    f[0] = dU * d / B_OUT2
    f[3] = -f[0]
    return f


def rattle_velocities(r, v, eps=1e-13):
    v = v.copy()
    for _ in range(2000):
        ok = True
        for i, j, d2 in PAIRS:
            rij = r[i] - r[j]
            rv = rij.dot(v[i] - v[j])
            if abs(rv) > eps:
                ok = False
                k = rv / (d2 * (im[i] + im[j]))
                v[i] -= im[i] * k * rij
                v[j] += im[j] * k * rij
        if ok:
            break
    return v


# ---------------------------------------------------------------- correct


def correct_9(p, q, h):
    """SHAKE and RATTLE loops, to 1e-12."""
    ro = q.reshape(4, 3)
    v = p.reshape(4, 3) * im[:, None]
    v = v + 0.5 * h * force(ro) * im[:, None]
    r = ro + h * v
    for it in range(2000):
        conv = True
        for i, j, d2 in PAIRS:
            rij = r[i] - r[j]
            diff = rij.dot(rij) - d2
            if abs(diff) > 1e-12:
                conv = False
                s = ro[i] - ro[j]
                gab = diff / (2 * (im[i] + im[j]) * rij.dot(s))
                r[i] -= im[i] * gab * s
                r[j] += im[j] * gab * s
                v[i] -= im[i] * gab * s / h
                v[j] += im[j] * gab * s / h
        if conv:
            break
    v = v + 0.5 * h * force(r) * im[:, None]
    v = rattle_velocities(r, v, 1e-12)
    return (mass[:, None] * v).ravel(), r.ravel()


def jacobian(r):
    J = np.zeros((5, 12))
    for k, (i, j, _) in enumerate(PAIRS):
        d = 2 * (r[i] - r[j])
        J[k, 3 * i : 3 * i + 3] = d
        J[k, 3 * j : 3 * j + 3] = -d
    return J


def residual(r):
    return np.array([(r[i] - r[j]).dot(r[i] - r[j]) - d2 for i, j, d2 in PAIRS])


W12 = np.repeat(im, 3)


def mshake(p, q, h):
    """Matrix SHAKE: Newton for all five multipliers."""
    J0 = jacobian(q.reshape(4, 3))
    v = p * W12 + h / 2 * force(q.reshape(4, 3)).ravel() * W12
    x = q + h * v
    for _ in range(50):
        s = residual(x.reshape(4, 3))
        if abs(s).max() < 2e-14:
            break
        dx = W12 * (J0.T @ np.linalg.solve((jacobian(x.reshape(4, 3)) * W12) @ J0.T, s))
        x = x - dx
        v = v - dx / h
    v = v + h / 2 * force(x.reshape(4, 3)).ravel() * W12
    J = jacobian(x.reshape(4, 3))
    v = v - W12 * (J.T @ np.linalg.solve((J * W12) @ J.T, J @ v))
    return v / W12, x


def correct_10(p, q, h, t):
    """A whole run."""
    P, Q = np.empty((len(t), 12)), np.empty((len(t), 12))
    n = 0
    for k, time in enumerate(t):
        while n < round(time / h):
            p, q = mshake(p, q, h)
            n += 1
        P[k], Q[k] = p, q
    return P, Q


# ---------------------------------------------------------------- one mistake each


def old_force_3(p, q, h):
    ro = q.reshape(4, 3)
    f = force(ro)
    v = p.reshape(4, 3) * im[:, None] + 0.5 * h * f * im[:, None]
    r = ro + h * v
    for it in range(2000):
        conv = True
        for i, j, d2 in PAIRS:
            rij = r[i] - r[j]
            diff = rij.dot(rij) - d2
            if abs(diff) > 1e-13:
                conv = False
                s = ro[i] - ro[j]
                gab = diff / (2 * (im[i] + im[j]) * rij.dot(s))
                r[i] -= im[i] * gab * s
                r[j] += im[j] * gab * s
                v[i] -= im[i] * gab * s / h
                v[j] += im[j] * gab * s / h
        if conv:
            break
    v = rattle_velocities(r, v + 0.5 * h * f * im[:, None])
    return (mass[:, None] * v).ravel(), r.ravel()


# ---------------------------------------------------------------- others
