"""Drawing of a problem: its picture at a few times and the paths of its points, from a fine run with RATTLE."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from daebench.draw.figures import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILION, grid_of_axes, save
from daebench.draw.orthographic import projected
from daebench.draw.scene import layout_of, moving
from daebench.draw.springs import draw_springs
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import methods_of
from daebench.pages.report.claims import require
from daebench.reports.problems.ivps import horizon, usual
from daebench.reports.problems.runs import largest
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
    axes : sequence of str
        Names of the coordinates; empty if they are lengths.
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
    axes: Sequence[str] = ()

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
    ivp = initial_value_problem(problem)
    layout = layout_of(ivp)
    if layout is None:
        return None
    (solver,) = methods_of(ivp, [usual(problem)])
    run = solver.solve(ivp, Request(value=horizon(problem).drawn / FINE, steps=FINE, watch=())).complete()
    parts = (layout.at(run.vectors[-1]), layout.rods, layout.masses, layout.fixed, layout.springs, layout.dampers, layout.surface)
    return Drawing(
        problem,
        ivp.case,
        layout.dimension,
        run.t,
        *parts,
        largest(ivp.along("g", run.q)) if ivp.m else 0.0,
        layout.axes,
    )


PATHS = (BLUE, ORANGE, GREEN, PURPLE, SKY)

FRAMES = 150
"""Positions over the drawn time, besides the start."""

WIDTH, HEIGHT, MARGIN = 1000, 720, 60
"""Size of a card, and its margin, in its units: all positions are whole numbers."""

SECONDS = 9
"""Time in which a card shows the drawn time of its problem, s."""

SPARSE = 4
"""Stride of the points of the lines on a surface."""


def motions(drawings: Mapping[str, Drawing]) -> Markup:
    """Return the motions of all problems as JSON, by name, with what they have in common."""
    common = {"width": WIDTH, "height": HEIGHT, "frames": FRAMES, "seconds": SECONDS, "colors": PATHS, "mass": VERMILION}
    return Markup(json.dumps(common | {"scenes": {name: motion(drawing) for name, drawing in drawings.items()}}, separators=(",", ":")))


def motion(drawing: Drawing) -> dict[str, Any]:
    """Return one motion: the places of each point, [x, y] if it stays there and else x and y at each time, and what the points are of."""
    times = np.linspace(0, len(drawing.t) - 1, FRAMES + 1).round().astype(int)
    flat, surface = projected(drawing.points[times]), projected(drawing.surface[:, ::SPARSE])
    corner, scale = _fitted(np.concatenate([flat.reshape(-1, 2), surface.reshape(-1, 2)]))

    def placed(points: Array) -> list[int]:
        x, y = np.moveaxis((points - corner) * scale, -1, 0)
        whole = np.stack([x, HEIGHT - y], axis=-1).round().astype(int).reshape(-1, 2)
        return [int(value) for value in (whole[:1] if np.ptp(whole, axis=0).max() == 0 else whole).ravel()]

    return {
        "points": [placed(flat[:, k]) for k in range(flat.shape[1])],
        "rods": drawing.rods,
        "springs": drawing.springs,
        "dampers": drawing.dampers,
        "masses": drawing.masses,
        "fixed": drawing.fixed,
        "paths": drawing.moving,
        "surface": [placed(line) for line in surface],
    }


def _fitted(points: Array) -> tuple[Array, float]:
    """Return the corner of the card in the plane of the picture, and the units of the card per unit of length."""
    low, high = points.min(axis=0), points.max(axis=0)
    size = np.array([WIDTH, HEIGHT])
    scale = float(np.min((size - 2 * MARGIN) / np.maximum(high - low, 1e-300)))
    return (low + high - size / scale) / 2, scale


ON_PATH = 1e-9
"""A drawn path whose constraint residual is below this satisfies its constraints."""


def check_drawings(problems: Sequence[str], drawings: Mapping[str, Drawing]) -> None:
    """Test that every problem has a drawing, and that the drawn path is on the manifold."""
    for problem in problems:
        require(problem in drawings, f"there is a picture of {problem}", "none declared")
        require(drawings[problem].off <= ON_PATH, f"the path of {problem} satisfies g = 0", drawings[problem].off)


COLUMNS = 5


THINNED = 5
"""Stride of the rows of the paths in the data of the figure of all scenes; the data of each scene has all rows."""


def draw_scene(scene: Drawing, folder: Path) -> Path:
    """Draw one scene, with axes in the plane, or with their directions in space."""
    figure, axes = grid_of_axes(1, 1, 4.4)
    mechanism(axes[0, 0], scene, large=True)
    return save(figure, folder, scene.problem, scene.table())


def draw_scenes(scenes: Sequence[Drawing], folder: Path) -> Path:
    """Draw all scenes in one figure."""
    rows = math.ceil(len(scenes) / COLUMNS)
    figure, axes = grid_of_axes(rows, COLUMNS, 1.75 * rows)
    for ax in axes.flat:
        ax.axis("off")
    for ax, scene in zip(axes.flat, scenes, strict=False):
        mechanism(ax, scene, large=False)
        ax.set_title(fill(scene.problem.replace("_", " "), 18), loc="center", fontsize=8)
    return save(
        figure,
        folder,
        "scenes",
        pd.concat([picture.table().iloc[::THINNED].round(5).assign(problem=picture.problem) for picture in scenes], ignore_index=True),
    )


def mechanism(ax: Any, scene: Drawing, *, large: bool) -> None:
    """Draw a scene: the surface, the paths, a few later positions faintly, and the start."""
    flat = projected(scene.points)
    for curve in projected(scene.surface):
        ax.plot(*curve.T, color="#c4c4c4", linewidth=0.5, zorder=0)
    for number, k in enumerate(scene.moving):
        ax.plot(*flat[:, k].T, color=PATHS[number % len(PATHS)], linewidth=0.9 if large else 0.6, alpha=0.9, zorder=2)
    for shade, n in zip((1.0, *np.linspace(0.45, 0.2, len(scene.frames) - 1)), scene.frames, strict=True):
        position(ax, scene, flat[n], alpha=float(shade), large=large)
    pivots = {"linestyle": "none", "marker": "^", "markersize": 6.0 if large else 3.5}
    ax.plot(*flat[0, scene.fixed].T, markerfacecolor="white", markeredgecolor="black", zorder=5, **pivots)
    ax.set_aspect("equal", adjustable="datalim")
    if scene.dimension == 2 and large:
        unit = horizon(scene.problem).length
        x, y = scene.axes or (f"$x$  [{unit}]", f"$y$  [{unit}]")
        ax.set(xlabel=x, ylabel=y)
    elif large:
        triad(ax, scene, flat)


def position(ax: Any, scene: Drawing, points: Array, *, alpha: float, large: bool) -> None:
    """Draw rods, springs, dampers and masses at one time; points has shape(k, 2)."""
    draw_springs(ax, scene, points, scene.extent, color="black", linewidth=1.0 if large else 0.6, alpha=alpha, zorder=3)
    for rod in scene.rods:
        ax.plot(*points[rod].T, color="black", linewidth=1.8 if large else 1.1, alpha=alpha, zorder=3, solid_capstyle="round")
    dots = {"linestyle": "none", "marker": "o", "markersize": 6.0 if large else 3.5, "markeredgewidth": 0}
    ax.plot(*points[scene.masses].T, color=VERMILION, alpha=alpha, zorder=4, **dots)


def triad(ax: Any, scene: Drawing, flat: Array) -> None:
    """Draw the three directions of space beside the scene, to the scale of a bar that is labelled with its length."""
    everything = np.concatenate([flat.reshape(-1, 2), projected(scene.surface).reshape(-1, 2)])
    low, high = everything.min(axis=0), everything.max(axis=0)
    length = 10.0 ** math.floor(math.log10(max(high - low)))
    length *= max(k for k in (0.1, 0.2, 0.5, 1.0) if k * length <= max(high - low) / 4)
    corner = np.array([high[0] + 1.2 * length, low[1] + 0.4 * length])
    for axis, name in zip(np.eye(3), scene.axes or "xyz", strict=True):
        tip = corner + projected(length * axis[None])[0]
        ax.annotate(
            "", xy=tip, xytext=corner, arrowprops={"arrowstyle": "-|>", "color": "black", "linewidth": 0.8, "shrinkA": 0, "shrinkB": 0}
        )
        ax.plot(*np.array([corner, tip + 0.3 * (tip - corner)]).T, alpha=0)  # arrows and letters do not change the limits
        ax.text(*(tip + 0.22 * (tip - corner)), name if scene.axes else f"${name}$", ha="center", va="center")
    bar = corner + np.array([[-0.5, -0.75], [0.5, -0.75]]) * length
    ax.plot(*bar.T, color="black", linewidth=1.6)
    ax.text(
        *(bar.mean(axis=0) - [0, 0.12 * length]), f"{length:g} {'' if scene.axes else horizon(scene.problem).length}", ha="center", va="top"
    )
    ax.axis("off")


def thumbnail(axis: Any, scene: Drawing) -> None:
    """Draw one scene without axes."""
    mechanism(axis, scene, large=False)
    axis.axis("off")
