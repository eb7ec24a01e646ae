"""The picture of three ways to hold the rod: the three orbits above the energy errors to t = 5000."""

from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from daebench.draw.figures import QUIET, WIDTH, save
from daebench.draw.methods import stroke_of
from daebench.draw.orthographic import seen
from daebench.reports.index_reduction.rods import EARLY, ROD, T_END, H, Held, envelope, rods_table
from daebench.runs.ivp import Array

NAMES = {"rattle": "RATTLE", "se": "symplectic Euler, index reduced", "rk4": "RK4, index reduced"}
ORBIT = 26.0
"""Length of the drawn orbits, units of time: four swings."""

REACH = 1.12
FAR = 3.0
"""Distance at which a far point is drawn: outside the picture, in its direction."""

BOTTOM, TOP = 1e-10, 10.0
ENERGY = r"largest energy error so far  [$m\gamma\ell$]"


def draw_rods(runs: Mapping[str, Held], facts: SimpleNamespace, folder: Path) -> Path:
    """Draw the picture into a folder, with its numbers beside it; return the path of the SVG."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, 6.4))
    grid = figure.add_gridspec(2, 3, height_ratios=(1, 1.25))
    words = {
        "rattle": ("holds the rod", f"$t$ = {T_END:g}: length 1"),
        "se": ("lets it shrink", f"$t$ = {runs['se'].t[facts.short]:g}: length {ROD:g}"),
        "rk4": ("loses it", f"$t$ = {facts.gone:.0f}: gone"),
    }
    for k, (name, run) in enumerate(runs.items()):
        draw_orbit(figure.add_subplot(grid[0, k]), run, last_shown(name, run, facts), name, words[name])
    draw_energies(figure.add_subplot(grid[1, :]), runs, facts)
    return save(figure, folder, "rods", rods_table(runs))


def last_shown(name: str, run: Held, facts: SimpleNamespace) -> int:
    """Return the index of the drawn state: for ``se`` the first with a rod of :data:`ROD`, otherwise the last, or the first far away."""
    if name == "se":
        return int(facts.short)
    return int(np.flatnonzero(run.rod < REACH)[-1]) + (run.failure is not None)


def draw_orbit(ax: Any, run: Held, last: int, name: str, words: tuple[str, str]) -> None:
    """Draw the sphere, the end of an orbit and the rod if it still exists; the part behind the middle of the sphere is pale."""
    color = stroke_of(name).color
    first = max(0, last - round(ORBIT / H))
    outline(ax)
    path = seen(run.q[first : last + 1])
    if run.rod[last] > REACH:
        path[-1] *= FAR / run.rod[last]
    for behind, alpha in ((True, 0.3), (False, 0.9)):
        hidden = (path[:, 2] < 0) != behind
        x, y = (np.where(hidden, np.nan, path[:, i]) for i in (0, 1))
        ax.plot(x, y, color=color, linewidth=0.9, alpha=alpha)
    if run.rod[last] < REACH:
        ax.plot([0, path[-1, 0]], [0, path[-1, 1]], color="black", linewidth=1.6, solid_capstyle="round")
        ax.plot(*path[-1, :2], "o", color=color, markersize=8)
    else:
        ax.plot(path[-3:, 0], path[-3:, 1], color=color, linewidth=0.9)
    ax.plot(0, 0, "o", color="black", markersize=3)
    ax.set_title(f"{NAMES[name]}\n{words[0]}", color=color, loc="center")
    ax.text(0, -1.2, words[1], ha="center", va="top")
    ax.set(xlim=(-REACH, REACH), ylim=(-1.34, REACH), aspect="equal")
    ax.axis("off")


def outline(ax: Any) -> None:
    """Draw the sphere of radius 1: its edge, and its equator."""
    angle = np.linspace(0, 2 * np.pi, 181)
    ax.plot(np.cos(angle), np.sin(angle), color=QUIET, linewidth=0.9)
    equator: Array = seen(np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1))
    ax.plot(equator[:, 0], equator[:, 1], color=QUIET, linewidth=0.6, alpha=0.6)


def draw_energies(ax: Any, runs: Mapping[str, Held], facts: SimpleNamespace) -> None:
    """Draw the largest energy error up to each time, and say where the runs start, cross and end."""
    for name, run in runs.items():
        t, error = envelope(run)
        ax.plot(t, np.minimum(np.maximum.accumulate(error), 1e3 * TOP), color=stroke_of(name).color, linewidth=2.0)
    color = {name: stroke_of(name).color for name in runs}
    box = {"va": "center", "fontsize": 8.5}
    ax.text(3.0, facts.flat * 2.2, NAMES["rattle"], color=color["rattle"], fontweight="bold", **box)
    ax.text(0.055, 0.22, NAMES["se"], color=color["se"], fontweight="bold", **box)
    ax.text(9.0, 8e-8, NAMES["rk4"], color=color["rk4"], fontweight="bold", **box)
    ax.text(9.0, 1.3e-8, f"{digits(facts.better)} times as accurate as RATTLE\nup to $t$ = {EARLY:g}", color=color["rk4"], **box)
    ax.plot(facts.crossing, facts.flat, "o", color="black", markersize=5, markerfacecolor="white")
    ax.annotate(
        f"crosses at $t$ = {facts.crossing:.0f}", (facts.crossing, facts.flat), (150, 4e-5), arrowprops={"arrowstyle": "-", "color": QUIET}
    )
    ax.text(facts.se_stops * 1.15, 2.5, f"stops at $t$ = {facts.se_stops:.0f}", color=color["se"], **box)
    ax.text(facts.gone * 0.9, 2.5, rf"$\infty$ at $t$ = {facts.gone:.0f}", color=color["rk4"], ha="right", **box)
    ax.set(xscale="log", yscale="log", xlim=(H, T_END), ylim=(BOTTOM, TOP), ylabel=ENERGY)
    ax.set_xlabel(rf"time $t$  [$\sqrt{{\ell/\gamma}}$],  the same step $h$ = {H:g} for all")


def digits(value: float) -> str:
    """Return a large number by its two leading digits."""
    return f"{float(f'{value:.1e}'):.0f}"
