"""The figures of the report on molecules."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd

from daebench.draw.figures import GREEN, QUIET, STROKES, drawing, grid_of_axes, save
from daebench.draw.methods import name_of, stroke_of
from daebench.pages.report.thumbnail import draw_thumbnail
from daebench.reports.molecules.claims import MOST
from daebench.reports.molecules.hess import single
from daebench.reports.molecules.motions import (
    BUTANE,
    DIFFERENCES,
    DOUBLE,
    GAUSS_SEIDEL,
    ILVES,
    LINCS,
    MIDDLE,
    MULTIPLIERS,
    SETTLE,
    SINGLE,
    TITLES,
    WATER,
    double,
)
from daebench.reports.molecules.numbers import Numbers

CHANGE = "change of the energy in 10 ps\nover fluctuation of the kinetic energy"
LEAST = 1e-16
"""Changes below are drawn here."""

BESIDE = 1e-15, 1e-14
"""Where on the axis of tolerances the two solvers without one are drawn."""

GROWTH = (
    (WATER, SETTLE, MULTIPLIERS, "water, SETTLE,\nvelocities from multipliers"),
    (WATER, SETTLE, DIFFERENCES, "water, SETTLE,\nvelocities from differences"),
    (WATER, GAUSS_SEIDEL, MULTIPLIERS, "water, Gauss-Seidel $10^{-5}$,\nvelocities from multipliers"),
    (BUTANE, GAUSS_SEIDEL, MULTIPLIERS, "butane, Gauss-Seidel $10^{-5}$,\nvelocities from multipliers"),
)
"""Settings in single precision whose growth is drawn."""

ORDER, ITERATIONS = 8, 4
"""The expansion of LINCS that is drawn."""

SINGLE_SCHEMES = (SETTLE, LINCS)
"""Solvers without a tolerance, whose change in single precision is drawn against the step."""

FINEST = 1e-8
"""The tightest tolerance in the picture of the answer."""

ENOUGH = GREEN


def draw(numbers: Numbers, conclusions: SimpleNamespace, folder: Path) -> dict[str, Path]:
    """Draw all figures into a folder; return the paths of the SVG files by stem."""
    with drawing():
        paths = [
            draw_answer(conclusions.runs, conclusions.answer.usual, folder),
            draw_tolerances(numbers.runs, folder),
            draw_growth(numbers.growth, folder),
            draw_steps(numbers.runs, folder),
        ]
    draw_thumbnail(folder, lambda axis: _thumbnail(axis, conclusions.runs))
    return {path.stem: path for path in paths}


def draw_answer(runs: pd.DataFrame, answer: float, folder: Path) -> Path:
    """Draw the change against the tolerance of the Gauss-Seidel iteration, a curve a molecule; mark the tolerances that suffice."""
    rows = iteration(runs)
    figure, axes = grid_of_axes(1, 1, 4.0, x="constraint tolerance", y=CHANGE)
    ax = axes[0, 0]
    ax.set(xscale="log", yscale="log", xlim=(FINEST / 3, 3e-3))
    curves_by_molecule(ax, rows)
    ax.axhline(MOST, color=QUIET, linewidth=1.0)
    ax.axvspan(FINEST / 3, answer * 1.25, color=ENOUGH, alpha=0.13, linewidth=0, zorder=0)
    ax.annotate(f"wanted: at most one part in {1 / MOST:.0f}", (2.8e-3, MOST), (0, -3), textcoords="offset points", ha="right", va="top")
    ax.annotate("enough on all three", (FINEST / 2.6, 1), (0, -4), xycoords=("data", "axes fraction"), textcoords="offset points", va="top")
    ax.minorticks_off()
    ax.legend(loc="lower right")
    return save(figure, folder, "answer", rows)


def iteration(runs: pd.DataFrame) -> pd.DataFrame:
    """Return the runs of the Gauss-Seidel iteration with the middle step, in double precision."""
    rows = double(runs, GAUSS_SEIDEL)
    return rows[(rows["h"] == MIDDLE) & (rows["tolerance"] >= FINEST)]


def curves_by_molecule(ax: Any, rows: pd.DataFrame) -> None:
    """Draw the upper limits of the mean changes against the tolerance, a curve a molecule."""
    for k, (molecule, title) in enumerate(TITLES.items()):
        some = rows[rows["molecule"] == molecule].sort_values("tolerance")
        ax.plot(some["tolerance"], some["limit"].clip(lower=LEAST), **STROKES[k].points(), label=title)


def draw_tolerances(runs: pd.DataFrame, folder: Path) -> Path:
    """Draw the change against the tolerance: a panel a molecule, with the middle step; solvers without a tolerance at the left."""
    rows = runs[(runs["h"] == MIDDLE) & (runs["velocities"] == MULTIPLIERS) & runs["precision"].isin((DOUBLE, SINGLE))]
    figure, axes = grid_of_axes(1, 3, 3.9, x="tolerance", sharey=True)
    axes[0, 0].set_ylabel(CHANGE)
    for ax, (molecule, title) in zip(axes[0], TITLES.items(), strict=True):
        _panel(ax, rows[rows["molecule"] == molecule])
        ax.set_title(title)
    axes[0, 0].text(3e-14, 1.5 * MOST, f"one part in {1 / MOST:.0f}", color=QUIET, fontsize=7.5, va="bottom")
    _legend(figure, (GAUSS_SEIDEL, ILVES, LINCS, SETTLE))
    return save(figure, folder, "tolerances", rows)


def _panel(ax: Any, rows: pd.DataFrame) -> None:
    """Draw the solvers on one molecule."""
    ax.axhline(MOST, color=QUIET, linewidth=1.0)
    ax.axvspan(BESIDE[0] / 4, BESIDE[1] * 2, color="#eeeeee", zorder=0, linewidth=0)
    beside = dict(zip((SETTLE, LINCS), BESIDE, strict=True))
    for scheme in (GAUSS_SEIDEL, ILVES, *beside):
        for precision in (DOUBLE, SINGLE):
            chosen = rows[(rows["scheme"] == scheme) & (rows["precision"] == precision)].sort_values("tolerance")
            if scheme in beside:
                chosen = chosen[chosen["order"].isin((0, ORDER)) & chosen["iterations"].isin((0, ITERATIONS))]
                chosen = chosen.assign(tolerance=beside[scheme])
            _curve(ax, chosen, scheme, precision)
    ax.set(xscale="log", yscale="log", xlim=(BESIDE[0] / 4, 4e-3), ylim=(LEAST / 3, 20))
    ax.set_xticks([1e-12, 1e-9, 1e-6, 1e-3])
    ax.minorticks_off()


def _curve(ax: Any, rows: pd.DataFrame, scheme: str, precision: str) -> None:
    """Draw medians and bands over the starts; filled markers are single precision."""
    if rows.empty:
        return
    stroke = stroke_of(scheme)
    median, low, high = (rows[name].clip(lower=LEAST) for name in ("median", "low", "high"))
    look = stroke.points() | ({"markerfacecolor": stroke.color, "linewidth": 0.8} if precision == SINGLE else {})
    if len(rows) > 1:
        ax.fill_between(rows["tolerance"], low, high, color=stroke.color, alpha=0.18, linewidth=0)
        ax.plot(rows["tolerance"], median, **look | {"marker": MARKERS[scheme], "markersize": 4.0})
        return
    ax.plot([rows["tolerance"].iloc[0]] * 2, [low.iloc[0], high.iloc[0]], color=stroke.color, linewidth=3, alpha=0.35)
    ax.plot(rows["tolerance"], median, **look | {"marker": MARKERS[scheme], "linestyle": "none", "markersize": 5.5})


MARKERS = {GAUSS_SEIDEL: "o", ILVES: "^", LINCS: "D", SETTLE: "s"}
"""Markers with an inside: open in double precision, filled in single."""


def _legend(figure: Any, schemes: tuple[str, ...]) -> None:
    from matplotlib.lines import Line2D

    handles = []
    for scheme in schemes:
        look = stroke_of(scheme).points() | {"marker": MARKERS[scheme]}
        name = f"{name_of(scheme)} ({ORDER}, {ITERATIONS})" if scheme == LINCS else name_of(scheme)
        handles.append(Line2D([], [], label=name, **look))
    handles.append(Line2D([], [], label="double precision", color="black", linestyle="none", marker="o", markerfacecolor="white"))
    handles.append(Line2D([], [], label="single precision", color="black", linestyle="none", marker="o"))
    figure.legend(handles=handles, loc="outside lower center", ncols=3)


def draw_growth(growth: pd.DataFrame, folder: Path) -> Path:
    """Draw how the mean change and its spread over the starts grow with time, in single precision with the middle step."""
    figure, axes = grid_of_axes(1, 4, 3.4, x="time [ps]", sharex=True, sharey=True)
    axes[0, 0].set_ylabel("change over fluctuation")
    frames = []
    for ax, (molecule, scheme, velocities, title) in zip(axes[0], GROWTH, strict=True):
        rows = single(growth, molecule, scheme, velocities).sort_values("t")
        stroke, t = stroke_of(scheme), rows["t"] / 10
        ax.plot(t, rows["mean"].abs(), color=stroke.color, marker="o", markersize=4, label="mean, modulus")
        ax.plot(
            t, rows["spread"], color=stroke.color, linestyle=(0, (4, 2)), marker="s", markerfacecolor="white", markersize=4, label="spread"
        )
        for power, at in ((1.0, 1e-4), (0.5, 1.5e-6)):
            ax.plot(t, at * (t / t.iloc[-1]) ** power, color=QUIET, linewidth=0.8)
        ax.set(xscale="log", yscale="log")
        ax.set_title(title, fontsize=8)
        frames.append(rows)
    axes[0, 0].text(0.9, 1.6e-5, "$t$", color=QUIET, fontsize=8)
    axes[0, 0].text(0.9, 2.2e-7, r"$\sqrt{t}$", color=QUIET, fontsize=8)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return save(figure, folder, "growth", pd.concat(frames, ignore_index=True))


def draw_steps(runs: pd.DataFrame, folder: Path) -> Path:
    """Draw the change in single precision against the step, with both velocities: a panel a molecule."""
    rows = runs[(runs["precision"] == SINGLE) & runs["scheme"].isin(SINGLE_SCHEMES)]
    molecules = [molecule for molecule in TITLES if molecule in set(rows["molecule"])]
    figure, axes = grid_of_axes(1, len(molecules), 3.4, x="step [fs]", sharey=True)
    axes[0, 0].set_ylabel(CHANGE)
    for ax, molecule in zip(axes[0], molecules, strict=True):
        for (scheme, velocities), some in rows[rows["molecule"] == molecule].groupby(["scheme", "velocities"]):
            _steps_curve(ax, some.sort_values("h"), str(scheme), velocities == DIFFERENCES)
        ax.set(xscale="log", yscale="log", title=TITLES[molecule])
        ax.set_xticks([0.5, 1, 2, 4], ["0.5", "1", "2", "4"])
        ax.minorticks_off()
    _steps_legend(figure)
    return save(figure, folder, "steps", rows)


def _steps_curve(ax: Any, rows: pd.DataFrame, scheme: str, filled: bool) -> None:
    """Draw medians and bands over the starts against the step; filled markers and whole lines are differences."""
    color = stroke_of(scheme).color
    look = {"color": color, "marker": MARKERS[scheme], "markerfacecolor": color if filled else "white"}
    ax.fill_between(100 * rows["h"], rows["low"], rows["high"], color=color, alpha=0.15, linewidth=0)
    ax.plot(100 * rows["h"], rows["median"], **look, linestyle="-" if filled else (0, (4, 2)))


def _steps_legend(figure: Any) -> None:
    from matplotlib.lines import Line2D

    schemes = [
        Line2D([], [], color=stroke_of(s).color, marker=MARKERS[s], markerfacecolor="white", label=name_of(s)) for s in SINGLE_SCHEMES
    ]
    black: dict[str, Any] = {"color": "black", "marker": "o"}
    looks = [
        Line2D([], [], label="velocities from differences", **black),
        Line2D([], [], label="velocities from multipliers", linestyle=(0, (4, 2)), markerfacecolor="white", **black),
    ]
    figure.legend(handles=[*schemes, *looks], loc="outside lower center", ncols=3)


def _thumbnail(axis: Any, runs: pd.DataFrame) -> None:
    """Draw the picture of the answer in small."""
    axis.axhline(MOST, color=QUIET, linewidth=1.0)
    rows = iteration(runs)
    curves_by_molecule(axis, rows)
    axis.set(xscale="log", yscale="log")
    axis.set_xticks([1e-8, 1e-6, 1e-4])
    axis.minorticks_off()
    axis.set_title("energy change by the solver", loc="right")
    axis.set_xlabel("tolerance", loc="right")
    axis.legend(fontsize=6.5, loc="upper left", handlelength=1.5)
