"""The picture of a work-precision study: error against time and against evaluations, a column a family of methods."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from daebench.figures import BLACK, QUIET, STROKES, drawing, grid_of_axes, save
from daebench.studies.recommend import with_conserved
from daebench.studies.work_precision import front

if TYPE_CHECKING:
    import pandas as pd

COSTS = {"seconds": "CPU time [s]", "evaluations": "evaluations"}
"""What errors are drawn against, and its label."""

FAMILIES = ("fixed steps,\nenergy kept", "fixed steps,\nenergy drifts", "compositions,\nfixed steps", "by tolerance")
"""Columns of the picture."""

OTHERS = "#d4d4d4"
"""Grey of the curves of all other families."""

MARGIN = 3.0
"""Factor between what is drawn and the frame."""

HIGHEST = 10.0
"""Errors up to this are drawn: beyond it nothing is right."""


def families(table: "pd.DataFrame") -> Mapping[str, list[str]]:
    """Return the families that there are and their methods: by knob, by composition, and by whether the energy was measured to be kept."""
    keeps = with_conserved(table, {})
    found: dict[str, list[str]] = {name: [] for name in FAMILIES}
    for name, runs in keeps.groupby("method", sort=False):
        kept, drifts, composed, by_tolerance = FAMILIES
        fixed = composed if "/" in str(name) else kept if runs["keeps_energy"].any() else drifts
        found[fixed if (runs["knob"] == "h").all() else by_tolerance].append(str(name))
    return {family: names for family, names in found.items() if names}


def draw(out: Path, table: "pd.DataFrame", error: str, label: str, *, stem: str | None = None) -> Path:
    """Write the figure of one error, ``work_precision_ERROR`` as SVG, PNG and CSV; return the path of the SVG.

    Each family has a column, with the curves of the others in grey behind its own, and the Pareto front of all runs as a black line. A
    curve ends where errors reach their bound: below it nothing is known. The part of the time that a solver spends in Python callbacks,
    which is not its own, is a line that leads back from each of its points to what it would take without.

    Parameters
    ----------
    out : Path
        Folder.
    table : DataFrame
        As :func:`daebench.studies.work_precision.with_costs` gives it.
    error : str
        Column that is drawn.
    label : str
        What it is.
    stem : str, optional
        Name of the files.
    """
    shown = table[table["failure"] == ""].dropna(subset=[error])
    bound = error.replace("error_", "bound_")
    floor = float(shown[bound].max()) if bound in shown and bound != error else 0.0
    drawn = shown[shown[error] > floor]
    costs = [cost for cost in COSTS if drawn[cost].notna().any()]
    groups = families(table)
    with drawing():
        figure, axes = grid_of_axes(len(costs), len(groups), 0.9 + 2.35 * len(costs), sharey=True, sharex="row")
        for row, cost in zip(axes, costs, strict=True):
            for axis, (family, names) in zip(row, groups.items(), strict=True):
                _panel(axis, drawn, names, error, cost)
                if floor > 0:
                    axis.axhline(floor, color=QUIET, linestyle=":", linewidth=1.0)
                    axis.set_ylim(bottom=floor / MARGIN)
                axis.set(xscale="log", yscale="log", xlabel=COSTS[cost], title=family if cost == costs[0] else "")
                axis.set_ylim(top=min(HIGHEST, MARGIN * float(drawn[error].max())))
            row[0].set_ylabel(label)
        for axis in axes[-1]:
            axis.legend(loc="upper left", bbox_to_anchor=(-0.1, -0.28), handlelength=2.2, borderaxespad=0.0, fontsize=8)
        return save(figure, out, stem or f"work_precision_{error}", shown)


def _panel(axis: Any, table: "pd.DataFrame", names: list[str], error: str, cost: str) -> None:
    """Draw the methods of a family over those of all others, and the front of all."""
    curves = {str(name): runs.sort_values(cost) for name, runs in table.groupby("method", sort=False)}
    for name, runs in curves.items():
        if name not in names:
            axis.plot(runs[cost], runs[error], color=OTHERS, linewidth=0.7, zorder=1)
    best = front(table, error, cost)
    axis.plot(best[cost], best[error], color=BLACK, linewidth=0.8, zorder=2)
    for k, name in enumerate(name for name in names if name in curves):
        _curve(axis, k, name, curves[name], error, cost)


def _curve(axis: Any, k: int, name: str, runs: "pd.DataFrame", error: str, cost: str) -> None:
    stroke = STROKES[k % len(STROKES)]
    style = stroke.points() if k < len(STROKES) else stroke.points() | {"markerfacecolor": stroke.color}
    fixed = (runs["knob"] == "h").all()
    axis.plot(runs[cost], runs[error], label=name, zorder=3, **style | {"linestyle": "-" if fixed else (0, (4, 1.5)), "linewidth": 1.1})
    if cost == "seconds" and np.isfinite(runs["callback_seconds"]).any():
        axis.hlines(runs[error], runs["own_seconds"], runs[cost], color=stroke.color, linewidth=0.7)
