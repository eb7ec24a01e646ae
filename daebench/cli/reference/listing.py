"""``daebench reference list``: all references and their horizons."""

from pathlib import Path
from typing import Any

import typer

from daebench.cli.arguments import Json
from daebench.cli.console import print_json, print_table
from daebench.cli.reference.arguments import Folder, whose
from daebench.reference.keep.form import folders
from daebench.reference.keep.store import Damaged, kept_in, load, names


def listing(folder: Folder = None, as_json: Json = False) -> None:
    """List all references: horizons, bound, owner and origin of each; exit 1 if one is damaged."""
    rows = [_row(name, folder) for name in names(folder)]
    if as_json:
        print_json(rows)
    else:
        columns = ["reference", "rows", "to t", "in double to t", "bound at the end", "of"]
        print_table(columns, [_cells(row) for row in rows if "damaged" not in row])
        for entry in rows:
            if "damaged" in entry:
                print(f"damaged: {entry['damaged']}")
        for name, place in _hidden(folder):
            print(f"{name} of {place} is not listed, because daebench has one of this name; see it with --folder.")
    raise typer.Exit(1 if any("damaged" in row for row in rows) else 0)


def _cells(row: dict[str, Any]) -> list[str]:
    double = "the end" if row["double_horizon"] is None else f"{row['double_horizon']:g}"
    return [row["name"], str(row["rows"]), f"{row['horizon']:g}", double, f"{row['bound']:.1g}", row["kept_in"]]


def _hidden(folder: Path | None) -> list[tuple[str, Path]]:
    """Return the user's own references that are hidden by those of daebench, and their places."""
    first, *rest = folders(folder)
    shown = names(first)
    return [(name, place) for place in rest for name in names(place) if name in shown]


def _row(name: str, folder: Path | None) -> dict[str, Any]:
    try:
        reference = load(name, folder)
    except Damaged as error:
        return {"name": name, "kept_in": whose(kept_in(name, folder)), "damaged": str(error)}
    return {
        "name": name,
        "kept_in": whose(kept_in(name, folder)),
        "problem": reference.problem,
        "case": reference.case,
        "rows": len(reference.t),
        "horizon": reference.horizon,
        "double_horizon": reference.certificate["horizon"]["double"],
        "bound": float(reference.bound[reference.state.columns[0]][-1].max()),
        "truth": reference.certificate["made"]["method"],
    }
