"""Curves of methods against their control parameters: a panel for step sizes, and one for tolerances."""

from typing import TYPE_CHECKING, Any

from daebench.draw.figures import grid_of_axes
from daebench.draw.methods import curve_of
from daebench.studies.grid.rows import by_method

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

LABELS = {"h": "step size h [s]", "tol": "tolerance"}
"""Control parameters of methods."""


def resolution_panels(table: "pd.DataFrame", column: str, height: float) -> tuple["Figure", dict[str, Any]]:
    """Return a figure with a curve of a column for each method, and its axes by resolution; the caller adds the rest."""
    resolutions = [resolution for resolution in LABELS if (table["knob"] == resolution).any()]
    figure, axes = grid_of_axes(1, len(resolutions), height, sharey=True)
    for axis, resolution in zip(axes[0], resolutions, strict=True):
        for method, rows in by_method(table[table["knob"] == resolution]):
            good = rows.dropna(subset=[column]).sort_values("value")
            axis.plot(good["value"], good[column], **curve_of(method))
        axis.set(xscale="log", xlabel=LABELS[resolution])
    return figure, dict(zip(resolutions, axes[0], strict=True))


def legends_below(panels: dict[str, Any]) -> None:
    """Put a legend below each panel."""
    for axis in panels.values():
        axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2)
