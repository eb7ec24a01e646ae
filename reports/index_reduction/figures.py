"""The figures of the report on index reduction."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from daebench.draw.figures import QUIET, drawing, grid_of_axes, legend_below, save
from daebench.draw.methods import name_of, stroke_of
from daebench.pages.report.thumbnail import draw_thumbnail
from daebench.reports.index_reduction.numbers import DRIFT_RUNS, FAST, FORMULATIONS, SCHEMES, SLOW, Numbers

NAMES = {
    "se": "symplectic Euler on (1.18), se",
    "seproj": "se with projection, seproj",
    "symplectic_euler": "constrained symplectic Euler",
    "symplectic_euler_adjoint": "adjoint of constrained symplectic Euler",
    "implicit_euler": "constrained implicit Euler",
    "shake": "SHAKE",
    "rattle": "RATTLE",
}
STROKE = {name: stroke_of(name) for name in NAMES}
TIME = r"time $t$  [$\sqrt{\ell/\gamma}$]"
ENERGY = r"energy error  [$m\gamma\ell$]"
WINDOW = 3.0
CLEAR = 3.0
"""Standard errors from which on the slope of a line counts as different from zero."""


def draw(numbers: Numbers, ida: pd.DataFrame, folder: Path) -> dict[str, Path]:
    """Draw all figures into a folder; return the paths of the SVG files by stem."""
    with drawing():
        paths = [
            draw_energy(numbers, folder),
            draw_together(numbers, folder),
            draw_swing(numbers.swing, folder),
            draw_defects(numbers.defects, folder),
            draw_ida(ida, folder),
        ]
    draw_thumbnail(folder, lambda axis: _thumbnail(axis, numbers))
    return {path.stem: path for path in paths}


def _thumbnail(axis: Any, numbers: Numbers) -> None:
    """Draw the energy errors of the four runs, each with its name."""
    for name, h in DRIFT_RUNS.items():
        t, most = windows(numbers.drift[name], "energy_error")
        axis.plot(t, most, color=STROKE[name].color, linewidth=1.6)
        axis.text(1.02 * t[-1], most[-1], f"{name_of(name)}, $h$ = {h:g}", color=STROKE[name].color, fontsize=6.5, va="center")
    axis.set(yscale="log", xticks=[0, 50, 100])
    axis.minorticks_off()
    axis.spines["right"].set_visible(False)
    axis.set_title("energy error over time, pendulum", loc="left")


def draw_energy(numbers: Numbers, folder: Path) -> Path:
    """Draw the energy error of the four runs, each on a separate linear scale, with the fitted line."""
    figure, axes = grid_of_axes(2, 2, 4.3, x=TIME, y=ENERGY, sharex=True)
    for ax, (name, h) in zip(axes.flat, DRIFT_RUNS.items(), strict=True):
        run, fit, stroke = numbers.drift[name], numbers.drift_fit[name], STROKE[name]
        ax.axhline(0, color=QUIET, linewidth=0.8)
        ax.plot(run["t"], run["energy_error"], color=stroke.color, linewidth=1.0)
        if abs(fit.slope) > CLEAR * fit.slope_error:
            line = fit.slope * (run["t"] - run["t"].mean()) + run["energy_error"].mean()
            ax.plot(run["t"], line, color="black", linewidth=1.1, linestyle=(0, (5, 2)))
        ax.set_title(f"{NAMES[name]}, $h$ = {h:g}")
        ax.margins(x=0.01)
    figure.align_ylabels()
    return save(figure, folder, "energy", long_table(numbers))


def draw_together(numbers: Numbers, folder: Path) -> Path:
    """Draw all four runs on common logarithmic scales: the largest energy error, and the largest distance, in a window."""
    figure, axes = grid_of_axes(1, 2, 3.5, sharex=True)
    columns: dict[str, Any] = {}
    for ax, quantity, label in zip(axes[0], ("energy_error", "distance"), (ENERGY, "distance from the manifold"), strict=True):
        for k, (name, h) in enumerate(DRIFT_RUNS.items()):
            t, most = windows(numbers.drift[name], quantity)
            columns |= {"t": t, f"{quantity}_{name}": most}
            ax.plot(t, np.maximum(most, 1e-17), label=f"{NAMES[name]}, $h$ = {h:g}", markevery=(k, 4), **STROKE[name].points())
        ax.set(yscale="log", xlabel=TIME, ylabel=f"largest |{label}|" if quantity == "energy_error" else f"largest {label}")
    axes[0, 1].axhspan(1e-17, 2.3e-16, color="#eeeeee", zorder=0)
    axes[0, 1].text(99, 3.4e-16, "round-off", ha="right", va="bottom", color=QUIET, fontsize=8)
    axes[0, 1].set_ylim(1e-17, 1e-1)
    legend_below(figure, axes[0, 0], 2)
    return save(figure, folder, "drift", columns)


def draw_swing(swing: pd.DataFrame, folder: Path) -> Path:
    """Draw the height of the pendulum for both Euler methods, and their energies."""
    figure, axes = grid_of_axes(3, 1, 4.7, sharex=True)
    strokes = {name: STROKE[name] for name in ("symplectic_euler", "implicit_euler")}
    low, high = swing[["q3_symplectic_euler", "q3_implicit_euler"]].min().min(), swing["q3_symplectic_euler"].max()
    for ax, name in zip(axes[:2, 0], strokes, strict=True):
        ax.plot(swing["t"], swing[f"q3_{name}"], color=strokes[name].color)
        ax.set(ylabel=r"height $q_3$  [$\ell$]", ylim=(low - 0.08, high + 0.08), title=NAMES[name])
    for name, stroke in strokes.items():
        axes[2, 0].plot(swing["t"], swing[f"energy_{name}"], label=NAMES[name], **stroke.line())
    axes[2, 0].set(ylabel=r"energy $H$  [$m\gamma\ell$]", xlabel=TIME, title="energy of both", ylim=(0, None))
    axes[2, 0].legend(loc="center right")
    axes[2, 0].margins(x=0.01)
    figure.align_ylabels()
    return save(figure, folder, "swing", swing)


def draw_defects(defects: pd.DataFrame, folder: Path) -> Path:
    """Draw the symplecticity defect against the number of steps."""
    figure, axes = grid_of_axes(1, 1, 3.7)
    ax = axes[0, 0]
    ax.axhspan(1e-17, 1e-14, color="#eeeeee", zorder=0)
    ax.text(31, 1.3e-14, "round-off", ha="right", va="bottom", color=QUIET, fontsize=8)
    for name in sorted(SCHEMES, key=lambda name: -defects[name].iloc[-1]):
        ax.plot(defects["n"], defects[name].clip(lower=2e-17), label=NAMES[name], markevery=(0, 2), **STROKE[name].points())
    ax.annotate(
        "the first step of se\nis symplectic",
        (1, defects["se"][0]),
        (2.6, 3e-12),
        arrowprops={"arrowstyle": "->", "color": STROKE["se"].color, "shrinkB": 5},
        color=STROKE["se"].color,
    )
    ax.set(yscale="log", ylim=(1e-17, 1), xlim=(0, 31.5), xlabel="number of steps $n$", ylabel="symplecticity defect")
    figure.legend(loc="outside lower center", ncols=2)
    return save(figure, folder, "symplecticity", defects)


def draw_ida(ida: pd.DataFrame, folder: Path) -> Path:
    """Draw the error that IDA reached against the tolerance that was asked for."""
    figure, axes = grid_of_axes(1, 2, 3.9, x="tolerance asked for", y=r"position error reached  [$\ell$]", sharex=True, sharey=True)
    styles = {formulation: stroke_of(f"ida:{formulation}") for formulation in FORMULATIONS}
    for ax, case, title in zip(axes[0], (SLOW, FAST), ("slow swing (fig1.1)", "fast swing (fig1.2)"), strict=True):
        ends = np.array([ida["tol"].min(), ida["tol"].max()])
        ax.plot(ends, ends, color=QUIET, linewidth=1.0)
        ax.text(3e-10, 1.5e-10, "error = tolerance", color=QUIET, fontsize=8, rotation=28, rotation_mode="anchor", va="top")
        for formulation, stroke in styles.items():
            rows = ida[(ida["case"] == case) & (ida["formulation"] == formulation)]
            ax.plot(rows["tol"], rows["error"], label=label(formulation), **stroke.points())
        ax.set(xscale="log", yscale="log", title=title)
        ax.minorticks_off()
    legend_below(figure, axes[0, 0], 4)
    return save(figure, folder, "ida", ida)


def label(formulation: str) -> str:
    """Return the display name of a formulation."""
    return "GGL" if formulation == "ggl" else f"index {formulation[-1]}"


def windows(run: pd.DataFrame, quantity: str) -> tuple[Any, Any]:
    """Return the middles of windows of time and the largest modulus in each."""
    index = (run["t"] / WINDOW).astype(int)
    groups = run[quantity].abs().groupby(index.where(index < round(run["t"].iloc[-1] / WINDOW), index.max() - 1))
    return (np.array(list(groups.groups)) + 0.5) * WINDOW, groups.max().to_numpy()


def long_table(numbers: Numbers) -> pd.DataFrame:
    """Return the four runs below one another."""
    return pd.concat([frame.assign(method=name, h=DRIFT_RUNS[name]) for name, frame in numbers.drift.items()], ignore_index=True)
