"""Double spherical pendulum the way a molecular dynamics code writes it: atoms, bonds, SHAKE/RATTLE in velocities, bond after bond.

Atom 0 is the pivot (inverse mass 0), atom 1 has 2 kg, atom 2 has 0.5 kg.
"""

import numpy as np

MASS = np.array([2.0, 0.5])
INV = np.array([0.0, 1 / 2.0, 1 / 0.5])
BONDS = [(0, 1), (1, 2)]
D2 = 1.0
GRAV = 9.81
TOL = 1e-14
MAXIT = 500


def unpack(p, q):
    r = np.vstack([np.zeros((1, 3)), q.reshape(2, 3)])
    v = np.vstack([np.zeros((1, 3)), p.reshape(2, 3) / MASS[:, None]])
    return r, v


def pack(r, v):
    return (v[1:] * MASS[:, None]).ravel(), r[1:].ravel().copy()


def accel(r):
    a = np.zeros_like(r)
    a[1:, 2] = -GRAV
    return a


def shake(r, rn, v, h, tol=TOL, sweeps=MAXIT):
    """Correct rn and v along the bonds of r."""
    for _ in range(sweeps):
        worst = 0.0
        for i, j in BONDS:
            ref = r[j] - r[i]
            s = rn[j] - rn[i]
            diff = s @ s - D2
            worst = max(worst, abs(diff))
            gk = diff / (2 * (INV[i] + INV[j]) * (s @ ref))
            for atom, sign in ((j, -1.0), (i, 1.0)):
                rn[atom] += sign * gk * INV[atom] * ref
                v[atom] += sign * gk * INV[atom] * ref / h
        if worst < tol:
            break


def rattle_velocities(r, v, tol=TOL):
    for _ in range(MAXIT):
        worst = 0.0
        for i, j in BONDS:
            s = r[j] - r[i]
            rv = s @ (v[j] - v[i])
            worst = max(worst, abs(rv))
            k = rv / ((INV[i] + INV[j]) * (s @ s))
            v[j] -= INV[j] * k * s
            v[i] += INV[i] * k * s
        if worst < tol:
            break


def correct_andersen(p, q, h):
    r, v = unpack(p, q)
    v = v + h / 2 * accel(r)
    v[0] = 0
    rn = r + h * v
    shake(r, rn, v, h)
    v = v + h / 2 * accel(rn)
    rattle_velocities(rn, v)
    return pack(rn, v)


def correct_tol10(p, q, h):
    r, v = unpack(p, q)
    v = v + h / 2 * accel(r)
    rn = r + h * v
    shake(r, rn, v, h, tol=1e-10)
    v = v + h / 2 * accel(rn)
    rattle_velocities(rn, v, tol=1e-10)
    return pack(rn, v)


def each_sweep(p, q, h):
    """The bond along which atoms are moved is that of the moment, not that at the start of the step."""
    r, v = unpack(p, q)
    v = v + h / 2 * accel(r)
    rn = r + h * v
    for _ in range(MAXIT):
        worst = 0.0
        for i, j in BONDS:
            s = rn[j] - rn[i]
            diff = s @ s - D2
            worst = max(worst, abs(diff))
            gk = diff / (2 * (INV[i] + INV[j]) * (s @ s))
            rn[j] -= gk * INV[j] * s
            rn[i] += gk * INV[i] * s
            v[j] -= gk * INV[j] * s / h
            v[i] += gk * INV[i] * s / h
        if worst < TOL:
            break
    v = v + h / 2 * accel(rn)
    rattle_velocities(rn, v)
    return pack(rn, v)


def gradient_at_end(p, q, h):
    """Outer loop: bonds of the last answer serve as directions, until these no longer change."""
    r, v0 = unpack(p, q)
    v0 = v0 + h / 2 * accel(r)
    ref = r
    for _ in range(100):
        v = v0.copy()
        rn = r + h * v
        shake(ref, rn, v, h)
        change = np.max(np.abs(rn - ref))
        ref = rn
        if change < 1e-14:
            break
    v = v + h / 2 * accel(rn)
    rattle_velocities(rn, v)
    return pack(rn, v)


def single_sweep(p, q, h):
    r, v = unpack(p, q)
    v = v + h / 2 * accel(r)
    rn = r + h * v
    shake(r, rn, v, h, sweeps=1)
    v = v + h / 2 * accel(rn)
    rattle_velocities(rn, v)
    return pack(rn, v)


