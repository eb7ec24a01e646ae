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


class correct_11:
    """Force and velocity kept within; the velocity of the half step is the corrected move over h."""

    def __init__(self):
        self.f = None
        self.iterations = 0

    def shake(self, new, old):
        for self.iterations in range(1, 3001):
            worst = 0.0
            for i, j, d2 in PAIRS:
                d = new[i] - new[j]
                o = old[i] - old[j]
                e = d2 - d.dot(d)
                worst = max(worst, abs(e) / d2)
                l = e / (2 * d.dot(o) * (im[i] + im[j]))
                new[i] += l * im[i] * o
                new[j] -= l * im[j] * o
            if worst < 1e-13:
                break
        return new

    def step(self, p, q, h):
        r = q.reshape(4, 3)
        if self.f is None:
            self.f = force(r)
        v = (p.reshape(4, 3) + h / 2 * self.f) * im[:, None]
        new = self.shake(r + h * v, r)
        v = (new - r) / h
        self.f = force(new)
        v = rattle_velocities(new, v + h / 2 * self.f * im[:, None], 1e-14)
        return (v * mass[:, None]).ravel(), new.ravel()


# ---------------------------------------------------------------- one mistake each


def reference_gradient_each_sweep_3(p, q, h):
    """SHAKE along the bonds of the current iterate."""
    ro = q.reshape(4, 3)
    v = (p.reshape(4, 3) + 0.5 * h * force(ro)) * im[:, None]
    r = ro + h * v
    for it in range(2000):
        conv = True
        for i, j, d2 in PAIRS:
            rij = r[i] - r[j]
            diff = rij.dot(rij) - d2
            if abs(diff) > 1e-13:
                conv = False
                gab = diff / (2 * (im[i] + im[j]) * rij.dot(rij))
                r[i] -= im[i] * gab * rij
                r[j] += im[j] * gab * rij
                v[i] -= im[i] * gab * rij / h
                v[j] += im[j] * gab * rij / h
        if conv:
            break
    v = rattle_velocities(r, v + 0.5 * h * force(r) * im[:, None])
    return (mass[:, None] * v).ravel(), r.ravel()


def velocity_not_projected_4(p, q, h):
    """SHAKE alone."""
    ro = q.reshape(4, 3)
    v = p.reshape(4, 3) * im[:, None] + 0.5 * h * force(ro) * im[:, None]
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
        if conv:
            break
    v = (r - ro) / h + 0.5 * h * force(r) * im[:, None]
    return (mass[:, None] * v).ravel(), r.ravel()


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


def one_sweep_4(p, q, h):
    """One pass over all pairs, for positions and for velocities."""
    ro = q.reshape(4, 3)
    v = (p.reshape(4, 3) + 0.5 * h * force(ro)) * im[:, None]
    r = ro + h * v
    for i, j, d2 in PAIRS:
        rij = r[i] - r[j]
        s = ro[i] - ro[j]
        gab = (rij.dot(rij) - d2) / (2 * (im[i] + im[j]) * rij.dot(s))
        r[i] -= im[i] * gab * s
        r[j] += im[j] * gab * s
        v[i] -= im[i] * gab * s / h
        v[j] += im[j] * gab * s / h
    v = v + 0.5 * h * force(r) * im[:, None]
    for i, j, d2 in PAIRS:
        rij = r[i] - r[j]
        k = rij.dot(v[i] - v[j]) / (d2 * (im[i] + im[j]))
        v[i] -= im[i] * k * rij
        v[j] += im[j] * k * rij
    return (mass[:, None] * v).ravel(), r.ravel()


def loose_tolerance_3(p, q, h, tol=1e-4):
    """Relative tolerance of MD programs; velocities to convergence."""
    ro = q.reshape(4, 3)
    v = (p.reshape(4, 3) + 0.5 * h * force(ro)) * im[:, None]
    r = ro + h * v
    for it in range(2000):
        conv = True
        for i, j, d2 in PAIRS:
            rij = r[i] - r[j]
            diff = rij.dot(rij) - d2
            if abs(diff) > 2 * tol * d2:
                conv = False
                s = ro[i] - ro[j]
                gab = diff / (2 * (im[i] + im[j]) * rij.dot(s))
                r[i] -= im[i] * gab * s
                r[j] += im[j] * gab * s
                v[i] -= im[i] * gab * s / h
                v[j] += im[j] * gab * s / h
        if conv:
            break
    v = rattle_velocities(r, v + 0.5 * h * force(r) * im[:, None])
    return (mass[:, None] * v).ravel(), r.ravel()


