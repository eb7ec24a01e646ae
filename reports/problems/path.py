"""Drawing of a problem: its picture at a few times and the paths of its points, from a fine run with RATTLE."""

from dataclasses import dataclass
from typing import Any

import pandas as pd

from daebench.draw.scene import layout_of, moving
from daebench.reports.problems.ivps import horizon, ivp_of
from daebench.reports.problems.runs import largest, method
from daebench.runs.ivp import Array
from daebench.runs.request import Request

FINE = 1000
"""Number of steps of the fine run over the drawn time."""

SHARES = (0.08, 0.2, 0.36, 0.6)
"""Times of later positions, as fractions of the drawn time."""


@dataclass(frozen=True)
class Drawing:
    """Drawing of an initial value problem.

    Parameters
    ----------
    problem, case : str
        The initial value problem.
    dimension : int
        2 or 3.
    t : ndarray, shape(n,)
        Times of the path.
    points : ndarray, shape(n, k, dimension)
        All points of the picture over time: those of the rods, then the masses, then the fixed ones.
    rods : list of list of int
        Points that each rod connects.
    masses, fixed : list of int
        Points that are masses, and points that do not move.
    surface : ndarray, shape(lines, ALONG, 3)
        Lines on the surface; empty if there is no surface.
    off : float
        Largest |g| of the path.
    """

    problem: str
    case: str
    dimension: int
    t: Array
    points: Array
    rods: list[list[int]]
    masses: list[int]
    fixed: list[int]
    surface: Array
    off: float

    @property
    def frames(self) -> list[int]:
        """Indices of the drawn times: the start and a few later ones."""
        return [0, *(round(share * (len(self.t) - 1)) for share in SHARES)]

    @property
    def moving(self) -> list[int]:
        """Points whose paths are drawn: moving masses and points of rods, once each."""
        return moving(self.points, [*self.masses, *(k for rod in self.rods for k in rod)])

    def table(self) -> pd.DataFrame:
        """Return the paths: t, then the coordinates of each point that moves."""
        columns: dict[str, Any] = {"t": self.t}
        for number, k in enumerate(self.moving, start=1):
            columns |= {f"{axis}{number}": self.points[:, k, i] for i, axis in enumerate("xyz"[: self.dimension])}
        return pd.DataFrame(columns)


def drawing_of(problem: str) -> Drawing | None:
    """Return the drawing of the first case of a problem, None if it declares no picture."""
    ivp = ivp_of(problem)
    layout = layout_of(ivp)
    if layout is None:
        return None
    run = method("rattle").solve(ivp, Request(value=horizon(problem).drawn / FINE, steps=FINE, watch=())).complete()
    parts = (layout.at(run.q), layout.rods, layout.masses, layout.fixed, layout.surface)
    return Drawing(problem, ivp.case, layout.dimension, run.t, *parts, largest(ivp.along("g", run.q)))
