"""The picture of the rigid body: the sphere seen from outside, exact curves on it, and states of runs on and below it."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from daebench.draw.figures import BLUE, GREEN, VERMILION, grid_of_axes, save
from daebench.draw.orthographic import seen
from daebench.reports.poisson.body import SHOWN, STARTS
from daebench.reports.poisson.numbers import Numbers
from daebench.runs.ivp import Array

COLORS, MARKERS = (BLUE, GREEN, VERMILION), ("o", "^", "D")
AXES = ("y1", "y2", "y3")
LABEL = {"boxstyle": "round,pad=0.1", "facecolor": "#f6f6f3", "edgecolor": "none", "alpha": 0.8}
REACH = 1.28
"""Length of the drawn axes."""


def draw_sphere(numbers: Numbers, folder: Path) -> Path:
    """Draw four methods, one sphere each: energy curves thin, those of the starts broad, states as dots; the rear is paler."""
    figure, axes = grid_of_axes(2, 2, 7.2)
    for ax, name in zip(axes.flat, SHOWN, strict=True):
        globe(ax)
        for (drawn, _, _), curve in numbers.polhodes.groupby(["drawn", "energy", "side"], sort=False):
            line(ax, seen(curve[list(AXES)].to_numpy()), str(drawn))
        for k, (color, marker) in enumerate(zip(COLORS, MARKERS, strict=True)):
            states = numbers.trajectories[(numbers.trajectories["method"] == name) & (numbers.trajectories["start"] == k)]
            dots(ax, seen(states[list(AXES)].to_numpy()), color, marker)
        ax.set_title(name, loc="center")
    handles = [
        axes[0, 0].plot([], [], linestyle="none", marker=marker, markersize=4.5, color=color)[0]
        for color, marker in zip(COLORS, MARKERS, strict=True)
    ]
    handles.append(axes[0, 0].plot([], [], color="#b0b0b0", linewidth=2.2)[0])
    handles.append(axes[0, 0].plot([], [], color="#555555", linewidth=1.0, linestyle=(0, (4, 2)))[0])
    labels = ["about axis 3", "about axis 1", "near axis 2", "exact", "separatrix"]
    assert len(STARTS) == len(COLORS)
    figure.legend(handles, labels, loc="outside lower center", ncols=5, columnspacing=1.5)
    return save(figure, folder, "sphere", table(numbers))


def globe(ax: Any) -> None:
    """Draw the outline of the sphere and the axes of the body, named, in units of |y0|."""
    from matplotlib.patches import Circle

    ax.add_patch(Circle((0, 0), 1, facecolor="#f6f6f3", edgecolor="#777777", linewidth=0.8, zorder=0))
    for axis, name in zip(np.eye(3), ("$y_1$", "$y_2$", "$y_3$"), strict=True):
        tip, pole = seen(REACH * axis[None])[0], seen(axis[None])[0]
        ax.annotate("", xy=tip[:2], xytext=pole[:2], arrowprops={"arrowstyle": "-|>", "color": "black", "linewidth": 0.8}, zorder=4)
        ax.plot([0, pole[0]], [0, pole[1]], color="#999999", linewidth=0.6, linestyle=(0, (1, 2)), zorder=1)
        ax.text(*(tip[:2] + 0.09 * tip[:2] / np.linalg.norm(tip[:2])), name, ha="center", va="center", zorder=6, bbox=LABEL)
    ax.set(xlim=(-1.3, 1.3), ylim=(-1.15, 1.35), aspect="equal")
    ax.axis("off")


def line(ax: Any, curve: Array, drawn: str) -> None:
    """Draw a curve on the sphere, pale at the rear."""
    styles = {"level": ("#9a9a9a", 0.6, "-"), "separatrix": ("#555555", 1.0, (0, (4, 2))), "start": ("#b0b0b0", 2.2, "-")}
    color, width, dashes = styles[drawn]
    for front, alpha, order in ((True, 1.0, 2), (False, 0.22, 1)):
        hidden = np.where(((curve[:, 2] >= 0) == front)[:, None], curve, np.nan)
        ax.plot(hidden[:, 0], hidden[:, 1], color=color, linewidth=width, linestyle=dashes, alpha=alpha, zorder=order)


def dots(ax: Any, points: Array, color: str, marker: str) -> None:
    """Draw the states of a run, those in front above those behind."""
    for front, alpha, order in ((True, 1.0, 3), (False, 0.25, 1.5)):
        hemisphere = points[(points[:, 2] >= 0) == front]
        style = {"linestyle": "none", "marker": marker, "markersize": 2.0, "markeredgewidth": 0, "color": color}
        ax.plot(hemisphere[:, 0], hemisphere[:, 1], alpha=alpha, zorder=order, **style)


def table(numbers: Numbers) -> pd.DataFrame:
    """Return the data of the picture: states by method, start and time, and the exact curves."""
    curves = numbers.polhodes.assign(method="exact: " + numbers.polhodes["drawn"])
    columns = ["method", "start", "t", "energy", "side", *AXES]
    return pd.concat([numbers.trajectories.drop(columns=["energy", "C"]), curves], ignore_index=True).reindex(columns=columns).round(6)
