"""The figures of the report on tolerances."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from daebench.draw.figures import QUIET, STROKES, drawing, grid_of_axes, legend_below, save
from daebench.reports.index_reduction.figures import label
from daebench.reports.tolerances.claims import CLOSE, SMALL, law_of
from daebench.reports.tolerances.drift import TOL, windows
from daebench.reports.tolerances.numbers import Numbers
from daebench.reports.tolerances.runs import FAST, FORMULATIONS, IVPS, REACHED, STOPPED

STROKE = dict(zip(FORMULATIONS, (STROKES[0], STROKES[3], STROKES[1], STROKES[5]), strict=True))
TREATMENT_STROKE = {"derivative": STROKES[3], "atol": STROKES[1], "none": STROKES[6]}
TREATMENT_NAMES = {"derivative": "derivative", "atol": "atol", "none": "plain"}
EDGE = (3e1, 1e4)
"""Where runs without a result are marked, above all errors."""

ERROR, ASKED = "largest position error  [m]", "tolerance asked for"
TIME = "time $t$  [s]"


def draw(numbers: Numbers, folder: Path) -> dict[str, Path]:
    """Draw all figures into a folder; return the paths of the SVG files by stem."""
    runs = numbers.runs.assign(scene=numbers.runs["problem"] + "-" + numbers.runs["case"])
    with drawing():
        paths = [
            draw_accuracy(runs, folder),
            draw_treatments(runs, folder),
            draw_drift(numbers, folder),
            draw_cost(runs, folder),
            draw_estimate(runs, folder),
        ]
    return {path.stem: path for path in paths}


def shown(rows: pd.DataFrame) -> "pd.Series[float]":
    """Return errors as they are drawn: none below what its reference can tell."""
    return rows["error"].clip(lower=rows["floor"])


def draw_accuracy(runs: pd.DataFrame, folder: Path) -> Path:
    """Draw the error reached against the tolerance asked for: a panel a problem, a curve a formulation with its default treatment."""
    default = runs[runs["default"]]
    figure, axes = grid_of_axes(2, 3, 5.4, x=ASKED, y=ERROR, sharex=True, sharey=True)
    for ax, (ivp, title) in zip(axes.flat, IVPS.items(), strict=False):
        diagonal(ax, default["tol"])
        for k, (formulation, stroke) in enumerate(STROKE.items()):
            rows = default[(default["scene"] == ivp) & (default["formulation"] == formulation)]
            ax.plot(rows["tol"], shown(rows), label=label(formulation), **stroke.points())
            mark_ends(ax, rows, stroke.color, k, len(STROKE))
        finish(ax, title)
    axes[0, 0].text(1e-9, 4e-10, "error = tolerance", color=QUIET, fontsize=7.5, rotation=34, rotation_mode="anchor", va="top")
    axes[0, 2].tick_params(labelbottom=True)
    axes[0, 2].set_xlabel(ASKED)
    explain(axes[1, 2], axes[0, 0])
    return save(figure, folder, "accuracy", default.drop(columns="scene"))


def diagonal(ax: Any, tolerances: "pd.Series[float]") -> None:
    """Draw where error and tolerance are the same."""
    ends = np.array([tolerances.min(), tolerances.max()])
    ax.plot(ends, ends, color=QUIET, linewidth=1.0)


def mark_ends(ax: Any, rows: pd.DataFrame, color: str, k: int, of: int) -> None:
    """Mark runs without a result at the upper edge: a cross where IDA stopped, a plus where it was given up."""
    y = EDGE[0] * (EDGE[1] / EDGE[0]) ** ((k + 0.5) / of)
    for chosen, marker in ((rows["end"].isin(STOPPED), "x"), (~rows["end"].isin((*STOPPED, REACHED)), "+")):
        tols = rows["tol"][chosen]
        ax.plot(tols, np.full(len(tols), y), linestyle="none", marker=marker, markersize=5, markeredgewidth=1.4, color=color)


def finish(ax: Any, title: str) -> None:
    """Set scales, limits and title of a panel of errors against tolerances."""
    ax.axhspan(*EDGE, color="#eeeeee", zorder=0, linewidth=0)
    ax.set(xscale="log", yscale="log", xlim=(4e-15, 2.5e-3), ylim=(3e-15, EDGE[1]), title=title)
    ax.set_xticks([1e-14, 1e-11, 1e-8, 1e-5])
    ax.set_yticks([1e-14, 1e-11, 1e-8, 1e-5, 1e-2])
    ax.minorticks_off()


def explain(ax: Any, source: Any) -> None:
    """Turn a panel into the legend of the others."""
    ax.axis("off")
    handles, labels = source.get_legend_handles_labels()
    stops = [ax.plot([], [], linestyle="none", marker=marker, color="black", markeredgewidth=1.4)[0] for marker in "x+"]
    line = ax.plot([], [], color=QUIET)[0]
    texts = [*labels, "error = tolerance", "no result: IDA stopped", "no result: given up"]
    ax.legend([*handles, line, *stops], texts, loc="center left", labelspacing=0.7)


def draw_treatments(runs: pd.DataFrame, folder: Path) -> Path:
    """Draw the same for all treatments on the fast pendulum: a panel a formulation."""
    fast = runs[runs["scene"] == FAST]
    figure, axes = grid_of_axes(2, 2, 5.2, x=ASKED, y=ERROR, sharex=True, sharey=True)
    for ax, formulation in zip(axes.flat, FORMULATIONS, strict=True):
        diagonal(ax, fast["tol"])
        for k, (treatment, stroke) in enumerate(TREATMENT_STROKE.items()):
            rows = fast[(fast["formulation"] == formulation) & (fast["cure"] == treatment)]
            ax.plot(rows["tol"], shown(rows), label=TREATMENT_NAMES[treatment], **stroke.points())
            mark_ends(ax, rows, stroke.color, k, len(TREATMENT_STROKE))
        finish(ax, label(formulation))
    handles, labels = axes[0, 0].get_legend_handles_labels()
    stops = [axes[0, 0].plot([], [], linestyle="none", marker=marker, color="black", markeredgewidth=1.4)[0] for marker in "x+"]
    figure.legend([*handles, *stops], [*labels, "IDA stopped", "given up"], loc="outside lower center", ncols=5, columnspacing=1.4)
    return save(figure, folder, "cures", fast.drop(columns="scene"))


def draw_drift(numbers: Numbers, folder: Path) -> Path:
    """Draw the windows' largest constraint residual, energy error and position error against time, with the fitted powers."""
    figure, axes = grid_of_axes(1, 3, 3.6, sharex=True)
    titles = {"g": "constraint $|g|$  [m²]", "energy": "energy error  [J]", "error": "position error  [m]"}
    frames = []
    for formulation, stroke in STROKE.items():
        run = numbers.drift[(numbers.drift["formulation"] == formulation) & (numbers.drift["tol"] == TOL)]
        for ax, quantity in zip(axes[0], titles, strict=True):
            t, value = windows(run["t"].to_numpy(), run[quantity].to_numpy())
            ax.plot(t, value, label=label(formulation), **stroke.points() | {"linestyle": "none"})
            law = law_of(numbers.laws[numbers.laws["tol"] == TOL], formulation, quantity)
            ax.plot(t, law["factor"] * t ** law["exponent"], **stroke.line() | {"linewidth": 1.0})
            ax.text(
                t[-1] * 1.15,
                law["factor"] * t[-1] ** law["exponent"],
                f"{law['exponent']:.1f}",
                color=stroke.color,
                fontsize=8,
                va="center",
            )
            frames.append(pd.DataFrame({"formulation": formulation, "tol": TOL, "quantity": quantity, "t": t, "largest": value}))
    for ax, title in zip(axes[0], titles.values(), strict=True):
        ax.set(xscale="log", yscale="log", title=title, xlabel=TIME, xlim=(2, 160))
        ax.set_xticks([3, 10, 30, 100], ["3", "10", "30", "100"])
        ax.minorticks_off()
    legend_below(figure, axes[0, 0], 4)
    return save(figure, folder, "drift", pd.concat(frames, ignore_index=True))


