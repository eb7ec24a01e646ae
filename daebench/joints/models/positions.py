"""Positions of a model in which its loops are closed, and how many equations each equality constraint adds."""

import copy
from dataclasses import dataclass
from typing import Any

import numpy as np

from daebench.joints.models.links import Array
from daebench.systems.lazily import mujoco

STEPS = 50
"""Most steps of the projection onto the equality constraints."""

CLOSED = 1e-12
"""Largest residual of constraints that hold, m or rad."""

DEPENDENT = 1e-8
"""Largest singular value of rows of length one that counts as 0."""


@dataclass(frozen=True)
class Settled:
    """A position in which the equality constraints hold."""

    qpos: Array
    off: float
    """Largest residual before, m or rad."""
    moved: float
    """Largest change of a joint coordinate, m or rad."""
    left: float
    """Largest residual that is left."""


class Loops:
    """The equality constraints of a model alone: no contacts, limits or friction."""

    def __init__(self, model: Any) -> None:
        self.model = copy.copy(model)
        bits = mujoco.mjtDisableBit
        for bit in (bits.mjDSBL_CONTACT, bits.mjDSBL_LIMIT, bits.mjDSBL_FRICTIONLOSS, bits.mjDSBL_SPRING, bits.mjDSBL_ACTUATION):
            self.model.opt.disableflags |= int(bit)
        self.model.opt.disableflags &= ~int(bits.mjDSBL_EQUALITY) & ~int(bits.mjDSBL_CONSTRAINT)
        self.model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        self.data = mujoco.MjData(self.model)

    def rows(self, qpos: Array) -> tuple[Array, Array, Array]:
        """Return the constraints' Jacobian, shape(n, nv), their residuals, and the number of the constraint of each row."""
        self.data.qpos[:] = qpos
        mujoco.mj_fwdPosition(self.model, self.data)
        n = self.data.nefc
        J = self.data.efc_J.reshape(-1, self.model.nv)[:n].copy()
        return J, self.data.efc_pos[:n].copy(), self.data.efc_id[:n].copy()

    def settled(self, qpos: Array) -> Settled:
        """Return the position near another in which all constraints hold, by Newton's method."""
        now, off = np.array(qpos, dtype=float), 0.0
        for step in range(STEPS):
            J, residual, _ = self.rows(now)
            left = float(np.abs(residual).max(initial=0.0))
            off = left if step == 0 else off
            if left < CLOSED:
                break
            mujoco.mj_integratePos(self.model, now, -np.linalg.lstsq(J, residual, rcond=1e-10)[0], 1.0)
        gone = np.zeros(self.model.nv)
        mujoco.mj_differentiatePos(self.model, gone, 1.0, np.array(qpos, dtype=float), now)
        return Settled(now, off, float(np.abs(gone).max(initial=0.0)), left)

    def _closed(self, random: np.random.Generator) -> Array:
        """Return a random position in which all constraints hold: as an open loop is moved, its rows depend on each other less."""
        for spread in (0.4, 0.2, 0.1, 0.05):
            qpos = self.model.qpos0.copy()
            mujoco.mj_integratePos(self.model, qpos, random.uniform(-spread, spread, self.model.nv), 1.0)
            settled = self.settled(qpos)
            if settled.left < CLOSED:
                return settled.qpos
        return self.settled(self.model.qpos0).qpos

    def added(self, seed: int) -> dict[int, Array]:
        """Return for each constraint the combinations of its rows that add no equation to those before it, at a random closed position."""
        J, _, ids = self.rows(self._closed(np.random.default_rng(seed)))
        before, idle = np.zeros((0, self.model.nv)), {}
        for k in dict.fromkeys(ids.tolist()):
            rows = J[ids == k]
            rest = rows - rows @ np.linalg.pinv(before, rcond=DEPENDENT) @ before if len(before) else rows
            U, sizes, _ = np.linalg.svd(rest)
            size = np.append(sizes, np.zeros(len(rows) - len(sizes)))
            idle[k] = U[:, size < DEPENDENT * max(1.0, float(np.abs(rows).max()))].T
            before = np.vstack([before, rows])
        return idle
