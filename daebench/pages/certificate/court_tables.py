"""The tables of a court: contestants on one problem, and what was left out."""

import math
from collections.abc import Sequence
from typing import Any

import pandas as pd
from markupsafe import Markup

from daebench.pages.certificate.sentences import defect, energy, holds, known, order
from daebench.pages.report.sentences import at_most, number
from daebench.pages.report.tables import Formats, code, column, table, text
from daebench.studies.certificate.record import verdicts

ROUNDS = 1
"""Digits of numbers that may be only rounding."""


def contestants_table(k: int, where: str, rows: Sequence[tuple[Any, Any]]) -> Markup:
    """Return a row for each contestant on one problem with one step size, the most accurate first."""
    cells = sorted((_row(entry, problem) for entry, problem in rows), key=lambda row: (math.isnan(row["error"]), row["error"]))
    frame = pd.DataFrame(cells)
    frame["order"] = column([row["order"] for row in cells], frame)
    formats: Formats = {"name": text, "method": code, "holds": text, "order": text, "error": at_most, "energy": text}
    formats |= {"size": at_most, "g": _small, "defect": _small, "microseconds": number}
    headings = {"name": "contestant", "method": "code", "holds": "claims<small>that hold</small>", "error": "error<small>largest</small>"}
    headings |= {
        "size": "energy error<small>of kinetic energy</small>",
        "g": "|<i>g</i>|",
        "defect": "defect of the<small>two-form</small>",
    }
    headings |= {"microseconds": "a step<small>µs</small>"}
    t = rows[0][1]["numbers"]["error"]["t"]
    caption = Markup("<b>{}.</b> Error: the largest of a coordinate up to t = {:g}. Every number was measured here.").format(where, t)
    return table(f"contestants-{k}", frame, formats, headings, caption)


def _row(entry: Any, problem: Any) -> dict[str, Any]:
    numbers = problem["numbers"]
    return {
        "name": entry.name,
        "method": entry.verification.certificate.method,
        "holds": holds(verdicts(entry.verification.problems)),
        "order": order(numbers),
        "error": known(numbers["error"]["value"]),
        "energy": energy(numbers),
        "size": known(numbers["energy"]["size"]),
        "g": known(numbers["conserved"].get("g")),
        "defect": defect(numbers),
        "microseconds": 1e6 * known(problem["seconds"]),
    }


def _small(value: float) -> Markup:
    return number(value, ROUNDS)


def excluded_table(excluded: Sequence[Any]) -> Markup:
    """Return a row for each file that was left out, with why."""
    frame = pd.DataFrame({"name": [entry.name for entry in excluded], "why": [entry.why for entry in excluded]})
    caption = "<b>Left out.</b> The tables contain nothing from these files."
    return table("excluded", frame, {"name": code, "why": _long}, {"name": "file", "why": "why"}, caption)


def _long(text: str) -> Markup:
    return Markup('<span class="long">{}</span>').format(text)
