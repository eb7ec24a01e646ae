"""The pictures of an archive: for each problem and case, how accurate each method is over its step size or tolerance."""

import re
from pathlib import Path
from typing import TYPE_CHECKING

from daebench.draw.figures import drawing, grid_of_axes, legend_below, save
from daebench.draw.methods import curve_of
from daebench.studies.grid.rows import by_method

if TYPE_CHECKING:
    import pandas as pd

SMALLEST, LARGEST = 1e-150, 1e150
"""Numbers between which scales of powers do not overflow; others are not drawn."""

COLUMNS = ("error_q", "error_y", "energy_error")
"""What is drawn: the first of these that is a number anywhere."""


def draw(out: Path, table: "pd.DataFrame") -> list[Path]:
    """Write the pictures, each as SVG and PNG, and return their paths; there is none where nothing can be drawn on scales of powers."""
    paths: list[Path] = []
    for (problem, case), rows in table.groupby(["problem", "case"], sort=False):
        rows = rows[rows["value"].between(SMALLEST, LARGEST)]
        column = next((name for name in COLUMNS if name in rows and rows[name].between(SMALLEST, LARGEST).any()), None)
        if column is None:
            continue
        stem = re.sub(r"[^A-Za-z0-9._+-]", "_", f"{Path(str(problem)).stem}-{case}")
        _draw(out, stem, rows[rows[column].between(SMALLEST, LARGEST)], column)
        paths += [out / f"{stem}.svg", out / f"{stem}.png"]
    return paths


def _draw(out: Path, stem: str, rows: "pd.DataFrame", column: str) -> None:
    with drawing():
        figure, axes = grid_of_axes(1, 1, 3.4)
        axis = axes[0, 0]
        for method, runs in by_method(rows):
            ordered = runs.sort_values("value")
            axis.plot(ordered["value"], ordered[column], **curve_of(method))
        axis.set(xscale="log", yscale="log", title=stem, xlabel="step size h [s], or tolerance", ylabel=column.replace("_", " "))
        legend_below(figure, axis, 4)
        save(figure, out, stem, rows)
