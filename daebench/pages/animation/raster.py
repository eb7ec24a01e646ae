"""The frames of an animation as pixels: what does not move is drawn once, and the rest over it."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from textwrap import fill
from typing import Any

import numpy as np
import numpy.typing as npt

from daebench.draw.figures import QUIET, drawing
from daebench.draw.orthographic import projected
from daebench.pages.animation.animated_runs import AnimatedRuns
from daebench.pages.animation.panels import lines_at
from daebench.runs.trajectory import Array
from daebench.systems.lazily import matplotlib as mpl

Pixels = npt.NDArray[np.uint8]

ACROSS = 4
"""Most scenes in a row."""

DPI, INCHES = 100, 2.9
"""Pixels to the inch where no size is asked for, and inches of a scene's width."""

TITLE = 0.36
"""Height of a title above the scenes, inches."""

GRAPH = 1.7
"""Height of the curves, inches."""

CAPTION = 0.3
"""Height of the line below the curves, inches."""


@dataclass(frozen=True)
class Moving:
    """The artists that are drawn anew in each frame: the parts of each scene by kind, the cursors and the clock."""

    parts: list[dict[str, Any]]
    cursors: list[Any]
    clock: Any


def frames(animated: AnimatedRuns) -> Iterator[Pixels]:
    """Give the frames one by one, shape(height, width, 3), height and width even."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    with drawing():
        figure, scenes, graphs = _axes(animated)
        canvas: Any = FigureCanvasAgg(figure)
        moving = _drawn(animated, figure, scenes, graphs)
        canvas.draw()
        figure.set_layout_engine("none")  # the places that this drawing found stay
    still = canvas.copy_from_bbox(figure.bbox)
    shown = [run.shown(animated.times) for run in animated.runs]
    for n, time in enumerate(animated.times):
        canvas.restore_region(still)
        for k, parts in enumerate(moving.parts):
            _place(parts, lines_at(animated, k, int(shown[k][n])))
            for artist in parts.values():
                scenes[k].draw_artist(artist)
        for cursor in moving.cursors:
            cursor.set_xdata([time, time])
            cursor.axes.draw_artist(cursor)
        moving.clock.set_text(f"t = {time:.4g}")
        figure.draw_artist(moving.clock)
        yield np.array(canvas.buffer_rgba())[:, :, :3]


def _axes(animated: AnimatedRuns) -> tuple[Any, list[Any], list[Any]]:
    """Return a figure, the axes of the scenes and those of the curves."""
    columns = min(len(animated.runs), ACROSS)
    rows, across = math.ceil(len(animated.runs) / columns), max(columns, 2)
    abreast = min(len(animated.columns), ACROSS if animated.size else across)
    lines = math.ceil(len(animated.columns) / abreast)
    head = TITLE if animated.title else 0.0
    width, height = INCHES * across, head + INCHES * rows + GRAPH * lines + CAPTION
    pixels = animated.size or (2 * round(width * DPI / 2), 2 * round(height * DPI / 2))
    dpi = min(pixels[0] / width, pixels[1] / height)
    figure = mpl.figure.Figure(figsize=(pixels[0] / dpi, pixels[1] / dpi), dpi=dpi)
    parts: Any = figure.subfigures(3, 1, height_ratios=[head + INCHES * rows, GRAPH * lines, CAPTION])
    upper, lower, _ = parts
    if animated.title:
        upper.suptitle(animated.title, fontsize=12)
    scenes = list(upper.subplots(rows, columns, squeeze=False).flat)
    graphs = list(lower.subplots(lines, abreast, squeeze=False).flat)
    for spare in [*scenes[len(animated.runs) :], *graphs[len(animated.columns) :]]:
        spare.axis("off")
    return figure, scenes, graphs


def _drawn(animated: AnimatedRuns, figure: Any, scenes: list[Any], graphs: list[Any]) -> Moving:
    """Draw all that does not move, and return what does."""
    parts = [_scene(animated, k, scenes[k]) for k in range(len(animated.runs))]
    cursors = [_graph(animated, column, ax) for column, ax in zip(animated.columns, graphs, strict=False)]
    note = f"{animated.problem}, case {animated.case}; {animated.pace}"
    figure.text(0.012, 0.012, fill(note, 150), fontsize=8, color=QUIET, va="bottom")
    clock = figure.text(0.988, 0.012, "", fontsize=9, ha="right", va="bottom", animated=True)
    return Moving(parts, cursors, clock)


def _scene(animated: AnimatedRuns, k: int, ax: Any) -> dict[str, Any]:
    stroke = animated.stroke(k)
    for line in projected(animated.layout.surface):
        ax.plot(*line.T, color="#c4c4c4", linewidth=0.5, zorder=0)
    ax.plot(
        *animated.flat[k][0, animated.layout.fixed].T,
        linestyle="none",
        marker="o",
        markersize=5,
        markerfacecolor="white",
        markeredgecolor=QUIET,
    )
    x, y = animated.square if animated.equal else animated.box
    ax.set(xlim=(x.low, x.high), ylim=(y.low, y.high))
    if animated.equal:
        ax.set_aspect("equal")
    if animated.layout.dimension == 3:
        _triad(animated, ax)
    else:
        ax.set(xlabel=x.label, ylabel=y.label)
    ax.set_title(animated.scene_title(k), color=stroke.color)
    quiet: dict[str, Any] = {"animated": True, "solid_capstyle": "round"}
    lines = {"springs": "-"} if animated.layout.springs else {}
    lines |= {"dampers": "--"} if animated.layout.dampers else {}
    return {
        "trail": ax.plot([], [], color=stroke.color, linewidth=1.2, **quiet)[0],
        **{kind: ax.plot([], [], color="black", linewidth=1.0, linestyle=dashes, **quiet)[0] for kind, dashes in lines.items()},
        "rods": ax.plot([], [], color="black", linewidth=1.8, **quiet)[0],
        "masses": ax.plot(
            [], [], color=stroke.color, linestyle="none", marker="o", markersize=0.8 * animated.disc, markeredgewidth=0, animated=True
        )[0],
    }


def _triad(animated: AnimatedRuns, ax: Any) -> None:
    """Draw the three directions of space with their names, in the lower left corner."""
    corner, size = animated.corner
    for axis, name in zip(np.eye(3), animated.layout.axes or "xyz", strict=True):
        tip = projected(axis[None])[0]
        ax.plot(*np.stack([corner, corner + 0.8 * size * tip]).T, color=QUIET, linewidth=1)
        ax.text(*(corner + 1.25 * size * tip), name, fontsize=7, color=QUIET, ha="center", va="center")
    ax.axis("off")


def _graph(animated: AnimatedRuns, column: str, ax: Any) -> Any:
    """Draw an error over time; return the cursor."""
    axis = animated.error_axis(column)
    for k, run in enumerate(animated.runs):
        if column in run.errors:
            ax.plot(run.t, np.where(run.errors[column] > 0, run.errors[column], np.nan), linewidth=1.1, **animated.stroke(k).line())
    ax.set(xlim=(0, animated.t_end), ylim=(axis.low, axis.high), yscale="log", xlabel=animated.time_axis.label)
    ax.set_title(axis.label)
    return ax.plot([0, 0], [axis.low, axis.high], color="black", linewidth=0.8, animated=True)[0]


def _place(parts: dict[str, Any], lines: dict[str, list[Array]]) -> None:
    """Move the parts of a scene; lines of one kind are one line with gaps."""
    gap = np.full((1, 2), np.nan)
    for kind, artist in parts.items():
        whole = np.concatenate([gap, *(piece for line in lines[kind] for piece in (line, gap))])
        artist.set_data(whole[:, 0], whole[:, 1])