def loose(p, q, h):
    r, v = unpack(p, q)
    v = v + h / 2 * accel(r)
    rn = r + h * v
    shake(r, rn, v, h, tol=1e-4)
    v = v + h / 2 * accel(rn)
    rattle_velocities(rn, v, tol=1e-4)
    return pack(rn, v)


def doubled_kick(p, q, h):
    r, v = unpack(p, q)
    v = v + h * accel(r)
    rn = r + h * v
    shake(r, rn, v, h)
    v = v + h * accel(rn)
    rattle_velocities(rn, v)
    return pack(rn, v)


def equal_shares(p, q, h):
    """SHAKE that moves both ends of a bond by the same amount, whatever their masses; velocities follow the positions."""
    r, v = unpack(p, q)
    v = v + h / 2 * accel(r)
    rn = r + h * v
    free = np.array([0.0, 1.0, 1.0])
    for _ in range(MAXIT):
        worst = 0.0
        for i, j in BONDS:
            ref = r[j] - r[i]
            s = rn[j] - rn[i]
            diff = s @ s - D2
            worst = max(worst, abs(diff))
            gk = diff / (2 * (free[i] + free[j]) * (s @ ref))
            rn[j] -= gk * free[j] * ref
            rn[i] += gk * free[i] * ref
        if worst < TOL:
            break
    v = (rn - r) / h
    v = v + h / 2 * accel(rn)
    rattle_velocities(rn, v)
    return pack(rn, v)


def equal_shares_velocity(p, q, h):
    """The velocity half moves both ends of a bond alike."""
    r, v = unpack(p, q)
    v = v + h / 2 * accel(r)
    rn = r + h * v
    shake(r, rn, v, h)
    v = v + h / 2 * accel(rn)
    free = np.array([0.0, 1.0, 1.0])
    for _ in range(MAXIT):
        worst = 0.0
        for i, j in BONDS:
            s = rn[j] - rn[i]
            rv = s @ (v[j] - v[i])
            worst = max(worst, abs(rv))
            k = rv / ((free[i] + free[j]) * (s @ s))
            v[j] -= free[j] * k * s
            v[i] += free[i] * k * s
        if worst < TOL:
            break
    return pack(rn, v)


def momenta_taken_as_velocities(p, q, h):
    r = np.vstack([np.zeros((1, 3)), q.reshape(2, 3)])
    v = np.vstack([np.zeros((1, 3)), p.reshape(2, 3)])
    v = v + h / 2 * accel(r)
    rn = r + h * v
    shake(r, rn, v, h)
    v = v + h / 2 * accel(rn)
    rattle_velocities(rn, v)
    return v[1:].ravel().copy(), rn[1:].ravel().copy()


def wrong_sign(p, q, h):
    """The impulse of the bonds reaches the velocities with the opposite sign."""
    r, v = unpack(p, q)
    v = v + h / 2 * accel(r)
    free = r + h * v
    rn = free.copy()
    shake(r, rn, v.copy(), h)
    v = v - (rn - free) / h
    v = v + h / 2 * accel(rn)
    rattle_velocities(rn, v)
    return pack(rn, v)


def other_gravity_constant(p, q, h):
    """Gravity typed as 8.91."""
    r, v = unpack(p, q)
    pull = np.array([[0, 0, 0], [0, 0, -8.91], [0, 0, -8.91]])
    v = v + h / 2 * pull
    rn = r + h * v
    shake(r, rn, v, h)
    v = v + h / 2 * pull
    rattle_velocities(rn, v)
    return pack(rn, v)


def soft_contact(p, q, h):
    """A game's solver: velocities solved with a bias that takes back a fifth of the stretch in every step, positions never touched."""
    r, v = unpack(p, q)
    v = v + h * accel(r)
    v[0] = 0
    for _ in range(MAXIT):
        worst = 0.0
        for i, j in BONDS:
            s = r[j] - r[i]
            stretch = (s @ s - D2) / 2
            rv = s @ (v[j] - v[i]) + 0.2 / h * stretch
            worst = max(worst, abs(rv))
            k = rv / ((INV[i] + INV[j]) * (s @ s))
            v[j] -= INV[j] * k * s
            v[i] += INV[i] * k * s
        if worst < 1e-14:
            break
    return pack(r + h * v, v)
