"""The figures of the report on problems: a drawing of each scene, all scenes in one figure, and positions where G loses rank."""

import math
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
import pandas as pd

from daebench.draw.figures import BLUE, GREEN, ORANGE, PURPLE, QUIET, SKY, VERMILION, drawing, grid_of_axes, legend_below, save
from daebench.draw.methods import name_of, stroke_of
from daebench.draw.orthographic import projected
from daebench.draw.springs import draw_springs
from daebench.pages.report.thumbnail import draw_thumbnail
from daebench.reports.problems import rank
from daebench.reports.problems.heat_map import draw_heat_map
from daebench.reports.problems.ivps import horizon
from daebench.reports.problems.numbers import Numbers
from daebench.reports.problems.path import Drawing
from daebench.runs.ivp import Array

STROKE = {name: stroke_of(name) for name in rank.METHODS}
SHOWN = "torus"
"""The problem in the picture for the index."""

COLUMNS = 5
THINNED = 5
"""Stride of the rows of the paths in the data of the figure of all scenes; the data of each scene has all rows."""

PATHS = (BLUE, ORANGE, GREEN, PURPLE, SKY)


def draw(numbers: Numbers, folder: Path) -> dict[str, Path]:
    """Draw all figures into a folder; return the paths of the SVG files by stem."""
    with drawing():
        paths = [draw_scene(scene, folder) for scene in numbers.drawings.values()]
        paths += [draw_scenes(numbers, folder), draw_rank(numbers, folder), draw_heat_map(numbers.runs, folder)]
    if SHOWN in numbers.drawings:
        draw_thumbnail(folder, lambda axis: _thumbnail(axis, numbers.drawings[SHOWN]))
    return {path.stem: path for path in paths}


def _thumbnail(axis: Any, scene: Drawing) -> None:
    """Draw one scene without axes."""
    mechanism(axis, scene, large=False)
    axis.axis("off")


def draw_scene(scene: Drawing, folder: Path) -> Path:
    """Draw one scene, with axes in the plane, or with their directions in space."""
    figure, axes = grid_of_axes(1, 1, 4.4)
    mechanism(axes[0, 0], scene, large=True)
    return save(figure, folder, scene.problem, scene.table())


def draw_scenes(numbers: Numbers, folder: Path) -> Path:
    """Draw all scenes in one figure."""
    scenes = list(numbers.drawings.values())
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
        ax.set(xlabel=f"$x$  [{unit}]", ylabel=f"$y$  [{unit}]")
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
    for axis, name in zip(np.eye(3), "xyz", strict=True):
        tip = corner + projected(length * axis[None])[0]
        ax.annotate(
            "", xy=tip, xytext=corner, arrowprops={"arrowstyle": "-|>", "color": "black", "linewidth": 0.8, "shrinkA": 0, "shrinkB": 0}
        )
        ax.plot(*np.array([corner, tip + 0.3 * (tip - corner)]).T, alpha=0)  # arrows and letters do not change the limits
        ax.text(*(tip + 0.22 * (tip - corner)), f"${name}$", ha="center", va="center")
    bar = corner + np.array([[-0.5, -0.75], [0.5, -0.75]]) * length
    ax.plot(*bar.T, color="black", linewidth=1.6)
    ax.text(*(bar.mean(axis=0) - [0, 0.12 * length]), f"{length:g} {horizon(scene.problem).length}", ha="center", va="top")
    ax.axis("off")


def draw_rank(numbers: Numbers, folder: Path) -> Path:
    """Draw a position over time where G loses rank: one row per scene, stopped on the left, continued on the right."""
    figure, axes = grid_of_axes(len(rank.IVPS), len(rank.MODES), 5.6, x="time $t$  [s]", sharex=True, sharey="row")
    for axes_row, (problem, case) in zip(axes, rank.IVPS, strict=True):
        axes_row[0].set_ylabel(rank.SHOWN[problem][1])
        for ax, mode in zip(axes_row, rank.MODES, strict=True):
            ax.axvline(numbers.losses[problem], color=QUIET, linewidth=0.9, linestyle=(0, (2, 2)))
            for k, (name, stroke) in enumerate(STROKE.items()):
                rows = numbers.rank_paths
                run = rows[(rows["problem"] == problem) & (rows["method"] == name) & (rows["mode"] == mode)]
                ax.plot(run["t"], run["x"], label=name_of(name), markevery=(10 + 4 * k, 60), **stroke.points())
                ax.plot(run["t"].iloc[-1:], run["x"].iloc[-1:], linestyle="none", marker="|", markersize=11, color=stroke.color)
            ax.set_title(f"{problem} {case}, {mode}")
    legend_below(figure, axes[0, 0], 3, columnspacing=1.6)
    return save(figure, folder, "rank_loss", numbers.rank_paths)
