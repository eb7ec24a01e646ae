"""The picture of a comparison: energy error and what the structure keeps, constraints or Casimir functions, against time."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from daebench.diagnostics.along import LABELS, errors_along
from daebench.draw.figures import drawing, grid_of_axes, save, save_table
from daebench.draw.methods import name_of, stroke_of
from daebench.runs.ivp import Ivp
from daebench.runs.trajectory import PoissonTrajectory, Trajectory

MOST_POINTS = 2000
"""Points of a curve, about; more cannot be seen."""

FEW = 7
"""Curves that are told apart by colours and dashes; more have markers too."""


def write(out: Path, ivp: Ivp, runs: Sequence[Trajectory | PoissonTrajectory], table: pd.DataFrame) -> list[Path]:
    """Write comparison.csv and the figure with its data to a folder; return the paths of table and figure."""
    save_table(out / "comparison.csv", table)
    curves = pd.concat([_curves(ivp, run) for run in runs], ignore_index=True)
    with drawing():
        panels = [column for column in LABELS if column in curves.columns]
        figure, axes = grid_of_axes(len(panels), 1, 1.0 + 2.0 * len(panels), sharex=True)
        for axis, column in zip(axes[:, 0], panels, strict=True):
            _panel(axis, curves, column, LABELS[column])
        axes[0, 0].set_title(f"{ivp.problem}, case {ivp.case}")
        axes[-1, 0].set_xlabel("time t")
        handles, labels = axes[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=min(4, len(runs)))
        path = save(figure, out, "comparison_drift", curves)
    return [out / "comparison.csv", path]


def _curves(ivp: Ivp, run: Trajectory | PoissonTrajectory) -> pd.DataFrame:
    """Return what is drawn of one run, thinned by keeping the largest error of each group of neighbours."""
    errors = errors_along(ivp, run)
    starts = np.unique(np.linspace(0, len(run.t) - 1, MOST_POINTS).astype(int))
    thinned = {name: np.maximum.reduceat(values, starts) for name, values in errors.items()}
    return pd.DataFrame({"method": run.method, "t": run.t[starts], **thinned})


def _panel(axis: Any, curves: pd.DataFrame, column: str, label: str) -> None:
    names = list(dict.fromkeys(curves["method"]))
    for name in names:
        curve = curves[(curves["method"] == name) & (curves[column] > 0)]
        style = stroke_of(name).line() if len(names) <= FEW else stroke_of(name).points() | {"markevery": 0.08}
        axis.plot(curve["t"], curve[column], label=name_of(name), **style)
    axis.set_yscale("log")
    axis.set_ylabel(label)