def loose_tolerance_4(p, q, h):
    """1e-6 for positions and for velocities."""
    ro = q.reshape(4, 3)
    v = (p.reshape(4, 3) + 0.5 * h * force(ro)) * im[:, None]
    r = ro + h * v
    err = 1.0
    while err > 1e-6:
        err = 0.0
        for i, j, d2 in PAIRS:
            rij = r[i] - r[j]
            s = ro[i] - ro[j]
            diff = rij.dot(rij) - d2
            err = max(err, abs(diff))
            gab = diff / (2 * (im[i] + im[j]) * rij.dot(s))
            r[i] -= im[i] * gab * s
            r[j] += im[j] * gab * s
            v[i] -= im[i] * gab * s / h
            v[j] += im[j] * gab * s / h
    v = rattle_velocities(r, v + 0.5 * h * force(r) * im[:, None], 1e-6)
    return (mass[:, None] * v).ravel(), r.ravel()


def mass_missing_in_position_3(p, q, h):
    """Unit masses in the position constraint, the impulse goes to the momenta."""
    ro = q.reshape(4, 3)
    mom = p.reshape(4, 3) + 0.5 * h * force(ro)
    r = ro + h * mom * im[:, None]
    for it in range(2000):
        conv = True
        for i, j, d2 in PAIRS:
            rij = r[i] - r[j]
            diff = rij.dot(rij) - d2
            if abs(diff) > 1e-13:
                conv = False
                s = ro[i] - ro[j]
                gab = diff / (4 * rij.dot(s))
                r[i] -= gab * s
                r[j] += gab * s
                mom[i] -= gab * s / h
                mom[j] += gab * s / h
        if conv:
            break
    mom = mom + 0.5 * h * force(r)
    v = rattle_velocities(r, mom * im[:, None])
    return (mass[:, None] * v).ravel(), r.ravel()


def multiplier_half_3(p, q, h):
    """The factor 2 of the denominator is missing in what the velocities get."""
    ro = q.reshape(4, 3)
    v = (p.reshape(4, 3) + 0.5 * h * force(ro)) * im[:, None]
    r = ro + h * v
    for it in range(2000):
        conv = True
        for i, j, d2 in PAIRS:
            rij = r[i] - r[j]
            diff = rij.dot(rij) - d2
            if abs(diff) > 1e-13:
                conv = False
                s = ro[i] - ro[j]
                lam = diff / ((im[i] + im[j]) * rij.dot(s))
                r[i] -= 0.5 * im[i] * lam * s
                r[j] += 0.5 * im[j] * lam * s
                v[i] -= im[i] * lam * s / h
                v[j] += im[j] * lam * s / h
        if conv:
            break
    v = rattle_velocities(r, v + 0.5 * h * force(r) * im[:, None])
    return (mass[:, None] * v).ravel(), r.ravel()


def index_reduced_4(p, q, h):
    """Velocity Verlet, constraint forces from the matrix of all pairs."""

    def acc(x, v):
        r, u = x.reshape(4, 3), v.reshape(4, 3)
        J = jacobian(r)
        b = np.array([2 * (u[i] - u[j]).dot(u[i] - u[j]) for i, j, _ in PAIRS])
        f = force(r).ravel()
        lam = np.linalg.solve((J * W12) @ J.T, J @ (W12 * f) + b)
        return W12 * (f - J.T @ lam)

    v = p * W12
    a = acc(q, v)
    x = q + h * v + 0.5 * h * h * a
    a1 = acc(x, v + h * a)
    v = v + 0.5 * h * (a + a1)
    return v / W12, x


class step_off_by_one_4:
    """Has its own state; the positions given back are new, the momenta those of before."""

    def __init__(self):
        self.now = None

    def step(self, p, q, h):
        if self.now is None:
            self.now = p, q
        old_p, old_q = self.now
        self.now = mshake(old_p, old_q, h)
        return old_p.copy(), self.now[1].copy()


# ---------------------------------------------------------------- others


def other_5(p, q, h):
    """C4 = 24.26."""

    def force(r):
        d = r[3] - r[0]
        c = (d.dot(d) - A_OUT**2) / (2 * B_OUT2) - 1
        dU = C[1] + c * (2 * C[2] + c * (3 * C[3] + c * (4 * 24.26 + c * 5 * C[5])))
        f = np.zeros((4, 3))
        f[0] = dU * d / B_OUT2
        f[3] = -f[0]
        return f

    ro = q.reshape(4, 3)
    v = p.reshape(4, 3) * im[:, None] + 0.5 * h * force(ro) * im[:, None]
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
    v = rattle_velocities(r, v + 0.5 * h * force(r) * im[:, None])
    return (mass[:, None] * v).ravel(), r.ravel()
