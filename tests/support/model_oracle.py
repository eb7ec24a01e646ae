"""Accelerations of a model's bodies by MuJoCo's matrices, with equality constraints that are hard, and those of a mechanism read from it.

MuJoCo gives the mass matrix, the bias and applied forces and Jacobians of points in its joint coordinates. Its own solver makes equality
constraints soft; here they are a KKT system, by rows of this file.
"""

import copy

import mujoco
import numpy as np
import sympy as sp
from mechanisms import accelerations

from daebench.joints.mechanism import _worked

OFF = ("CONTACT", "LIMIT", "FRICTIONLOSS", "EQUALITY")


class Model:
    """A model, its reference position, and a state."""

    def __init__(self, model):
        self.m = copy.copy(model)
        for name in OFF:
            self.m.opt.disableflags |= int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{name}"))
        self.d, self.reference = mujoco.MjData(self.m), mujoco.MjData(self.m)
        self.settle(self.reference, self.m.qpos0.copy())

    def settle(self, d, qpos):
        """Put data on the equality constraints, near a position."""
        d.qpos[:] = qpos
        for _ in range(30):
            mujoco.mj_forward(self.m, d)
            J, _, off = self.rows(d)
            if not len(J):
                return
            step = np.linalg.lstsq(J, -off, rcond=1e-10)[0]
            mujoco.mj_integratePos(self.m, d.qpos, step, 1.0)
        mujoco.mj_forward(self.m, d)
        assert np.abs(self.rows(d)[2]).max() < 1e-12

    def random(self, random, spread=0.4):
        """Give the data a random state on the constraints."""
        qpos = self.reference.qpos.copy()
        mujoco.mj_integratePos(self.m, qpos, random.uniform(-spread, spread, self.m.nv), 1.0)
        self.settle(self.d, qpos)
        v = random.uniform(-2, 2, self.m.nv)
        J = self.rows(self.d)[0]
        self.d.qvel[:] = v - np.linalg.lstsq(J, J @ v, rcond=1e-10)[0] if len(J) else v
        mujoco.mj_forward(self.m, self.d)

    def point(self, d, body, local):
        """Return the place of a point of a body, its Jacobian, and what its acceleration has besides J qacc."""
        x = d.xpos[body] + d.xmat[body].reshape(3, 3) @ local
        J, Jdot = np.zeros((2, 3, self.m.nv))
        mujoco.mj_jac(self.m, d, J, None, x, body)
        mujoco.mj_jacDot(self.m, d, Jdot, None, x, body)
        return x, J, Jdot @ d.qvel

    def direction(self, d, body, local):
        """Return a direction of a body, its Jacobian, and what its second derivative has besides J qacc."""
        u = d.xmat[body].reshape(3, 3) @ local
        J, Jdot = np.zeros((2, 3, self.m.nv))
        mujoco.mj_jac(self.m, d, None, J, d.xpos[body], body)
        mujoco.mj_jacDot(self.m, d, None, Jdot, d.xpos[body], body)
        spin = J @ d.qvel
        return u, np.cross(J.T, u).T, np.cross(Jdot @ d.qvel, u) + np.cross(spin, np.cross(spin, u))

    def rows(self, d):
        """Return the Jacobian of the equality constraints, what their second derivatives have besides J qacc, and their residuals."""
        J, drift, off = np.zeros((0, self.m.nv)), np.zeros(0), np.zeros(0)
        for k in range(self.m.neq):
            kind, one, two, data = self.m.eq_type[k], self.m.eq_obj1id[k], self.m.eq_obj2id[k], self.m.eq_data[k]
            if kind == mujoco.mjtEq.mjEQ_JOINT:
                parts = [self.joints(d, one, two, data)]
            elif self.m.eq_objtype[k] == mujoco.mjtObj.mjOBJ_SITE:
                parts = [self.gap(*(self.point(d, self.m.site_bodyid[s], self.m.site_pos[s]) for s in (one, two)))]
                assert kind == mujoco.mjtEq.mjEQ_CONNECT
            elif kind == mujoco.mjtEq.mjEQ_CONNECT:
                parts = [self.gap(self.point(d, one, data[:3]), self.point(d, two, data[3:6]))]
            else:
                parts = self.weld(d, one, two, data)
            for more_J, more_drift, more_off in parts:
                J, drift, off = np.vstack([J, more_J]), np.append(drift, more_drift), np.append(off, more_off)
        return J, drift, off

    @staticmethod
    def gap(a, b):
        """Return the rows that keep two points in one place."""
        return a[1] - b[1], a[2] - b[2], a[0] - b[0]

    def weld(self, d, one, two, data):
        """Return the rows that keep two bodies as they are: the anchor, and u . w' of their directions."""
        R = np.zeros(9)
        mujoco.mju_quat2Mat(R, data[6:10])
        # The pose of the second body in the first is (data[3:6], R); the anchor is fixed in the second.
        yield self.gap(self.point(d, two, data[:3]), self.point(d, one, data[3:6] + R.reshape(3, 3) @ data[:3]))
        for i, j in ((0, 1), (0, 2), (1, 2)):
            a, b = self.direction(d, two, np.eye(3)[i]), self.direction(d, one, R.reshape(3, 3)[:, j])
            row = b[0] @ a[1] + a[0] @ b[1]
            drift = b[0] @ a[2] + a[0] @ b[2] + 2 * (a[1] @ d.qvel) @ (b[1] @ d.qvel)
            yield row[None], [drift], [a[0] @ b[0]]

    def joints(self, d, one, two, data):
        """Return the row of one joint that is a polynomial of another."""
        at, v = self.m.jnt_qposadr, self.m.jnt_dofadr
        row, x, speed = np.zeros((1, self.m.nv)), 0.0, 0.0
        row[0, v[one]] = 1
        polynomial = np.polynomial.Polynomial(data[:5])
        if two >= 0:
            x, speed = d.qpos[at[two]] - self.m.qpos0[at[two]], d.qvel[v[two]]
            row[0, v[two]] = -polynomial.deriv()(x)
        off = d.qpos[at[one]] - self.m.qpos0[at[one]] - polynomial(x)
        return row, [-polynomial.deriv(2)(x) * speed**2], [off]

    def qacc(self):
        """Return MuJoCo's accelerations on a tree, or those of the KKT system where there are equality constraints."""
        J, drift, _ = self.rows(self.d)
        if not len(J):
            return self.d.qacc.copy()
        M = np.zeros((self.m.nv, self.m.nv))
        mujoco.mj_fullM(self.m, self.d, M)
        force = self.d.qfrc_passive + self.d.qfrc_actuator - self.d.qfrc_bias
        n, free = len(J), np.linalg.solve(M, force)
        # J may have dependent rows, as of a plane linkage in space: the accelerations are determined all the same.
        W = np.linalg.cholesky(M)
        A = np.linalg.solve(W, J.T).T
        correction = np.linalg.lstsq(A, -drift - J @ free, rcond=1e-10)[0]
        assert n == len(A)
        return free + np.linalg.solve(W.T, correction)


