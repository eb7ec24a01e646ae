"""Constraint forces along a run: forces and torques in the joints of a mechanism, and -G_i^T lam_i of any other constraints.

::

    W lam = a(p, q),      W = G H_pp G^T,      p' = -H_q - G^T lam,      v' = H_pq v + H_pp p'
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from daebench.errors import BadInput, DaebenchError
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
        frames = []
        for load in self.loads:
            columns: dict[str, Any] = {"t": self.t, "joint": load.joint, "on": load.on, "at": load.at}
            for where in ("", "_in_body") if self.mechanism else ("",):
                for name, unit in (("force", "N"), ("torque", "N m")):
                    values = getattr(load, name + where)
                    words = f"{where.replace('_', ' ')} [{unit}]" if self.mechanism else ""
                    columns |= {f"{name} {axis}{words}": x for axis, x in zip(self._axes(values), values.T, strict=True)}
            frames.append(pd.DataFrame(columns))
        return pd.concat(frames, ignore_index=True)

    def _axes(self, values: Array) -> list[str]:
        """Return the names of components."""
        count = values.shape[1]
        return list("z" if count == 1 else "xyz"[:count]) if self.mechanism else [f"q{i + 1}" for i in range(count)]

    def summary(self) -> dict[str, Any]:
        """Return the force and torque of each joint, for JSON; null where rigid bodies leave them open."""
        rows = []
        for load in self.loads:
            sizes = {name: self._sizes(getattr(load, name), getattr(load, f"{name}_in_body")) for name in ("force", "torque")}
            rows.append({"joint": load.joint, "on": load.on, "at": load.at, **sizes})
        return {"residual": self.residual, "loads": rows}

    def _sizes(self, values: Array, in_body: Array) -> dict[str, Any]:
        """Return the largest size of the components that are determined, its time, names of the others, and all at the end."""
        missing: Any = np.isnan(values).any(axis=0)
        sizes = np.linalg.norm(values[:, ~missing], axis=1)
        k = int(np.argmax(sizes))
        return {
            "largest": None if missing.any() and missing.all() else float(sizes[k]),
            "t": float(self.t[k]) if sizes[k] > 0 else None,
            "undetermined": [axis for axis, one in zip(self._axes(values), missing.tolist(), strict=True) if one],
            "at_end": _known(values[-1]),
            "at_end_in_body": _known(in_body[-1]),
        }

    def printed(self) -> Iterator[str | Table]:
        """Yield a table of the largest force and torque of each joint."""
        rows = []
        for row in self.summary()["loads"]:
            cells = [row["joint"], *([row["on"], row["at"]] if self.mechanism else [])]
            for part in (row["force"], row["torque"])[: 1 + self.mechanism]:
                size, missing = part["largest"], ", ".join(part["undetermined"])
                known = OPEN if size is None else f"{size:.6g}; {missing} {OPEN}" if missing else f"{size:.6g}"
                cells += [known, "" if part["t"] is None else f"{part['t']:.6g}"]
            rows.append(cells)
        names = ["joint", "on", "at", "force [N]", "at t [s]", "torque [N m]", "at t [s]"]
        yield Table(names if self.mechanism else ["constraint", "force in q", "at t [s]"], rows, f"largest of {len(self.t)} outputs")


def _known(values: Array) -> list[float | None]:
    return [float(x) if np.isfinite(x) else None for x in values]


def reactions(run: Outcome) -> Reactions:
    """Return the constraint forces at the outputs of a run; see :meth:`daebench.Trajectory.reactions`.

    Examples
    --------
    >>> import daebench
    >>> import numpy as np
    >>> from daebench.diagnostics.reactions import reactions
    >>> run = daebench.run("planar_pendulum", case="horizontal", method="rattle", h=0.001, t_end=2)
    >>> (rod,) = reactions(run).loads
    >>> round(float(np.linalg.norm(rod.force, axis=1).max()), 3)
    3.0
    """
    ivp = with_reactions(run.solved)
    if run.failure and not all(np.isfinite(x).all() for x in run.vectors):
        raise BadInput(f"the run has states that are not finite, so there are no reactions: {run.failure}", "reactions-not-finite")
    definition, (p, q) = ivp.source.derivation.definition, (np.asarray(x, dtype=float) for x in run.vectors)
    if definition.parts is None:
        return Reactions(ivp, run.method, run.t, tuple(_of_constraints(ivp, p, q)))
    values = {symbol: float(ivp.parameters[str(symbol)]) for symbol in definition.parameters}
    d = ivp.moving
    p, q = _on_constraints(ivp, p, q)
    G, lam, _ = _multipliers(ivp, p, q)
    rate, v = -ivp.along("H_q", p, q) - np.einsum("tmd,tm->td", G, lam), ivp.along("H_p", p, q)
    a = np.einsum("tij,tj->ti", ivp.along("H_pp", p, q), rate) + np.einsum("tij,tj->ti", ivp.along("H_pq", p, q), v)
    loads, residual = reactions_of(definition.parts.mechanism, values, run.t, *(x[:, :d] for x in (q, v, a)))
    if not residual < BALANCED:
        raise DaebenchError(
            f"the forces on the bodies of {ivp.problem} do not balance, by {residual:.2g} of the largest: the problem has forces that its "
            "mechanism does not declare; declare them in its forces or joints.",
            "body-forces-unbalanced",
        )
    return Reactions(ivp, run.method, run.t, tuple(loads), True, residual)


def _of_constraints(ivp: ConstrainedIvp, p: Array, q: Array) -> Iterator[Load]:
    """Yield the force of each constraint in the coordinates; NaN where its multiplier is not determined."""
    G, lam, free = _multipliers(ivp, p, q)
    none = np.zeros((len(q), 0))
    for i in range(ivp.m):
        force = -lam[:, i, None] * G[:, i, : ivp.moving]
        force[free[:, i] > FREE] = np.nan
        yield Load(ivp.named(i), "q", "", force, none, force, none)


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


def _on_constraints(ivp: ConstrainedIvp, p: Array, q: Array) -> tuple[Array, Array]:
    """Return a state on the constraints next to that of a run, so that joints are redundant, and angles turn as bodies, to rounding."""
    for _ in range(SWEEPS):
        nu, _ = _solved(ivp.along("W", p, q), ivp.along("g", q))
        q = q - np.einsum("tmd,tm->td", ivp.along("Gv_p", p, q), nu)
    nu, _ = _solved(ivp.along("W", p, q), ivp.along("Gv", p, q))
    return p - np.einsum("tmd,tm->td", ivp.along("G", q), nu), q
