"""The table of a comparison on 80 columns, and the notes below it."""

import textwrap
from typing import TYPE_CHECKING, Any

from daebench.cli.console import print_table

if TYPE_CHECKING:
    import pandas as pd

WIDTH = 80
"""Width of a comparison in characters."""

HANGING: dict[str, Any] = {"subsequent_indent": "  ", "break_on_hyphens": False}
"""Line breaking of long notes."""

LOST = 1.0
"""Energy error relative to the mean kinetic energy above which a motion is lost."""


def print_narrow(table: "pd.DataFrame") -> None:
    """Print one line per method: its step size or tolerance, error, size and trend of the energy, error of the position, and time."""
    resolutions = [name for name in ("h", "tol") if name in table]
    columns = ["method", " or ".join(resolutions), "energy\nerror", "over\nmean T", "energy", "position\nerror", "seconds"]
    print_table(columns, [_line(row, resolutions) for row in table.to_dict("records")], width=WIDTH)


def _line(row: dict[Any, Any], resolutions: list[str]) -> list[str]:
    value = next(row[name] for name in resolutions if row[name] == row[name])
    return [
        str(row["method"]),
        f"{value:.3g}",
        _number(row["energy_error"]),
        _size(row.get("energy_size", float("nan"))),
        str(row.get("energy_verdict", "")),
        _position(row["position_error"], row["position_bound"]),
        _number(row["seconds"]),
    ]


def _number(value: float) -> str:
    return f"{value:.2g}" if value == value else ""


def _size(value: float) -> str:
    """Return the size of an energy error, and whether the motion is lost."""
    return f"{_number(value)}{' lost' if value > LOST else ''}"


def _position(error: float, bound: float) -> str:
    """Return an error of the position; an error that equals the bound of its reference is marked as an upper bound."""
    if error != error:
        return "unknown" if bound == bound else ""
    return f"< {_number(error)}" if error == bound else _number(error)


def notes(table: "pd.DataFrame") -> list[str]:
    """Return the references of positions, on 80 columns: a note for each reference, with its methods if there are several references."""
    compared_rows = table[table["position_reference"] != ""]
    remarks = []
    for words, rows in compared_rows.groupby("position_reference", sort=False):
        of = "" if compared_rows["position_reference"].nunique() == 1 else f" of {', '.join(rows['method'])}"
        remarks.append(textwrap.fill(f"position error{of}: {_against(str(words), float(rows['position_bound'].max()))}", WIDTH, **HANGING))
    return remarks


def _against(words: str, bound: float) -> str:
    return words if words.startswith("unknown") else f"against {words}, which may be wrong by {bound:.1e}"
