"""The figures of the report on methods that have axes: orders, defects, a long run, and work."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from daebench.draw.figures import BLUE, QUIET, drawing, grid_of_axes, legend_below, save
from daebench.draw.methods import curve_of
from daebench.pages.report.thumbnail import draw_thumbnail
from daebench.reports.methods.families import TITLES, by_family, family
from daebench.reports.methods.guide import EVALUATIONS
from daebench.reports.methods.matrix_figure import ROW, draw_few, draw_main, draw_matrix, rows_of
from daebench.reports.methods.numbers import Numbers
from daebench.reports.methods.series import KEEPING
from daebench.reports.methods.sweep import PENDULUM, TORUS

LEAST, EPS = 1e-17, 2.3e-16
"""Smaller values are drawn at this value, the spacing of numbers at 1."""

PANELS = (
    ("schemes for (1.9), symplectic", ("symplectic",)),
    ("compositions", ("composed",)),
    ("DAE schemes, not symplectic", ("other", "dae")),
    ("index-reduced ODE (1.18)", ("ode",)),
    ("projections and other forms", ("projected", "form")),
)
"""Panels of the figure of orders, and the families in each."""

SAME = {"lie_adjoint", "symplectic_euler_adjoint", "lobatto2", "shake", "rattle_gauss_seidel", "rattle_ilves", "midpoint+proj"}
SAME |= {"rk4+symproj", "radau2_index2"}
"""Methods whose errors lie on the curve of another one."""


def draw(numbers: Numbers, table: pd.DataFrame, folder: Path) -> dict[str, Path]:
    """Draw all figures into a folder; return the paths of the SVG files by stem."""
    rows = rows_of(table, numbers)
    with drawing():
        paths = [
            draw_main(rows, folder),
            draw_matrix(rows, folder),
            draw_orders(numbers.points, folder),
            draw_defects(numbers.defects, folder),
            draw_long(numbers, folder),
            draw_work(numbers.work, folder),
        ]
    draw_thumbnail(folder, lambda axis: draw_few(axis, rows))
    return {path.stem: path for path in paths}


def draw_orders(points: pd.DataFrame, folder: Path) -> Path:
    """Draw errors of the position against h, one panel for a few families each, and one for some methods on the torus."""
    shown = points[points["component"] == "q"]
    figure, axes = grid_of_axes(3, 2, 10.8, y="largest error of $q$ (m)", sharey=True)
    pendulum = shown[shown["problem"] == PENDULUM.problem]
    for ax, (title, families) in zip(axes.flat, PANELS, strict=False):
        panel_methods = [name for name in pendulum["method"].unique() if family(name) in families and name not in SAME]
        draw_panel(ax, pendulum, panel_methods, title)
    torus = shown[shown["problem"] == TORUS.problem]
    draw_panel(axes[2, 1], torus, list(torus["method"].unique()), "some of them, on the torus")
    return save(figure, folder, "orders", shown)


def draw_panel(ax: Any, points: pd.DataFrame, methods: Sequence[str], title: str) -> None:
    """Draw the errors that a fit used as joined markers, and all others as grey points."""
    for name in methods:
        rows = points[points["method"] == name].dropna(subset=["error"])
        used = rows[rows["used"]]
        ax.plot(rows["h"], rows["error"].clip(upper=10), linestyle="none", marker=".", color="#bbbbbb", markersize=2.5, zorder=1)
        ax.plot(used["h"], used["error"], **curve_of(name) | {"markersize": 3.2, "label": name})
    ax.set(xscale="log", yscale="log", title=title, ylim=(1e-15, 20))
    ax.set_xlabel("step size $h$ (s)", labelpad=1)
    if methods:
        ax.legend(fontsize=6.8, loc="upper center", bbox_to_anchor=(0.44, -0.17), ncols=2, handlelength=2.0, columnspacing=0.8)


def draw_defects(defects: pd.DataFrame, folder: Path) -> Path:
    """Draw the defects of two-form and symmetry against h."""
    figure, axes = grid_of_axes(1, 2, 4.6, sharey=True)
    names = list(defects["method"].unique())
    for ax, (column, title) in zip(axes[0], (("symplectic", "two-form"), ("symmetric", "symmetry")), strict=True):
        for name in sorted(names, key=KEEPING.__contains__):
            method_defects = defects[defects["method"] == name]
            ax.plot(method_defects["h"], method_defects[column].clip(lower=LEAST), **curve_of(name) | {"markersize": 3.6})
        ax.axhspan(LEAST, 1e-13, color="#eeeeee", zorder=0, linewidth=0)
        ax.set(xscale="log", yscale="log", title=f"defect of the {title}", xlabel="step size $h$ (s)", ylim=(LEAST, 10))
    axes[0, 0].set_ylabel("defect of ten steps")
    legend_below(figure, axes[0, 0], 4)
    return save(figure, folder, "defects", defects)


def draw_long(numbers: Numbers, folder: Path) -> Path:
    """Draw the largest energy error and distance from the manifold in each window of the long run."""
    figure, axes = grid_of_axes(1, 2, 4.4, sharey=True)
    for ax, (column, title) in zip(axes[0], (("energy", "energy error (J)"), ("distance", "distance from the manifold")), strict=True):
        for k, (name, windows) in enumerate(numbers.energy.groupby("method", sort=False)):
            shown = windows[np.isfinite(windows[column]) & (windows[column] < 1e2)]
            ax.plot(shown["t"], shown[column].clip(lower=LEAST), markevery=(2 * k, 20), **curve_of(str(name)))
        ax.axhspan(LEAST, EPS, color="#eeeeee", zorder=0, linewidth=0)
        ax.set(yscale="log", title=title, xlabel="time $t$ (s)", ylim=(LEAST, 1e2))
    axes[0, 0].set_ylabel("largest in a hundredth of the run")
    legend_below(figure, axes[0, 0], 4)
    return save(figure, folder, "long", numbers.energy)


def draw_work(work: pd.DataFrame, folder: Path) -> Path:
    """Draw Newton iterations, evaluations and time of a step, one line per method."""
    rows = by_family(list(work["method"]))
    methods = [name for names in rows.values() for name in names]
    data = work.set_index("method").loc[methods]
    data = data.assign(evaluations=data[list(EVALUATIONS)].sum(axis=1))
    figure, axes = grid_of_axes(1, 3, ROW * (len(methods) + 6), sharey=True)
    y = np.arange(len(methods))
    titles = {"newton": "Newton iterations", "evaluations": "evaluations", "ns": "CPU time (ns)"}
    for ax, (column, title) in zip(axes[0], titles.items(), strict=True):
        ax.plot(data[column], y, color=BLUE, marker="o", linestyle="none", markersize=4.2)
        ax.set(title=title, ylim=(len(methods) - 0.4, -0.6))
        ax.set_xscale("symlog" if column == "newton" else "log")
        ax.set_xlim(-0.4 if column == "newton" else None, 1.5 * data[column].max())
        ax.grid(visible=True, axis="y", linewidth=0.4)
    axes[0, 0].set_yticks(y, methods, fontsize=7)
    edges = np.cumsum([len(names) for names in rows.values()])[:-1]
    for ax in axes[0]:
        for edge in edges:
            ax.axhline(edge - 0.5, color=QUIET, linewidth=0.6)
    return save(figure, folder, "work", data.reset_index().assign(family=[TITLES[family(name)] for name in methods]))
