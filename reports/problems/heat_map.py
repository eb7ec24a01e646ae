"""The energy error of each method on each problem in one picture: colour by size, a sign for its trend."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from daebench.diagnostics.drift import LAWS
from daebench.draw.figures import BLACK, QUIET, grid_of_axes, save
from daebench.draw.methods import name_of
from daebench.pages.report import NONE, TIMES
from daebench.reports.problems.claims import NO_DRIFT

SIZES = (1e-12, 1e-10, 1e-8, 1e-6, 1e-4, 1e-2, 1.0)
"""Energy errors at which colours change, relative to the largest kinetic energy."""

COLORS = ("#fffdf0", "#fff1b3", "#fed976", "#feb24c", "#fd8d3c", "#e8601c", "#a63603", "#5c1d00")
"""Colours from small errors to large ones."""

DARK = 1e-4
"""Error from which on signs are white."""


def draw_heat_map(runs: pd.DataFrame, folder: Path) -> Path:
    """Draw a square for each pair of problem and method; return the path of the SVG.

    Parameters
    ----------
    runs : DataFrame
        One row per pair: problem, method, end, energy, kind.
    folder : Path
        Folder of the figures.
    """
    from matplotlib.colors import BoundaryNorm, ListedColormap

    problems, methods = (list(dict.fromkeys(runs[name])) for name in ("problem", "method"))
    table = runs.set_index(["method", "problem"])["energy"].unstack().reindex(index=methods, columns=problems)
    figure, axes = grid_of_axes(1, 1, 1.6 + 0.2 * len(methods))
    axis = axes[0, 0]
    norm = BoundaryNorm(SIZES, len(COLORS), extend="both")
    mesh = axis.pcolormesh(table.to_numpy(dtype=float), cmap=ListedColormap(COLORS), norm=norm, edgecolors="white", linewidth=0.8)
    for row in runs.to_dict("records"):
        _sign(axis, problems.index(row["problem"]) + 0.5, methods.index(row["method"]) + 0.5, row)
    axis.set_xticks(np.arange(len(problems)) + 0.5, [name.replace("_", " ") for name in problems], rotation=40, ha="left")
    axis.set_yticks(np.arange(len(methods)) + 0.5, [name_of(name) for name in methods])
    axis.xaxis.tick_top()
    axis.tick_params(length=0)
    axis.grid(visible=False)
    axis.spines[:].set_visible(False)
    axis.invert_yaxis()
    bar = figure.colorbar(mesh, ax=axis, orientation="horizontal", shrink=0.6, aspect=40, pad=0.02, ticks=SIZES)
    bar.ax.set_xticks(SIZES, [f"$10^{{{round(np.log10(size))}}}$" for size in SIZES])
    bar.set_label("largest energy error / largest kinetic energy")
    return save(figure, folder, "heat_map", runs[[name for name in SHOWN if name in runs]])


SHOWN = ("problem", "method", "end", "energy", "kind")
"""Columns of the data beside the picture."""


def _sign(axis: Any, x: float, y: float, row: dict[Any, Any]) -> None:
    """Draw the sign of a square: a drift, a run that stopped, a refusal."""
    if row["end"] == "reached":
        sign = "/" if row["kind"] in LAWS else "" if row["kind"] in NO_DRIFT else "?"
    else:
        sign = {"refused": NONE, "not run": ""}.get(row["end"], TIMES)
    energy = row["energy"]
    color = QUIET if not np.isfinite(energy) else "white" if energy >= DARK else BLACK
    axis.text(x, y, sign, ha="center", va="center", color=color, fontsize=9)
