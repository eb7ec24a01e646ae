"""The tables of the report on ensembles, each with its data as CSV."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd
from markupsafe import Markup

from daebench.draw.figures import save_table
from daebench.pages.report import number, percent, table
from daebench.pages.report.tables import code
from daebench.reports.ensembles.motions import METHODS
from daebench.reports.ensembles.numbers import Numbers

Format = Callable[[Any], Any]


def tables(numbers: Numbers, conclusions: SimpleNamespace, folder: Path) -> dict[str, Callable[[str], Markup]]:
    """Write the tables as CSV; return what makes HTML of each, given a caption."""
    ratios: dict[str, Format] = dict.fromkeys(METHODS[1:], number)
    parts: dict[str, Format] = dict.fromkeys(METHODS, percent)
    title, step = conclusions.titles.__getitem__, {"h": "<i>h</i>"}
    first: dict[str, Format] = {"motion": title, "method": code, "h": number}
    layouts: dict[str, tuple[pd.DataFrame, dict[str, Format], dict[str, str]]] = {
        "errors": (
            conclusions.sizes,
            first | dict.fromkeys(("own", "low", "median", "high"), number) | {"rank": percent},
            step | {"own": "case", "low": "5 %", "high": "95 %", "rank": "starts with less"},
        ),
        "winners": (
            conclusions.winners,
            {"motion": title, "price": _price, "own": _named, "most": code, "part": percent, "error": percent} | parts,
            {"own": "best, case", "most": "best from the most starts", "part": "of the starts", "error": "±"}
            | {method: str(code(method)) for method in METHODS},
        ),
        "failures": (
            conclusions.failures,
            first | {"part": percent, "own": lambda why: why or "reached its end", "why": str},
            step | {"part": "stopped", "own": "the case", "why": "why, and how many"},
        ),
        "verdicts": (
            conclusions.trends,
            first | {"own": str, "flat": percent, "undetermined": percent, "drifts": percent, "failed": percent},
            step | {"own": "case", "flat": "no drift", "failed": "stopped"},
        ),
        "price": (
            numbers.alone.merge(numbers.prices.pivot(index="motion", columns="method", values="ratio").reset_index(), on="motion"),
            {"motion": title, "alone": number, "together": number, "starts": number} | ratios,
            {"alone": "alone [ns]", "together": "of many [ns]", "starts": "times"} | {method: str(code(method)) for method in METHODS[1:]},
        ),
    }
    for name, (frame, _, _) in layouts.items():
        save_table(folder / f"{name}.csv", frame)
    return {name: partial(table, name, *layout) for name, layout in layouts.items() if len(layout[0])}


def _price(fraction: int) -> str:
    return "1" if fraction == 1 else f"{fraction} times that"


def _named(method: str) -> Any:
    return code(method) if method else "none"
