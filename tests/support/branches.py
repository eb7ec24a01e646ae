"""The root of a step that continues the motion, by own code: its multiplier is followed from h = 0, with SciPy's root-finding."""

import numpy as np
from scipy.optimize import root

FIRST, LEAST = 1 / 16, 1e-6
"""The first part of the step, and the part below which the branch has an end."""

FREE = {
    "rattle": lambda h, v, a: h * v - h * h / 2 * a,
    "symplectic_euler": lambda h, v, a: h * v - h * h * a,
    "symplectic_euler_adjoint": lambda h, v, a: h * v,
}
"""The free flight of each scheme, from v = M^-1 p0 and a = M^-1 U_q(q0), HLW (1.25) and (1.19)."""


def continued(name, where, h):
    """Return q1 of g(q0 + dq(s h) - M^-1 G0^T nu) = 0 on the branch that begins at s = 0, nu = 0; None if that ends before s = 1.

    The branch has an end where G(q) M^-1 G0^T is singular. A part of the step is halved until the corrected nu is close to the predicted
    one, and until the determinant keeps its sign.
    """
    q0 = np.asarray(where.q0)
    inverse_mass = np.asarray(where.value("H_pp", where.p0, q0))
    v, a = inverse_mass @ where.p0, inverse_mass @ where.value("H_q", where.p0, q0)
    down = inverse_mass @ np.asarray(where.value("G", q0)).T
    size = np.abs(q0).max()

    def place(nu, s):
        return q0 + FREE[name](s * h, v, a) - down @ nu

    def matrix(nu, s):
        return -np.asarray(where.value("G", place(nu, s))) @ down

    nu, s, part = np.zeros(down.shape[1]), 0.0, FIRST
    sign = np.sign(np.linalg.det(matrix(nu, s)))
    while s < 1:
        there = min(1.0, s + part)
        fallen = np.asarray(where.value("G", place(nu, s))) @ (place(nu, there) - place(nu, s))
        guess = nu - np.linalg.solve(matrix(nu, s), fallen)
        solved = root(lambda x, t=there: where.value("g", place(x, t)), guess, jac=lambda x, t=there: matrix(x, t), tol=1e-13).x
        moved, off = np.abs(down @ (solved - nu)).max(), np.abs(down @ (solved - guess)).max()
        moved = max(moved, np.abs(place(nu, there) - place(nu, s)).max())
        met = (
            np.abs(np.linalg.solve(matrix(solved, there), where.value("g", place(solved, there)))) @ np.abs(down.T).max(axis=1)
            < 1e-9 * size
        )
        if met and off < 0.1 * moved + 1e-10 * size and np.sign(np.linalg.det(matrix(solved, there))) == sign:
            nu, s, part = solved, there, 1.5 * part
        elif part < LEAST:
            return None
        else:
            part /= 2
    return place(nu, 1.0)
