"""The picture of a work-precision study: error against time and against evaluations, every method a curve."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from daebench.figures import QUIET, STROKES, drawing, grid_of_axes, save

if TYPE_CHECKING:
    import pandas as pd

COSTS = {"seconds": "CPU time [s]", "evaluations": "evaluations of functions and derivatives"}
"""What errors are drawn against, and its label."""


def draw(out: Path, table: "pd.DataFrame", error: str, label: str) -> Path:
    """Write the figure of one error, ``work_precision_ERROR`` as SVG, PNG and CSV; return the path of the SVG.

    A curve ends where errors reach their bound: below it nothing is known. The part of the time that a solver spends in Python callbacks,
    which is not its own, is a tick that leads back from each of its points to what it would take without.
    """
    shown = table[table["failure"] == ""].dropna(subset=[error])
    bound = error.replace("error_", "bound_")
    floor = float(shown[bound].max()) if bound in shown and bound != error else 0.0
    costs = [cost for cost in COSTS if shown[cost].notna().any()]
    with drawing():
        figure, axes = grid_of_axes(1, len(costs), 4.2, sharey=True)
        for axis, cost in zip(axes[0], costs, strict=True):
            for k, (name, runs) in enumerate(shown.groupby("method", sort=False)):
                _curve(axis, k, str(name), runs[runs[error] > floor].sort_values(cost), error, cost)
            if floor > 0:
                axis.axhline(floor, color=QUIET, linestyle=":", linewidth=1.0)
            axis.set(xscale="log", yscale="log", xlabel=COSTS[cost])
        axes[0, 0].set_ylabel(label)
        handles, labels = axes[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4)
        return save(figure, out, f"work_precision_{error}", shown)


def _curve(axis: Any, k: int, name: str, runs: "pd.DataFrame", error: str, cost: str) -> None:
    stroke = STROKES[k % len(STROKES)]
    style = stroke.points() if k < len(STROKES) else stroke.points() | {"markerfacecolor": stroke.color, "linewidth": 0.8}
    axis.plot(runs[cost], runs[error], label=name, **style)
    if cost == "seconds" and np.isfinite(runs["callback_seconds"]).any():
        own = runs[cost] - runs["callback_seconds"].fillna(0.0)
        axis.hlines(runs[error], own, runs[cost], color=stroke.color, linewidth=0.7)
