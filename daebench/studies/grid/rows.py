"""A table of a study read row by row, and drawn over step sizes and tolerances."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from daebench.diagnostics.rank import GO_ON
from daebench.draw.figures import grid_of_axes
from daebench.draw.methods import curve_of

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


def rows_of(table: "pd.DataFrame") -> list[dict[str, Any]]:
    """Return the rows of a table as dictionaries."""
    return [{str(name): value for name, value in row.items()} for row in table.to_dict("records")]


def by_method(table: "pd.DataFrame") -> list[tuple[str, "pd.DataFrame"]]:
    """Return the methods of a table in their order, each with its rows."""
    return [(str(name), rows) for name, rows in table.groupby("method", sort=False)]


def lost_rank(row: Mapping[str, Any]) -> bool:
    """Return whether a run stopped where G loses rank; the motion comes there with another step size or tolerance as well."""
    return GO_ON in str(row["failure"])


def endless(table: "pd.DataFrame") -> str:
    """Return that no run of a table reached its end, and why the first did not, as a clause; "" where one did."""
    if (table["failure"] == "").any():
        return ""
    return f"none of the {len(table)} runs reached its end; the first says: {str(table['failure'].iloc[0]).rstrip('.')}"


def error_of(table: "pd.DataFrame") -> str:
    """Return the column that says how accurate runs are: the error against a reference, or where there is none that of the energy."""
    return next((name for name in ("error_q", "error_y") if name in table), "energy_error")


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