def compare(model, mechanism, axes):
    """Return the largest difference of accelerations of the points and directions of a mechanism, and the largest of them."""
    problem, angles = mechanism.problem(), _worked(mechanism).angles
    places, J = angles.places, model.rows(model.d)[0]
    assert problem.d - len(problem.g) == model.m.nv - (np.linalg.matrix_rank(J, tol=1e-9) if len(J) else 0)
    E = np.array([np.eye(3)["xyz".index(letter)] for letter in axes])
    q, v, expected = [], [], []
    forms, qacc = [], model.qacc()
    for name, body in mechanism.bodies.items():
        k = model.m.body(name).id
        x0, R0 = model.reference.xpos[k], model.reference.xmat[k].reshape(3, 3)
        for column in (places.columns[x] for x in (*body.names, *(x for x in places.columns if x.startswith(f"{name}.")))):
            was = E.T @ np.array(column.reference, dtype=float).ravel()
            # The plane of a mechanism passes through the body's place.
            local = R0.T @ (was + (np.eye(3) - E.T @ E) @ x0 - x0) if column.weight else R0.T @ was
            now, J, drift = (model.point if column.weight else model.direction)(model.d, k, local)
            q.append(E @ now)
            v.append(E @ J @ model.d.qvel)
            expected.append(E @ (J @ qacc + drift))
            forms += list(column.now)
    for words, one in angles.measured.items():
        now, speed, gone = turned(model, E, words, qacc)
        forms, q, v, expected = [*forms, one.theta], [*q, [now]], [*v, [speed]], [*expected, [gone]]
    return differences(problem, sp.Matrix(forms), np.concatenate(q), np.concatenate(v), np.concatenate(expected))


def turned(model, E, words, qacc):
    """Return an angle against the reference position, its rate and its second derivative: of a body in the plane, or of a joint."""
    body = words.removeprefix("the angle of ")
    if body == words:
        joint = model.m.joint(words.removeprefix("the angle "))
        at, k = joint.qposadr[0], joint.dofadr[0]
        return model.d.qpos[at] - model.reference.qpos[at], model.d.qvel[k], qacc[k]
    body, _, axis = body.partition(" about ")
    # About an axis that does not turn: the normal of the plane, or one that the words have.
    normal = np.array([float(sp.sympify(x)) for x in axis.strip("()").split(",")]) if axis else np.cross(*E)
    k, normal = model.m.body(body).id, normal / np.linalg.norm(normal)
    R = model.d.xmat[k].reshape(3, 3) @ model.reference.xmat[k].reshape(3, 3).T
    J = np.zeros((3, model.m.nv))
    mujoco.mj_jacBody(model.m, model.d, None, J, k)
    sine = normal @ np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
    return np.arctan2(sine, (np.trace(R) - 1) / 2), normal @ J @ model.d.qvel, normal @ J @ qacc


def differences(problem, forms, q, v, expected):
    """Return the largest difference of accelerations, and the largest of them."""
    A = np.array(forms.jacobian(problem.q), dtype=float)
    b = np.array(forms.subs(dict.fromkeys(problem.q, 0)), dtype=float).ravel()
    state, rate = np.linalg.lstsq(A, q - b, rcond=None)[0], np.linalg.lstsq(A, v, rcond=None)[0]
    assert np.abs(A @ state + b - q).max() < 1e-11
    assert np.abs(A @ rate - v).max() < 1e-10
    found = A @ accelerations(problem, state, rate)
    return np.abs(found - expected).max(), np.abs(expected).max()
