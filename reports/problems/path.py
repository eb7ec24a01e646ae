"""Drawing of a problem: its picture at a few times and the paths of its points, from a fine run with RATTLE."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from daebench.draw.orthographic import projected
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
        All points of the picture over time: those of the rods, the masses, the fixed ones, then ends of springs.
    rods : list of list of int
        Points that each rod connects.
    masses, fixed : list of int
        Points that are masses, and points that do not move.
    springs, dampers : list of list of int
        The two points that each spring and each damper connects.
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
    springs: list[list[int]]
    dampers: list[list[int]]
    surface: Array
    off: float

    @property
    def extent(self) -> float:
        """Extent of all points over time, in the plane of the picture."""
        return float(np.max(np.ptp(projected(self.points).reshape(-1, 2), axis=0)))

    @property
    def frames(self) -> list[int]:
        """Indices of the drawn times: the start and a few later ones."""
        return [0, *(round(share * (len(self.t) - 1)) for share in SHARES)]

    @property
    def moving(self) -> list[int]:
        """Points whose paths are drawn: moving masses and points of rods and springs, once each."""
        lines = [*self.rods, *self.springs]
        return moving(self.points, [*self.masses, *(k for line in lines for k in line)])

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
    parts = (layout.at(run.q), layout.rods, layout.masses, layout.fixed, layout.springs, layout.dampers, layout.surface)
    return Drawing(problem, ivp.case, layout.dimension, run.t, *parts, largest(ivp.along("g", run.q)))
