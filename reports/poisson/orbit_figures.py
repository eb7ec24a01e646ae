"""HLW Fig. 4.1 and the energy errors of its runs."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from daebench.draw.figures import BLUE, QUIET, VERMILION, grid_of_axes, save
from daebench.reports.poisson.orbits import CASES, METHODS, PRINTED, Orbits

COLORS = dict(zip(CASES, (BLUE, VERMILION), strict=True))
NAMES = {
    "symplectic_euler_adjoint": "symplectic Euler, adjoint",
    "verlet": "Störmer\N{EN DASH}Verlet",
    "midpoint": "implicit midpoint",
    PRINTED: "symplectic Euler as printed",
}
LIMITS = {"xlim": (-0.4, 9.6), "ylim": (-1.4, 9.4)}


def draw_orbits(orbits: Orbits, folder: Path) -> Path:
    """Draw Fig. 4.1 and, in a fourth panel, the form that leaves the domain; exact orbits in grey beneath."""
    figure, axes = grid_of_axes(2, 2, 6.4, x="predators $u$", y="prey $v$", sharex=True, sharey=True)
    for ax, name in zip(axes.flat, (*METHODS, PRINTED), strict=True):
        ax.axhspan(-3, 0, color="#eeeeee", zorder=0, linewidth=0)
        ax.axvspan(-3, 0, color="#eeeeee", zorder=0, linewidth=0)
        for case in CASES:
            exact = orbits.exact[orbits.exact["case"] == case]
            ax.plot(exact["u"], exact["v"], color="#a8a8a8", linewidth=2.4, zorder=1, solid_capstyle="round")
            orbit = orbits.points[(orbits.points["case"] == case) & (orbits.points["method"] == name)]
            marker = "o" if case == CASES[0] else "D"
            ax.plot(
                orbit["u"], orbit["v"], linestyle="none", marker=marker, markersize=1.7, markeredgewidth=0, color=COLORS[case], zorder=3
            )
            ax.plot(
                orbit["u"].iloc[0], orbit["v"].iloc[0], marker=marker, markersize=5, markerfacecolor="white", color=COLORS[case], zorder=4
            )
        ax.set(title=NAMES[name], **LIMITS)
    for row in orbits.table[orbits.table["method"] == PRINTED].to_dict("records"):
        draw_leap(axes[1, 1], row)
    axes[0, 0].text(9.5, -0.25, "outside the domain", color=QUIET, fontsize=8, ha="right", va="top")
    axes[0, 0].plot([], [], color="#a8a8a8", linewidth=2.4, label="exact")
    for case in CASES:
        marker = "o" if case == CASES[0] else "D"
        axes[0, 0].plot([], [], marker=marker, markersize=4, linestyle="none", color=COLORS[case], label=f"from ({case})")
    axes[0, 0].legend(loc="upper right")
    return save(figure, folder, "orbits", shown(orbits))


def draw_orbit(ax: Any, orbits: Orbits, name: str) -> None:
    """Draw the orbits of one method, exact ones in grey beneath."""
    for case in CASES:
        exact, orbit = orbits.exact[orbits.exact["case"] == case], orbits.points[orbits.points["case"] == case]
        ax.plot(exact["u"], exact["v"], color="#a8a8a8", linewidth=3.0)
        own = orbit[orbit["method"] == name]
        ax.plot(own["u"], own["v"], linestyle="none", marker="o", markersize=1.6, markeredgewidth=0, color=COLORS[case])
    ax.set_title("predators and prey", loc="left")
    ax.set(xticks=[0, 5], yticks=[0, 5])


def draw_leap(ax: Any, row: dict[Any, Any]) -> None:
    """Draw the step that would leave the domain, up to the edge of the panel."""
    begin, end = np.array([row["u"], row["v"]]), np.array([row["u_next"], row["v_next"]])
    share = min(1.0, (begin[1] - LIMITS["ylim"][0]) / (begin[1] - end[1]))
    shown_end = begin + share * (end - begin)
    arrow = {"arrowstyle": "-|>", "color": COLORS[row["case"]], "linewidth": 1.4, "shrinkA": 3, "shrinkB": 0}
    ax.annotate("", xy=tuple(shown_end), xytext=tuple(begin), arrowprops=arrow, zorder=5)
    ax.text(*(begin + 0.62 * (shown_end - begin) + [0.2, 0]), f"step {row['steps'] + 1}", color=COLORS[row["case"]], fontsize=8)


def shown(orbits: Orbits) -> pd.DataFrame:
    """Return the data of the figure: states of the runs by step, and the exact curves, with four digits after the point."""
    steps = orbits.points.groupby(["case", "method"]).cumcount()
    runs = orbits.points.assign(step=steps)[["case", "method", "step", "u", "v"]]
    exact = orbits.exact.assign(method="exact", step=-1)[["case", "method", "step", "u", "v"]]
    return pd.concat([runs, exact], ignore_index=True).round(4)


def draw_energy(orbits: Orbits, folder: Path) -> Path:
    """Draw the energy error over time of the three methods, both orbits in each panel."""
    figure, axes = grid_of_axes(2, 3, 4.2, x="time $t$", sharex=True, sharey="row")
    points = orbits.points[orbits.points["method"].isin(METHODS)]
    for row, case in zip(axes, reversed(CASES), strict=True):
        for ax, name in zip(row, METHODS, strict=True):
            orbit = points[(points["case"] == case) & (points["method"] == name)]
            ax.axhline(0, color=QUIET, linewidth=0.8)
            ax.plot(orbit["t"], orbit["energy"], color=COLORS[case], linewidth=0.6)
        row[0].set_ylabel(f"energy error, from ({case})")
    for ax, name in zip(axes[0], METHODS, strict=True):
        ax.set_title(NAMES[name])
    return save(figure, folder, "energy", points[["case", "method", "t", "energy"]])
