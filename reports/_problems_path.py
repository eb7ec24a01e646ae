"""Where the parts of a scene are: its picture at a few times and the paths of its points, from a fine run with RATTLE."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from daebench.method import Request
from daebench.problem import Picture
from daebench.reports._problems_runs import largest, method
from daebench.reports._problems_scenes import definition, horizon, scene_of
from daebench.scene import Array, Scene

FINE = 1000
"""Steps of the fine run over the time that is drawn."""

SHARES = (0.08, 0.2, 0.36, 0.6)
"""When later positions are drawn, as parts of the time that is drawn."""

LINES, ALONG = 13, 61
"""Lines of constant coordinates of a surface, and points on each."""


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
        candidates = [*self.masses, *(k for rod in self.rods for k in rod)]
        found: list[int] = []
        for k in candidates:
            moves = np.ptp(self.points[:, k], axis=0).max() > 1e-9
            if moves and all(np.max(np.abs(self.points[:, k] - self.points[:, j])) > 1e-9 for j in found):
                found.append(k)
        return found

    def table(self) -> pd.DataFrame:
        """Return the paths: t, then the coordinates of each point that moves."""
        columns: dict[str, Any] = {"t": self.t}
        for number, k in enumerate(self.moving, start=1):
            columns |= {f"{axis}{number}": self.points[:, k, i] for i, axis in enumerate("xyz"[: self.dimension])}
        return pd.DataFrame(columns)


def drawing_of(problem: str) -> Drawing | None:
    """Return what is drawn of the first case of a problem, None where it declares no picture."""
    scene = scene_of(problem)
    declared = definition(scene)
    if declared.picture is None:
        return None
    run = method("rattle").solve(scene, Request(value=horizon(problem).drawn / FINE, steps=FINE, watch=())).complete()
    rods, masses, fixed, flat = numbered(declared.picture)
    dimension = len(flat[0])
    points = values(scene, declared, flat, run.q)
    lines = surface_lines(scene, declared, declared.picture)
    return Drawing(problem, scene.case, dimension, run.t, points, rods, masses, fixed, lines, largest(scene.along("g", run.q)))


def numbered(picture: Picture) -> tuple[list[list[int]], list[int], list[int], list[Any]]:
    """Return rods, masses and fixed points by numbers of points, and all points in order."""
    flat: list[Any] = []

    def added(points: Any) -> list[int]:
        flat.extend(points)
        return list(range(len(flat) - len(points), len(flat)))

    return [added(rod) for rod in picture.rods], added(picture.masses), added(picture.fixed), flat


def values(scene: Scene, declared: Any, points: list[Any], Q: Array) -> Array:
    """Return points at rows of positions, shape(n, k, dimension)."""
    import sympy as sp

    call = sp.lambdify([list(declared.q), list(declared.parameters)], [[sp.sympify(x) for x in point] for point in points], "numpy")
    found = call(list(Q.T), [scene.parameters[str(name)] for name in declared.parameters])
    return np.moveaxis(np.array([[np.broadcast_to(x, len(Q)) for x in point] for point in found], dtype=float), 2, 0)


def surface_lines(scene: Scene, declared: Any, picture: Picture) -> Array:
    """Return lines of constant coordinates on the surface, shape(lines, ALONG, 3)."""
    import sympy as sp

    if picture.surface is None:
        return np.empty((0, ALONG, 3))
    (u, *of_u), (v, *of_v) = picture.over
    call = sp.lambdify([u, v, list(declared.parameters)], list(picture.surface), "numpy")
    par = [scene.parameters[str(name)] for name in declared.parameters]
    ends = [[float(sp.sympify(x)) for x in bounds] for bounds in (of_u, of_v)]
    few, many = ([np.linspace(low, high, n) for low, high in ends] for n in (LINES, ALONG))
    pairs = [(np.full(ALONG, a), many[1]) for a in few[0]] + [(many[0], np.full(ALONG, b)) for b in few[1]]
    return np.array([np.stack([np.broadcast_to(x, ALONG) for x in call(a, b, par)], axis=1) for a, b in pairs], dtype=float)