def draw_cost(runs: pd.DataFrame, folder: Path) -> Path:
    """Draw the residual calls that an error costs: one panel for each problem."""
    done = runs[runs["default"] & (runs["end"] == REACHED)]
    figure, axes = grid_of_axes(2, 3, 5.2, x=ERROR, y="calls of the residual", sharex=True, sharey=True)
    for ax, (ivp, title) in zip(axes.flat, IVPS.items(), strict=False):
        for formulation, stroke in STROKE.items():
            rows = done[(done["scene"] == ivp) & (done["formulation"] == formulation)]
            ax.plot(shown(rows), rows["residuals"], label=label(formulation), **stroke.points())
        ax.set(xscale="log", yscale="log", title=title, xlim=(2e1, 1e-13))
        ax.set_xticks([1e0, 1e-3, 1e-6, 1e-9, 1e-12])
        ax.minorticks_off()
    axes[0, 2].tick_params(labelbottom=True)
    axes[0, 2].set_xlabel(ERROR)
    axes[1, 2].axis("off")
    axes[1, 2].legend(*axes[0, 0].get_legend_handles_labels(), loc="center left", labelspacing=0.8)
    columns = ["problem", "case", "formulation", "cure", "tol", "error", "steps", "residuals", "jacobians"]
    return save(figure, folder, "cost", done[columns])


def draw_estimate(runs: pd.DataFrame, folder: Path) -> Path:
    """Draw how many times the true error the difference from the run at a tenth of the tolerance is."""
    rows = runs[runs["default"] & runs["estimate"].notna() & (runs["error"] < SMALL)]
    figure, axes = grid_of_axes(1, 1, 3.4)
    ax = axes[0, 0]
    ax.axhspan(1 / CLOSE, CLOSE, color="#eeeeee", zorder=0, linewidth=0)
    ax.axhline(1, color=QUIET, linewidth=1.0)
    for formulation, stroke in STROKE.items():
        formulation_runs = rows[rows["formulation"] == formulation]
        ax.plot(
            formulation_runs["error"],
            formulation_runs["estimate"] / formulation_runs["error"],
            label=label(formulation),
            **stroke.points() | {"linestyle": "none"},
        )
    ax.set(xscale="log", yscale="log", xlabel=f"true error: {ERROR}", ylabel="estimate / true error", xlim=(2e-1, 1e-12))
    ax.set_yticks([0.2, 0.5, 1, 2, 5], ["0.2", "0.5", "1", "2", "5"])
    ax.minorticks_off()
    figure.legend(loc="outside lower center", ncols=4)
    return save(figure, folder, "estimate", rows[["problem", "case", "formulation", "cure", "tol", "error", "estimate"]])
