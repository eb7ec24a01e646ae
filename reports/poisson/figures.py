"""Figures of the report on Poisson systems with curves over time or step size; orbits and spheres are in separate files."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from daebench.draw.figures import QUIET, drawing, grid_of_axes, legend_below, save
from daebench.draw.methods import name_of, stroke_of
from daebench.pages.report.thumbnail import draw_thumbnail
from daebench.reports.poisson.casimirs import SYSTEMS, TITLES
from daebench.reports.poisson.defects import slopes
from daebench.reports.poisson.lattice import METHODS as LATTICE_METHODS
from daebench.reports.poisson.lattice import H
from daebench.reports.poisson.numbers import Numbers
from daebench.reports.poisson.orbit_figures import draw_energy, draw_orbit, draw_orbits
from daebench.reports.poisson.sphere import draw_sphere

LEAST = 1e-17
"""Smaller values are drawn at this value."""

EPS = 2.3e-16


def draw(numbers: Numbers, folder: Path) -> dict[str, Path]:
    """Draw all figures into a folder; return the paths of the SVG files by stem."""
    with drawing():
        paths = [
            draw_orbits(numbers.orbits, folder),
            draw_energy(numbers.orbits, folder),
            draw_defects(numbers, folder),
            draw_casimirs(numbers.casimir_series, folder),
            draw_lattice(numbers, folder),
            draw_sphere(numbers, folder),
        ]
    draw_thumbnail(folder, lambda axis: draw_orbit(axis, numbers.orbits, "verlet"))
    return {path.stem: path for path in paths}


def draw_defects(numbers: Numbers, folder: Path) -> Path:
    """Draw defects against h: on predator and prey, and both defects of constrained methods, with the fitted powers at the curves."""
    figure, axes = grid_of_axes(1, 3, 4.5, sharey=True)
    panels = (
        ("defect", "(a) Poisson, predator and prey"),
        ("symplectic", "(b) symplectic, pendulum"),
        ("poisson", "(c) Poisson, in its chart"),
    )
    for ax, (column, title) in zip(axes[0], panels, strict=True):
        frame = numbers.defects if column == "defect" else numbers.lemma
        powers = slopes(frame, column).set_index("method")["slope"]
        label_heights: list[float] = []
        for name, method_defects in frame.groupby("method", sort=False):
            stroke, value = stroke_of(str(name)), method_defects[column].clip(lower=LEAST)
            ax.plot(method_defects["h"], value, label=name_of(str(name)), **stroke.points())
            if np.isfinite(powers[name]) and all(abs(np.log(value.iloc[0] / other)) > 1 for other in label_heights):
                ax.text(method_defects["h"].max() * 1.2, value.iloc[0], f"{powers[name]:.1f}", color=stroke.color, fontsize=8, va="center")
                label_heights.append(value.iloc[0])
        ax.axhspan(LEAST, 1e-14, color="#eeeeee", zorder=0, linewidth=0)
        ax.set(
            xscale="log",
            yscale="log",
            title=title,
            xlabel="step size $h$",
            xlim=(method_defects["h"].min() / 1.5, method_defects["h"].max() * 2.2),
        )
    axes[0, 0].set_ylabel("defect")
    axes[0, 0].text(axes[0, 0].get_xlim()[0] * 1.1, 1.3e-14, "round-off", color=QUIET, fontsize=8, va="bottom")
    legends: list[tuple[str, Any, Any]] = [
        ("methods of (a):", axes[0, 0], "outside lower left"),
        ("of (b), (c):", axes[0, 1], "outside lower right"),
    ]
    for heading, ax, place in legends:
        handles, labels = ax.get_legend_handles_labels()
        figure.legend(handles, labels, loc=place, title=heading, alignment="left")
    frames = [numbers.defects.assign(kind="poisson, lotka_volterra").rename(columns={"defect": "value"})]
    frames += [numbers.lemma.assign(kind=f"{kind}, spherical_pendulum", value=numbers.lemma[kind]) for kind in ("symplectic", "poisson")]
    return save(figure, folder, "defects", pd.concat(frames, ignore_index=True)[["kind", "method", "h", "value"]])


def draw_casimirs(series: pd.DataFrame, folder: Path) -> Path:
    """Draw the largest error so far of the Casimir functions against time, one panel per system."""
    figure, axes = grid_of_axes(1, 3, 3.5, sharey=True)
    for ax, problem in zip(axes[0], SYSTEMS, strict=True):
        for name, history in series[series["problem"] == problem].groupby("method", sort=False):
            plot_so_far(ax, history["t"], history["casimir"], str(name))
        ax.set(xscale="log", yscale="log", title=TITLES[problem], xlabel="time $t$", ylim=(LEAST / 2, 1e-1))
    axes[0, 0].set_ylabel("largest Casimir error so far")
    legend_below(figure, axes[0, 0], 5, columnspacing=1.3)
    return save(figure, folder, "casimirs", series)


def plot_so_far(ax: Any, t: "pd.Series[float]", value: "pd.Series[float]", name: str) -> None:
    """Draw one curve over time, with a few markers."""
    begin = len(ax.lines)
    ax.plot(t, np.maximum(value, LEAST), label=name_of(name), markevery=(4 * begin, 40), **stroke_of(name).points())
    ax.axhspan(LEAST / 2, EPS, color="#eeeeee", zorder=0, linewidth=0)


def draw_lattice(numbers: Numbers, folder: Path) -> Path:
    """Draw the largest error so far of energy and integrals of the lattice against time, one panel per quantity."""
    series = numbers.lattice_series[numbers.lattice_series["h"] == H]
    figure, axes = grid_of_axes(2, 2, 5.2, x="time $t$", y="largest error so far", sharex=True, sharey=True)
    titles = {"energy": "energy $H$", "norm": "norm", "coupling": "coupling", "momentum": "momentum"}
    for ax, (quantity, title) in zip(axes.flat, titles.items(), strict=True):
        for name in LATTICE_METHODS:
            history = series[series["method"] == name]
            plot_so_far(ax, history["t"], history[quantity], name)
        ax.set(xscale="log", yscale="log", title=f"{title}, ${numbers.sizes[quantity]:.3g}$ at the start", ylim=(LEAST / 2, 1e2))
    legend_below(figure, axes[0, 0], 5, columnspacing=1.3)
    return save(figure, folder, "lattice", series)
