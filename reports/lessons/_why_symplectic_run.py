"""The spherical pendulum, and a parallelogram of tangent vectors under its steps."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from daebench.diagnostics.symplecticity import areas, tangent_path
from daebench.errors import BadInput
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.make_ivp import constrained

PROBLEM = "spherical_pendulum"
WIDE = 1.0
"""Angle from the lowest point, rad, of the start that is neither slow nor fast."""


@cache
def ivp_of(start: str) -> ConstrainedIvp:
    """Return the pendulum with one of the starts "slow", "wide" and "fast"."""
    if start == "wide":
        c, s = float(np.cos(WIDE)), float(np.sin(WIDE))
        return constrained(initial_value_problem(PROBLEM, "fig1.1", q0=(s, 0.0, -c), p0=(0.3 * c, 0.5, 0.3 * s)))
    return constrained(initial_value_problem(PROBLEM, {"slow": "fig1.1", "fast": "fig1.2"}[start]))


@dataclass(frozen=True)
class Carried:
    """A run and its parallelogram.

    Parameters
    ----------
    method : str
        Name of the method that was run.
    projected : bool
        Whether its steps are projected onto the manifold afterwards.
    t : ndarray, shape(n,)
        Times, s.
    p, q : ndarray, shape(n, 3)
        States.
    energy, g, Gv : ndarray, shape(n,)
        Energy error, and moduli of both constraints' residuals.
    X : ndarray, shape(n, 6, 2)
        Sides of the parallelogram, momenta first.
    planes : ndarray, shape(n, 3)
        Oriented areas of its projections onto the planes (q_i, p_i).
    failure : str or None
        Why the run ended early.
    """

    method: str
    projected: bool
    t: Array
    p: Array
    q: Array
    energy: Array
    g: Array
    Gv: Array
    X: Array
    planes: Array
    failure: str | None

    @property
    def area(self) -> Array:
        """The symplectic area dq ^ dp, shape(n,)."""
        return np.asarray(self.planes.sum(axis=1))

    @property
    def change(self) -> float:
        """Largest difference of the area from that at the start."""
        return float(np.max(np.abs(self.area - self.area[0])))

    @property
    def round_off(self) -> float:
        """Round-off of the area, a difference of products of sides that have grown."""
        sides = np.linalg.norm(self.X, axis=1)
        return 1e-12 * float(np.max(sides[:, 0] * sides[:, 1]))

    @property
    def kept(self) -> bool:
        """Whether the area is that of the start, to round-off."""
        return self.change <= self.round_off


def sides(ivp: ConstrainedIvp) -> Array:
    """Return two tangent vectors of the manifold at the start with area dq ^ dp = 1, shape(6, 2), momenta first.

    With a unit vector u across q, for unit mass and length::

        X1: dq = u, dp = -(p.u) q        X2: dq = 0, dp = u

    Both satisfy q.dq = 0 and q.dp + p.dq = 0.
    """
    p, q = np.asarray(ivp.p0, dtype=float), np.asarray(ivp.q0, dtype=float)
    u = np.eye(3)[np.argmin(np.abs(q))]
    u = u - (u @ q) * q
    u = u / np.linalg.norm(u)
    return np.stack([np.concatenate([-(p @ u) * q, u]), np.concatenate([u, np.zeros(3)])], axis=1)


def method_of(scheme: str, project: bool) -> tuple[Any, bool]:
    """Return a method, with the projection if it allows one, and whether it does."""
    if project:
        try:
            return parse(f"{scheme}+proj"), True
        except BadInput:  # it is on the manifold without projection
            return parse(scheme), False
    return parse(scheme), False


@cache
def carried(scheme: str, project: bool, start: str, h: float, t_end: float) -> Carried:
    """Return the run of a scheme with the parallelogram."""
    ivp = ivp_of(start)
    method, projected = method_of(scheme, project)
    x, X, failure = tangent_path(method.path(ivp, h, max(1, round(t_end / h))), ivp.p0, ivp.q0, sides(ivp))
    p, q = x[:, :3], x[:, 3:]
    energy = ivp.along("H", p, q)
    return Carried(
        method=method.name,
        projected=projected,
        t=np.asarray(h * np.arange(len(x)), dtype=float),
        p=p,
        q=q,
        energy=energy - energy[0],
        g=np.abs(ivp.along("g", q)).ravel(),
        Gv=np.abs(ivp.along("Gv", p, q)).ravel(),
        X=X,
        planes=areas(X),
        failure=failure,
    )
