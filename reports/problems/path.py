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
"""Steps of the fine run over the time that is drawn."""

SHARES = (0.08, 0.2, 0.36, 0.6)
"""When later positions are drawn, as parts of the time that is drawn."""


@dataclass(frozen=True)
class Drawing:
    """What is drawn of an initial value problem.

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
        Which points each rod leads through.
    masses, fixed : list of int
        Which points are masses, and which do not move.
    surface : ndarray, shape(lines, ALONG, 3)
        Lines on the surface; none where there is none.
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
        """Which times are drawn: the start and a few later ones."""
        return [0, *(round(share * (len(self.t) - 1)) for share in SHARES)]

    @property
    def moving(self) -> list[int]:
        """Points whose paths are drawn: masses and points of rods, once each, that move."""
        return moving(self.points, [*self.masses, *(k for rod in self.rods for k in rod)])

    def table(self) -> pd.DataFrame:
        """Return the paths: t, then the coordinates of each point that moves."""
        columns: dict[str, Any] = {"t": self.t}
        for number, k in enumerate(self.moving, start=1):
            columns |= {f"{axis}{number}": self.points[:, k, i] for i, axis in enumerate("xyz"[: self.dimension])}
        return pd.DataFrame(columns)


def drawing_of(problem: str) -> Drawing | None:
    """Return what is drawn of the first case of a problem, None where it declares no picture."""
    ivp = ivp_of(problem)
    layout = layout_of(ivp)
    if layout is None:
        return None
    run = method("rattle").solve(ivp, Request(value=horizon(problem).drawn / FINE, steps=FINE, watch=())).complete()
    parts = (layout.at(run.q), layout.rods, layout.masses, layout.fixed, layout.surface)
    return Drawing(problem, ivp.case, layout.dimension, run.t, *parts, largest(ivp.along("g", run.q)))
