"""The picture of a comparison: energy error and distance from the constraints against time, a curve a method."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from daebench.diagnostics.integrals import energy_error
from daebench.figures import STROKES, drawing, grid_of_axes, save, save_table
from daebench.scene import Scene
from daebench.trajectory import Array, Trajectory

MOST_POINTS = 2000
"""Points of a curve, about; more cannot be seen."""


def write(out: Path, scene: Scene, runs: Sequence[Trajectory], table: pd.DataFrame) -> list[Path]:
    """Write comparison.csv and the figure with its data to a folder; return the paths of table and figure."""
    save_table(out / "comparison.csv", table)
    curves = pd.concat([_curves(scene, run) for run in runs], ignore_index=True)
    with drawing():
        figure, axes = grid_of_axes(3, 1, 7.0, sharex=True)
        panels = (("energy_error", "|energy error|"), ("g", "|g(q)|"), ("Gv", "|G H_p|"))
        for axis, (column, label) in zip(axes[:, 0], panels, strict=True):
            _panel(axis, curves, column, label)
        axes[0, 0].set_title(f"{scene.problem}, case {scene.case}")
        axes[-1, 0].set_xlabel("time t")
        handles, labels = axes[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=min(4, len(runs)))
        path = save(figure, out, "comparison_drift", curves)
    return [out / "comparison.csv", path]


def _curves(scene: Scene, run: Trajectory) -> pd.DataFrame:
    """Return what is drawn of one run, thinned by keeping the largest error of each group of neighbours."""

    def largest(rows: Array) -> Array:
        return np.abs(rows).max(axis=1) if rows.ndim == 2 else np.abs(rows)

    errors = {
        "energy_error": largest(energy_error(scene, run)),
        "g": largest(scene.along("g", run.q)),
        "Gv": largest(scene.along("Gv", run.p, run.q)),
    }
    starts = np.unique(np.linspace(0, len(run.t) - 1, MOST_POINTS).astype(int))
    thinned = {name: np.maximum.reduceat(values, starts) for name, values in errors.items()}
    return pd.DataFrame({"method": run.method, "t": run.t[starts], **thinned})


def _panel(axis: Any, curves: pd.DataFrame, column: str, label: str) -> None:
    names = list(dict.fromkeys(curves["method"]))
    for k, name in enumerate(names):
        curve = curves[(curves["method"] == name) & (curves[column] > 0)]
        stroke = STROKES[k % len(STROKES)]
        style = stroke.line() if k < len(STROKES) else stroke.points() | {"markevery": 0.08}
        axis.plot(curve["t"], curve[column], label=name, **style)
    axis.set_yscale("log")
    axis.set_ylabel(label)
