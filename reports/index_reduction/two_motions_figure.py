"""The picture of two motions: on a torus index reduction costs Gauss its energy, on a pendulum reversal saves it."""

from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from daebench.draw.figures import QUIET, WIDTH, save
from daebench.draw.methods import stroke_of
from daebench.draw.orthographic import seen
from daebench.pages.report.index import LEAD
from daebench.reports.index_reduction.two_motions import PENDULUM, TORUS, Motion, Run, envelope, motions_table
from daebench.runs.files import atomic
from daebench.runs.ivp import Array

NAMES = {
    "rattle": "RATTLE, order 2",
    "lobatto3": "Lobatto 3, order 4",
    "canonical:gauss2": "Gauss 2, angles and momenta",
    "local:gauss2": "Gauss 2, angles and rates",
    "gauss2": "Gauss 2, index reduced",
    "rk4": "RK4, index reduced",
}
PATHS = {TORUS.problem: 34.0, PENDULUM.problem: 26.0}
"""Length of the drawn paths, units of time."""

TITLES = {
    TORUS.problem: "Through the hole of a torus: index reduction costs Gauss its energy",
    PENDULUM.problem: "A pendulum, its own reverse up to a reflection: symmetric methods hold",
}
UNITS = {TORUS.problem: (r"\sqrt{r/\gamma}", r"m\gamma r"), PENDULUM.problem: (r"\sqrt{\ell/\gamma}", r"m\gamma\ell")}
"""Units of time and energy; r is the radius of the tube."""

REVERSED = {TORUS.problem: "reversed, it winds\nthe other way", PENDULUM.problem: "reversed, it is itself,\nseen in a mirror"}
BOTTOM, TOP = {TORUS.problem: 1e-7, PENDULUM.problem: 1e-10}, 30.0


def draw_motions(runs: Mapping[str, Mapping[str, Run]], facts: SimpleNamespace, folder: Path) -> Path:
    """Draw the picture into a folder, with its numbers beside it; return the path of the SVG."""
    figure = Figure(figsize=(WIDTH, 6.6))
    grid = figure.add_gridspec(2, 2, width_ratios=(1, 2.2))
    for row, motion in enumerate((TORUS, PENDULUM)):
        draw_path(figure.add_subplot(grid[row, 0]), runs[motion.problem]["rattle"], motion)
        ax = figure.add_subplot(grid[row, 1])
        draw_energies(ax, runs[motion.problem], motion)
        if motion is TORUS:
            ax.plot(facts.crossing, facts.flat, "o", color="black", markersize=5, markerfacecolor="white")
            ax.annotate(f"$t$ = {facts.crossing:.0f}", (facts.crossing, facts.flat), (-5, 7), textcoords="offset points", ha="right")
        time, energy = UNITS[motion.problem]
        ax.set_xlabel(f"time $t$  [${time}$],  the same step $h$ = {motion.h:g} for all")
        ax.set_ylabel(f"largest energy error so far  [${energy}$]")
        ax.set_title(TITLES[motion.problem], x=-0.62)
    return save(figure, folder, "two_motions", motions_table(runs))


def write_lead(facts: SimpleNamespace, folder: Path) -> Path:
    """Write the picture and the sentence that begin the index of the gallery into the folder of the report; return its path."""
    path = folder / LEAD
    with atomic(path) as scratch:
        scratch.write_text(
            '<figure><img src="index-reduction/figures/two_motions.png" loading="lazy" '
            'alt="Energy errors of the same methods on a torus and on a pendulum" style="width: 100%">\n'
            "<figcaption><b>Index reduction costs Gauss its energy.</b> On the index-reduced equation it begins "
            f"{facts.better:.0f} times as accurate as RATTLE, crosses its level at <i>t</i> = {facts.crossing:.0f}, and goes on. "
            "In angles and their momenta the same method stays level. On a motion that is its own reverse up to a reflection, below, "
            "symmetric methods hold.</figcaption></figure>\n",
            encoding="utf-8",
        )
    return path


def draw_path(ax: Any, run: Run, motion: Motion) -> None:
    """Draw the surface by some of its circles, and the beginning of the motion on it; what is behind the middle is pale."""
    for circle in circles(motion):
        line = seen(circle)
        ax.plot(line[:, 0], line[:, 1], color=QUIET, linewidth=0.5, alpha=0.5)
    path = seen(run.q[: round(PATHS[motion.problem] / motion.h) + 1])
    for behind, alpha in ((True, 0.35), (False, 1.0)):
        hidden = (path[:, 2] < 0) != behind
        x, y = (np.where(hidden, np.nan, path[:, i]) for i in (0, 1))
        ax.plot(x, y, color=stroke_of("rattle").color, linewidth=0.9, alpha=alpha)
    ax.plot(*path[0, :2], "o", color="black", markersize=5)
    ax.text(0.5, -0.04, REVERSED[motion.problem], transform=ax.transAxes, ha="center", va="top", fontsize=8.5)
    ax.set(aspect="equal")
    ax.axis("off")


def circles(motion: Motion) -> list[Array]:
    """Return circles that show the surface, shape(n, 3) each."""
    angle = np.linspace(0, 2 * np.pi, 121)
    if motion is PENDULUM:
        tilts = np.linspace(0, np.pi, 4, endpoint=False)
        upright = [np.stack([np.cos(angle) * np.cos(a), np.cos(angle) * np.sin(a), np.sin(angle)], axis=1) for a in tilts]
        return [np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1), *upright]
    turns = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    across = [torus_points(angle, np.full_like(angle, turn)) for turn in turns]
    return across + [torus_points(np.full_like(angle, turn), angle) for turn in turns[::3]]


def torus_points(theta: Array, phi: Array) -> Array:
    """Return points of the torus, shape(n, 3)."""
    big, small = (TORUS.ivp().parameters[name] for name in ("radius", "tube"))
    reach = big + small * np.cos(theta)
    return np.stack([reach * np.cos(phi), reach * np.sin(phi), small * np.sin(theta)], axis=1)


def draw_energies(ax: Any, runs: Mapping[str, Run], motion: Motion) -> None:
    """Draw the largest energy error up to each time, each curve named at its end."""
    ends = {}
    for name, run in runs.items():
        t, error = envelope(run, motion)
        stroke = stroke_of(name)
        small = name == "rk4"
        ax.plot(t, np.minimum(error, 1e3 * TOP), color=stroke.color, linestyle=stroke.dashes, linewidth=1.0 if small else 2.0)
        if not small:
            ends[name] = float(error[-1])
    places = apart(np.log10(np.array(list(ends.values()))), 0.9)
    for name, place in zip(ends, places, strict=True):
        ax.annotate(
            NAMES[name], (motion.t_end * 1.15, 10**place), color=stroke_of(name).color, va="center", annotation_clip=False, fontsize=8.5
        )
    gone = runs["rk4"].t[-1]
    ax.annotate("RK4", (gone, TOP / 3), (gone * 0.93, TOP / 3), color=stroke_of("rk4").color, ha="right", va="center", fontsize=8.5)
    ax.set(xscale="log", yscale="log", xlim=(motion.h, motion.t_end), ylim=(BOTTOM[motion.problem], TOP))


def apart(values: Array, least: float) -> Array:
    """Return values moved apart, in their order, so that neighbours differ by at least so much."""
    order = np.argsort(values)
    moved = values[order].copy()
    for _ in range(100):
        gaps = np.diff(moved)
        short = np.maximum(0.0, least - gaps) / 2
        if not short.any():
            break
        moved[:-1] -= short
        moved[1:] += short
    result = np.empty_like(moved)
    result[order] = moved
    return result
