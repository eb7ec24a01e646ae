"""``daebench reference list``: what there is, and how far it goes."""

from typing import Any

from daebench.cli.arguments import Json
from daebench.cli.console import print_json, print_table
from daebench.cli.reference.arguments import Folder, place


def listing(folder: Folder = None, as_json: Json = False) -> None:
    """List all references: horizon, bound and how each was made."""
    from daebench.reference.certified.store import names

    rows = [_row(name, folder) for name in names(place(folder))]
    if as_json:
        print_json(rows)
        return
    print_table(
        ["reference", "rows", "to t", "double precision to", "largest |dq| at the end", "truth"],
        [
            [
                each["name"],
                str(each["rows"]),
                f"{each['horizon']:g}",
                "the end" if each["double_horizon"] is None else f"{each['double_horizon']:g}",
                f"{each['bound']:.1g}",
                each["truth"],
            ]
            for each in rows
        ],
    )


def _row(name: str, folder: Any) -> dict[str, Any]:
    from daebench.reference.certified.store import load

    found = load(name, place(folder))
    return {
        "name": name,
        "problem": found.problem,
        "case": found.case,
        "rows": len(found.t),
        "horizon": found.horizon,
        "double_horizon": found.certificate["horizon"]["double"],
        "bound": float(found.bound["q"][-1].max()),
        "truth": found.certificate["made"]["method"],
    }
