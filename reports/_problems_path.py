"""Where the parts of a scene are: its picture at a few times and the paths of its points, from a fine run with RATTLE."""

from dataclasses import dataclass
from typing import Any

import pandas as pd

from daebench.method import Request
from daebench.reports._problems_runs import largest, method
from daebench.reports._problems_scenes import horizon, scene_of
from daebench.scene import Array
from daebench.scene_picture import layout_of, moving

FINE = 1000
"""Steps of the fine run over the time that is drawn."""

SHARES = (0.08, 0.2, 0.36, 0.6)
"""When later positions are drawn, as parts of the time that is drawn."""


@dataclass(frozen=True)
class Drawing:
    """What is drawn of a scene.

    Parameters
    ----------
    problem, case : str
        The scene.
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
    scene = scene_of(problem)
    layout = layout_of(scene)
    if layout is None:
        return None
    run = method("rattle").solve(scene, Request(value=horizon(problem).drawn / FINE, steps=FINE, watch=())).complete()
    parts = (layout.at(run.q), layout.rods, layout.masses, layout.fixed, layout.surface)
    return Drawing(problem, scene.case, layout.dimension, run.t, *parts, largest(scene.along("g", run.q)))
