"""The figures of the report on tolerances."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from daebench.draw.figures import QUIET, STROKES, drawing, grid_of_axes, legend_below, save
from daebench.draw.methods import stroke_of
from daebench.pages.report.thumbnail import draw_thumbnail
from daebench.reports.index_reduction.figures import label
from daebench.reports.tolerances.bands import HIGH, LOW, typical
from daebench.reports.tolerances.claims import CLOSE, SMALL, law_of
from daebench.reports.tolerances.drift import TOL, windows
from daebench.reports.tolerances.numbers import Numbers
from daebench.reports.tolerances.projection import FIXED, PLAIN, PROJECTED
from daebench.reports.tolerances.runs import FAST, FORMULATIONS, IVPS, REACHED, STOPPED

STROKE = {formulation: stroke_of(f"ida:{formulation}") for formulation in FORMULATIONS}
TREATMENT_STROKE = {"derivative": STROKES[3], "atol": STROKES[1], "suppress": STROKES[2], "none": STROKES[6]}
TREATMENT_NAMES = {"derivative": "derivative", "atol": "atol", "suppress": "suppress", "none": "plain"}
METHOD_STROKE = {name: stroke_of(name) for name in (PLAIN, PROJECTED, *FIXED)}
METHOD_NAMES = {PLAIN: "CVODE, (1.18)", PROJECTED: "CVODE, projected", FIXED[0]: "RATTLE, as long", FIXED[1]: "RATTLE/Kahan-Li 8, as long"}
EDGE = (3e1, 1e4)
"""Where runs without a result are marked, above all errors."""

FEWEST = 20
"""Smallest number of runs in a decade of errors for which percentiles are drawn."""

ERROR, ASKED = "largest position error  [m]", "tolerance asked for"
TIME = "time $t$  [s]"


def draw(numbers: Numbers, folder: Path) -> dict[str, Path]:
    """Draw all figures into a folder; return the paths of the SVG files by stem."""
    runs, bands = numbers.runs, typical(numbers.runs[numbers.runs["default"]])
    with drawing():
        paths = [
            draw_accuracy(bands, folder),
            draw_treatments(runs[runs["start"] == 0], folder),
            draw_drift(numbers, folder),
            draw_cost(bands, folder),
            draw_estimate(runs, folder),
            draw_projected(numbers.projected, folder),
        ]
    draw_thumbnail(folder, lambda axis: _thumbnail(axis, bands))
    return {path.stem: path for path in paths}


def _thumbnail(axis: Any, bands: pd.DataFrame) -> None:
    """Draw the error reached against the tolerance, on the first problem."""
    ivp = next(iter(IVPS))
    for formulation, stroke in STROKE.items():
        rows = bands[(bands["scene"] == ivp) & (bands["formulation"] == formulation)]
        axis.plot(rows["tol"], rows["error"], label=label(formulation).split(",")[0], color=stroke.color, linewidth=1.6)
    ends = [bands["tol"].min(), bands["tol"].max()]
    axis.plot(ends, ends, color=QUIET, linewidth=0.8, linestyle=(0, (4, 3)))
    axis.set(xscale="log", yscale="log")
    axis.minorticks_off()
    axis.set_title(f"error of IDA, {IVPS[ivp]}  [m]", loc="left")
    axis.set_xlabel("tolerance asked for", loc="right")
    axis.legend(fontsize=6.5, loc="upper left", handlelength=1.2, ncols=2, columnspacing=0.8)


def shown(rows: pd.DataFrame) -> "pd.Series[float]":
    """Return errors as they are drawn: at least the error bound of the reference."""
    return rows["error"].clip(lower=rows["floor"])


def draw_accuracy(bands: pd.DataFrame, folder: Path) -> Path:
    """Draw the error reached against the tolerance asked for: a panel a problem, a band over the starts for each formulation."""
    figure, axes = grid_of_axes(2, 3, 5.4, x=ASKED, y=ERROR, sharex=True, sharey=True)
    for ax, (ivp, title) in zip(axes.flat, IVPS.items(), strict=False):
        diagonal(ax, bands["tol"])
        for k, (formulation, stroke) in enumerate(STROKE.items()):
            rows = bands[(bands["scene"] == ivp) & (bands["formulation"] == formulation)]
            ax.fill_between(rows["tol"], rows["low"], rows["high"], color=stroke.color, alpha=0.22, linewidth=0)
            ax.plot(rows["tol"], rows["error"], label=label(formulation), **stroke.points())
            mark_losses(ax, rows, stroke.color, k, len(STROKE))
        finish(ax, title)
    axes[0, 0].text(1e-9, 4e-10, "error = tolerance", color=QUIET, fontsize=7.5, rotation=34, rotation_mode="anchor", va="top")
    axes[0, 2].tick_params(labelbottom=True)
    axes[0, 2].set_xlabel(ASKED)
    explain(axes[1, 2], axes[0, 0])
    return save(figure, folder, "accuracy", bands)


def mark_losses(ax: Any, rows: pd.DataFrame, color: str, k: int, of: int) -> None:
    """Mark, at the upper edge, tolerances at which some starts have no result, with their fraction."""
    y = EDGE[0] * (EDGE[1] / EDGE[0]) ** ((k + 0.5) / of)
    for tol, done in rows.loc[rows["done"] < 1, ["tol", "done"]].to_numpy():
        ax.plot(tol, y, linestyle="none", marker="x", markersize=4, markeredgewidth=1.2, color=color)
        ax.text(
            tol * (0.5 if tol > 1e-8 else 2),
            y,
            f"{100 * (1 - done):.0f} %",
            color=color,
            fontsize=6.5,
            va="center",
            ha="right" if tol > 1e-8 else "left",
        )


def diagonal(ax: Any, tolerances: "pd.Series[float]") -> None:
    """Draw the diagonal, where error and tolerance are equal."""
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
    lost = ax.plot([], [], linestyle="none", marker="x", color="black", markeredgewidth=1.2)[0]
    line, band = ax.plot([], [], color=QUIET)[0], ax.fill_between([], [], color="black", alpha=0.22, linewidth=0)
    texts = [*labels, "error = tolerance", f"{100 * LOW:.0f} to {100 * HIGH:.0f} % of the starts", "no result, part of the starts"]
    ax.legend([*handles, line, band, lost], texts, loc="center left", labelspacing=0.7)


def draw_treatments(runs: pd.DataFrame, folder: Path) -> Path:
    """Draw the same for all treatments on the fast pendulum: one panel per formulation."""
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
    figure.legend([*handles, *stops], [*labels, "IDA stopped", "given up"], loc="outside lower center", ncols=6, columnspacing=1.2)
    return save(figure, folder, "cures", fast)


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


def draw_cost(bands: pd.DataFrame, folder: Path) -> Path:
    """Draw residual calls against the error reached, medians over the starts: one panel per problem."""
    done = bands[bands["error"].notna()]
    figure, axes = grid_of_axes(2, 3, 5.2, x=ERROR, y="calls of the residual", sharex=True, sharey=True)
    for ax, (ivp, title) in zip(axes.flat, IVPS.items(), strict=False):
        for formulation, stroke in STROKE.items():
            rows = done[(done["scene"] == ivp) & (done["formulation"] == formulation)]
            ax.plot(rows["error"], rows["residuals"], label=label(formulation), **stroke.points())
        ax.set(xscale="log", yscale="log", title=title, xlim=(2e1, 1e-13))
        ax.set_xticks([1e0, 1e-3, 1e-6, 1e-9, 1e-12])
        ax.minorticks_off()
    legend_panel(axes, ERROR)
    return save(figure, folder, "cost", done)


def legend_panel(axes: Any, x: str) -> None:
    """Turn the last of six panels into the legend of the others, and label the axis above it."""
    axes[0, 2].tick_params(labelbottom=True)
    axes[0, 2].set_xlabel(x)
    axes[1, 2].axis("off")
    axes[1, 2].legend(*axes[0, 0].get_legend_handles_labels(), loc="center left", labelspacing=0.8)


def draw_projected(rows: pd.DataFrame, folder: Path) -> Path:
    """Draw the error against CPU time: CVODE with and without projected steps, and RATTLE for the time of the former."""
    figure, axes = grid_of_axes(2, 3, 5.4, x="time of the run  [ms]", y=ERROR, sharex=True, sharey=True)
    frames = []
    for ax, (ivp, title) in zip(axes.flat, IVPS.items(), strict=False):
        for method, stroke in METHOD_STROKE.items():
            groups = rows[(rows["scene"] == ivp) & (rows["method"] == method)].groupby("tol")
            errors = groups["error"].quantile(np.array([LOW, 0.5, HIGH])).unstack().set_axis(["low", "error", "high"], axis=1)
            frame = errors.assign(seconds=groups["seconds"].median(), scene=ivp, method=method).reset_index()
            ax.fill_between(1e3 * frame["seconds"], frame["low"], frame["high"], color=stroke.color, alpha=0.22, linewidth=0)
            ax.plot(1e3 * frame["seconds"], frame["error"], label=METHOD_NAMES[method], **stroke.points())
            frames.append(frame)
        ax.set(xscale="log", yscale="log", title=title)
        ax.set_yticks([1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 1e0])
        ax.minorticks_off()
    legend_panel(axes, "time of the run  [ms]")
    return save(figure, folder, "projected", pd.concat(frames, ignore_index=True))


def draw_estimate(runs: pd.DataFrame, folder: Path) -> Path:
    """Draw the ratio of the estimate at a tenth of the tolerance to the true error: medians and percentiles by decade."""
    rows = runs[runs["default"] & runs["estimate"].notna() & (runs["error"] < SMALL)]
    figure, axes = grid_of_axes(1, 1, 3.4)
    ax = axes[0, 0]
    ax.axhspan(1 / CLOSE, CLOSE, color="#eeeeee", zorder=0, linewidth=0)
    ax.axhline(1, color=QUIET, linewidth=1.0)
    for formulation, stroke in STROKE.items():
        chosen = rows[rows["formulation"] == formulation]
        decades = (chosen["estimate"] / chosen["error"]).groupby(np.floor(np.log10(chosen["error"])))
        parts = decades.quantile(np.array([0.01, 0.5, 0.99])).unstack()[decades.size() >= FEWEST]
        middle = 10 ** (parts.index.to_numpy() + 0.5)
        ax.fill_between(middle, parts[0.01], parts[0.99], color=stroke.color, alpha=0.22, linewidth=0)
        ax.plot(middle, parts[0.5], label=label(formulation), **stroke.points())
    ax.set(xscale="log", yscale="log", xlabel=f"true error: {ERROR}", ylabel="estimate / true error", xlim=(2e-1, 1e-12))
    ax.set_yticks([0.1, 0.5, 1, 2, 10], ["0.1", "0.5", "1", "2", "10"])
    ax.minorticks_off()
    figure.legend(loc="outside lower center", ncols=4)
    return save(figure, folder, "estimate", rows[["scene", "start", "formulation", "tol", "error", "estimate"]])
