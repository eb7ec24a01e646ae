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


# ---- any Hamiltonian -----------------------------------------------------------------------------------------------------


def equations(name, where, x, h):
    """Return the residual of (1.26), or of (1.19) or its adjoint, for x = (p, q1 - q0, lam): up to the position, with any H."""
    p0, q0, d = np.asarray(where.p0), np.asarray(where.q0), len(where.q0)
    p, dq, lam = x[:d], x[d : 2 * d], x[2 * d :]
    pull = np.asarray(where.value("G", q0)).T @ lam
    H_q, H_p = (lambda q, what=what: np.asarray(where.value(what, p, q)) for what in ("H_q", "H_p"))
    kick, drift = {
        "rattle": lambda: (h / 2 * (H_q(q0) + pull), h / 2 * (H_p(q0) + H_p(q0 + dq))),
        "symplectic_euler": lambda: (h * (H_q(q0) + pull), h * H_p(q0)),
        "symplectic_euler_adjoint": lambda: (h * pull, h * H_p(q0 + dq)),
    }[name]()
    return np.concatenate([p - p0 + kick, dq - drift, where.value("g", q0 + dq)])


def _jacobian(name, where, x, h, sizes):
    steps = 1e-6 * sizes
    columns = [(equations(name, where, x + e, h) - equations(name, where, x - e, h)) / (2 * e.max()) for e in np.diag(steps)]
    return np.array(columns).T


def followed(name, where, h, first=1 / 32, least=1e-5):
    """Return q1 on the branch of the equations that begins at h = 0 with lam of the motion; None if that ends before h.

    The multiplier is that of the motion at first. A part of h is halved until the corrected point is close to the predicted one, and until
    the determinant keeps its sign.
    """
    p0, q0, d = np.asarray(where.p0), np.asarray(where.q0), len(where.q0)
    lam = np.asarray(where.value("lam", p0, q0))
    small = 1e-3 * h
    size = np.abs(q0).max()
    x = np.concatenate([p0, small * np.asarray(where.value("H_p", p0, q0)), lam])
    sizes = np.concatenate([np.full(d, np.abs(p0).max() + 1e-3), np.full(d, size), np.full(len(lam), np.abs(lam).max() + 1e-3)])

    def corrected(x, at):
        for _ in range(20):
            change = np.linalg.solve(_jacobian(name, where, x, at, sizes), equations(name, where, x, at))
            x = x - change
            if np.abs(change / sizes).max() < 1e-13:
                break
        return x, np.abs(change / sizes).max()

    x, _ = corrected(x, small)
    at, part, before = small, first * h, None
    sign = np.sign(np.linalg.det(_jacobian(name, where, x, at, sizes)))
    while at < h:
        there = min(h, at + part)
        guess = x if before is None else x + (there - at) / (at - before[0]) * (x - before[1])
        solved, left = corrected(guess, there)
        off = np.abs((solved - guess) / sizes)[d : 2 * d].max()
        near = off < 0.1 * np.abs((solved - x) / sizes)[d : 2 * d].max() + 1e-9
        if (near or before is None) and left < 1e-9 and np.sign(np.linalg.det(_jacobian(name, where, solved, there, sizes))) == sign:
            before, x, at, part = (at, x), solved, there, 1.5 * part
        elif part < least * h:
            return None
        else:
            part /= 2
    return q0 + x[d : 2 * d]


# ---- Lobatto IIIA-IIIB ---------------------------------------------------------------------------------------------------


class Stages:
    """The equations of Lobatto IIIA-IIIB of three stages, HLW (1.27)-(1.30), for x = (P_i - p0, Q_i - q0 from i = 2, Lam_1, Lam_2)."""

    A = np.array([[0, 0, 0], [5 / 24, 1 / 3, -1 / 24], [1 / 6, 2 / 3, 1 / 6]])
    B = np.array([[1 / 6, -1 / 6], [1 / 6, 1 / 3], [1 / 6, 5 / 6]])
    """Coefficients of IIIA, and those of IIIB but the last column, which is zero."""

    def __init__(self, where):
        self.where, self.p0, self.q0 = where, np.asarray(where.p0), np.asarray(where.q0)
        self.lam = np.asarray(where.value("lam", where.p0, where.q0))
        d = len(self.q0)
        self.cuts = (3 * d, 5 * d)
        self.sizes = np.repeat([np.abs(part).max() + 1e-3 for part in (self.p0, self.q0, self.lam)], [3 * d, 2 * d, 2 * len(self.lam)])

    def start(self, h):
        v = np.asarray(self.where.value("H_p", self.p0, self.q0))
        return np.concatenate([np.zeros(self.cuts[0]), h / 2 * v, h * v, self.lam, self.lam])

    def __call__(self, x, h):
        parts = np.split(x, self.cuts)
        P, Q = self.p0 + parts[0].reshape(3, -1), self.q0 + np.concatenate([0 * self.q0, parts[1]]).reshape(3, -1)
        Lam = parts[2].reshape(2, -1)
        values = {what: [np.asarray(self.where.value(what, p, q)) for p, q in zip(P, Q, strict=True)] for what in ("H_q", "H_p")}
        force = np.array([values["H_q"][k] + np.asarray(self.where.value("G", Q[k])).T @ Lam[k] for k in range(2)])
        off = (Q - self.q0 - h * self.A @ np.array(values["H_p"]))[1:]
        return np.concatenate([(P - self.p0 + h * self.B @ force).ravel(), off.ravel(), *(self.where.value("g", q) for q in Q[1:])])

    def turned(self, x, h):
        """Return the derivative by x."""
        here = self(x, h)
        return np.array([(self(x + e, h) - here) / e.max() for e in np.diag(1e-6 * self.sizes)]).T

    def corrected(self, x, h):
        """Return the solution near x and the derivative there, None if Newton's iteration does not end; every third matrix is new."""
        turned = self.turned(x, h)
        for iteration in range(1, 36):
            change = np.linalg.solve(turned, self(x, h))
            x = x - change
            if np.abs(change / self.sizes).max() < 1e-11:
                return x, turned
            if iteration % 3 == 0:
                turned = self.turned(x, h)
        return None


def lobatto3_continued(where, h, parts=24):
    """Return q1 of lobatto3 on the branch that begins at h = 0, followed in equal parts along its tangent; None if that ends before h."""
    stages, part = Stages(where), h / parts
    found = stages.corrected(stages.start(part), part)
    for at in part * np.arange(1, parts):
        if found is None:
            return None
        x, turned = found
        guess = x - part * np.linalg.solve(turned, (stages(x, at + 1e-6 * h) - stages(x, at - 1e-6 * h)) / (2e-6 * h))
        found = stages.corrected(guess, at + part)
        if found is not None and np.abs((found[0] - guess) / stages.sizes)[slice(*stages.cuts)].max() > 0.1:
            return None
    return None if found is None else where.q0 + found[0][slice(*stages.cuts)][-len(where.q0) :]
