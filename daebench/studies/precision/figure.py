"""The picture of a precision study: error, energy error and two-form against time, every way to compute a curve."""

from pathlib import Path
from typing import TYPE_CHECKING

from daebench.draw.figures import curve, drawing, grid_of_axes, legend_below, save
from daebench.errors import DaebenchError
from daebench.studies.grid.rows import by_method, endless, error_of

if TYPE_CHECKING:
    import pandas as pd

LABELS = {
    "error_q": "largest error of q",
    "error_y": "largest error of y",
    "energy_error": "largest energy error",
    "defect": "defect of the two-form",
}
"""Columns that are drawn, and their labels."""

SMALLEST = 1e-18
"""Where what is zero is drawn."""


def draw(out: Path, stem: str, table: "pd.DataFrame") -> Path:
    """Write the figure, a row of panels for each method, as SVG, PNG and CSV; return the path of the SVG."""
    if why := endless(table):
        raise DaebenchError(f"there is nothing to draw: {why}.")
    cost, unit = ("seconds", "CPU time [s]") if table["seconds"].notna().any() else ("value", "step size h [s]")
    columns = [name for name in dict.fromkeys((error_of(table), "energy_error", "defect")) if table[name].notna().any()]
    methods = by_method(table[table["failure"] == ""])
    ways = list(dict.fromkeys(table["way"]))
    with drawing():
        figure, axes = grid_of_axes(len(methods), len(columns), 0.8 + 2.3 * len(methods), sharex="row")
        for line, (method, rows) in zip(axes, methods, strict=True):
            for axis, column in zip(line, columns, strict=True):
                for k, way in enumerate(ways):
                    runs = rows[rows["way"] == way].dropna(subset=[column]).sort_values("value")
                    axis.plot(runs[cost], runs[column].clip(lower=SMALLEST), label=way, **curve(k))
                axis.set(xscale="log", yscale="log", title=method, ylabel=LABELS[column])
        for axis in axes[-1]:
            axis.set_xlabel(unit)
        legend_below(figure, axes[0, 0], 5)
        return save(figure, out, stem, table)
