"""Constraint forces along a run: forces and torques in the joints of a mechanism, and -G_i^T lam_i of any other constraints.

::

    W lam = a(p, q),      W = G H_pp G^T,      p' = -H_q - G^T lam,      v' = M^-1 p'
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from daebench.errors import BadInput, DaebenchError
from daebench.joints.cut import cut
from daebench.joints.exact import numbers
from daebench.joints.reactions import Load, reactions_of
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.make_ivp import with_reactions
from daebench.runs.result import Result, Table
from daebench.runs.trajectory import Outcome
from daebench.systems.lazily import pandas as pd

RANK = 1e-12
"""Part of the largest eigenvalue of W, with a diagonal of 1, below which one is 0."""

FREE = 1e-6
"""Entry of a null vector of W below which the multiplier is determined."""

BALANCED = 1e-8
"""Largest residual of the equations of bodies, relative to the largest term, that is one of rounding."""

SWEEPS = 4
"""Newton iterations by which positions are moved onto the constraints, which a run satisfies to its tolerance."""

OPEN = "not determined by rigid bodies"
"""Words in the place of a number that redundant joints leave open."""


@dataclass(frozen=True)
class Reactions(Result):
    """Forces and torques of all joints of a mechanism on its bodies, or forces of constraints, at the outputs of a run.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem.
    method : str
        The method.
    t : ndarray, shape(n,)
        Times of the outputs, s.
    loads : tuple of Load
        Force and torque of each joint on each of its bodies; see :class:`daebench.joints.reactions.Load`. Of a problem that is no
        mechanism, the force -G_i^T lam_i of each constraint g_i in the coordinates q.
    mechanism : bool
        Whether it is a mechanism, with forces in N and torques in N m.
    residual : float
        Largest residual of the equations of bodies, relative to their largest term; 0 of a problem that is no mechanism.
    """

    ivp: ConstrainedIvp
    method: str
    t: Array
    loads: tuple[Load, ...]
    mechanism: bool = False
    residual: float = 0.0

    drawn_by: ClassVar[str] = "daebench.draw.reactions"

    @property
    def table(self) -> "pd.DataFrame":
        """The outputs, a row a time, joint and body: t, names, and the components of force and torque, named with their units."""
        rows = []
        for load in self.loads:
            named: dict[str, Any] = {"t": self.t, "joint": load.joint, "on": load.on, "at": load.at}
            for where, words in (("", ""), ("_in_body", " in body")):
                force, torque = getattr(load, f"force{where}"), getattr(load, f"torque{where}")
                axes = "xyz" if torque.shape[1] == 3 else "z"
                named |= {f"force {axis}{words} [N]": x for axis, x in zip("xyz", force.T, strict=False)}
                named |= {f"torque {axis}{words} [N m]": x for axis, x in zip(axes, torque.T, strict=True)}
            if not self.mechanism:
                named = {"t": self.t, "constraint": load.joint} | {f"force in q{k + 1}": x for k, x in enumerate(load.force.T)}
            rows.append(pd.DataFrame(named))
        return pd.concat(rows, ignore_index=True)

    def summary(self) -> dict[str, Any]:
        """Return the largest force and torque of each joint, when it acts, and the values at the end, for JSON."""
        return {"residual": self.residual, "loads": [self._row(load) for load in self.loads]}

    def _row(self, load: Load) -> dict[str, Any]:
        row: dict[str, Any] = {"joint": load.joint, "on": load.on, "at": load.at, "undetermined": load.free or None}
        for name in ("force", "torque"):
            values = getattr(load, name)
            sizes = np.linalg.norm(values, axis=1)
            k = int(np.argmax(np.where(np.isnan(sizes), -1.0, sizes)))
            whole = bool(np.isfinite(sizes).all()) and values.shape[1] > 0
            row |= {f"largest_{name}": float(sizes[k]) if whole else None}
            row |= {f"{name}_t": float(self.t[k]) if whole and sizes[k] > 0 else None}
            row |= {f"{name}_at_end": _known(values[-1]), f"{name}_in_body_at_end": _known(getattr(load, f"{name}_in_body")[-1])}
        return row

    def printed(self) -> Iterator[str | Table]:
        """Yield a table of the largest force and torque of each joint, and what rigid bodies do not determine."""
        names = ["joint", "on", "at", "force", "at t", "torque", "at t"] if self.mechanism else ["constraint", "force", "at t"]
        rows = []
        for row in (self._row(load) for load in self.loads):
            cells = [[_number(row[f"largest_{name}"]), _number(row[f"{name}_t"], "")] for name in ("force", "torque")]
            rows.append([row["joint"], row["on"], row["at"], *cells[0], *cells[1]] if self.mechanism else [row["joint"], *cells[0]])
        units = "in N, N m and s" if self.mechanism else "in the coordinates q"
        yield Table(names, rows, f"largest reactions over {len(self.t)} outputs, {units}")
        for load in self.loads:
            if load.free:
                yield f"{load.joint} on {load.on}: {load.free} {OPEN}."


def _known(values: Array) -> list[float | None]:
    return [float(x) if np.isfinite(x) else None for x in values]


def _number(x: float | None, missing: str = OPEN) -> str:
    return missing if x is None else f"{x:.6g}"


def reactions(run: Outcome) -> Reactions:
    """Return the constraint forces at the outputs of a run; see :meth:`daebench.Trajectory.reactions`."""
    ivp = with_reactions(run.solved)
    if run.failure and not all(np.isfinite(x).all() for x in run.vectors):
        raise BadInput(f"the run has states that are not finite, so there are no reactions: {run.failure}")
    definition, (p, q) = ivp.source.derivation.definition, run.vectors
    if definition.parts is None:
        return Reactions(ivp, run.method, run.t, tuple(_of_constraints(ivp, p, q)))
    values = {symbol: float(ivp.parameters[str(symbol)]) for symbol in definition.parameters}
    d = ivp.moving
    q = _on_constraints(ivp, p, q)
    G, lam, _ = _multipliers(ivp, p, q)
    pull = -ivp.along("H_q", p, q) - np.einsum("tmd,tm->td", G, lam)
    a = np.linalg.solve(numbers(definition.M, values), pull[:, :d].T).T
    loads, residual = reactions_of(cut(definition.parts.mechanism, values), run.t, q[:, :d], ivp.along("H_p", p, q)[:, :d], a)
    if not residual < BALANCED:
        raise DaebenchError(
            f"the forces on the bodies of {ivp.problem} do not balance, by {residual:.2g} of the largest: the problem has forces that its "
            "mechanism does not declare; declare them in its forces or joints."
        )
    return Reactions(ivp, run.method, run.t, tuple(loads), True, residual)


def _of_constraints(ivp: ConstrainedIvp, p: Array, q: Array) -> Iterator[Load]:
    """Yield the force of each constraint in the coordinates; NaN where its multiplier is not determined."""
    G, lam, free = _multipliers(ivp, p, q)
    none = np.zeros((len(q), 0))
    for i in range(ivp.m):
        force = -lam[:, i, None] * G[:, i, : ivp.moving]
        loose = free[:, i] > FREE
        force[loose] = np.nan
        yield Load(ivp.named(i), "q", "", force, none, force, none, "force" if loose.any() else "")


def _multipliers(ivp: ConstrainedIvp, p: Array, q: Array) -> tuple[Array, Array, Array]:
    """Return G, lam, and how far each multiplier is free, shape(n, m): 0 where it is determined."""
    lam, free = _solved(ivp.along("W", p, q), ivp.along("a", p, q, np.zeros((len(q), ivp.m))))
    return ivp.along("G", q), lam, free


def _solved(W: Array, b: Array) -> tuple[Array, Array]:
    """Return x of least norm with W x = b, and the length of each unit vector's part in the null space of W."""
    size = np.sqrt(np.diagonal(W, axis1=1, axis2=2))
    size = np.where(size > 0, size, 1.0)
    sizes, ways = np.linalg.eigh(W / (size[:, :, None] * size[:, None, :]))
    positive = sizes > RANK * sizes[:, -1:]
    inverse = np.divide(1.0, sizes, out=np.zeros_like(sizes), where=positive)
    x = np.einsum("tik,tk,tjk,tj->ti", ways, inverse, ways, b / size) / size
    return x, np.linalg.norm(np.where(positive[:, None, :], 0.0, ways), axis=2)


def _on_constraints(ivp: ConstrainedIvp, p: Array, q: Array) -> Array:
    """Return positions on the constraints next to those of a run, so that redundant joints are redundant to rounding."""
    for _ in range(SWEEPS):
        nu, _ = _solved(ivp.along("W", p, q), ivp.along("g", q))
        q = q - np.einsum("tmd,tm->td", ivp.along("Gv_p", p, q), nu)
    return q
