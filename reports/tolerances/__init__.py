"""The error of IDA against its tolerance, by formulation and treatment, with drift laws, costs, and an estimate of the error."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

from daebench.pages.report import Progress, make_page
from daebench.pages.report.page import constants
from daebench.reports.index_reduction.figures import label
from daebench.reports.tolerances import claims, drift, exact, projection, runs
from daebench.reports.tolerances import tables as _tolerances_tables
from daebench.reports.tolerances.claims import check
from daebench.reports.tolerances.figures import draw
from daebench.reports.tolerances.numbers import Numbers, measure
from daebench.reports.tolerances.tables import sentences, tables

CONSTANTS = constants(claims, drift, exact, runs, _tolerances_tables)


def make(out: Path, progress: Progress) -> Path:
    """Make the report in a folder; return the path of its page, see :func:`daebench.pages.report.make_page`."""

    def content(numbers: Numbers, conclusions: SimpleNamespace) -> dict[str, Any]:
        return {
            "c": CONSTANTS,
            "p": constants(projection),
            "drawn": draw(numbers, out / "figures"),
            "tables": tables(numbers, out / "tables"),
            "label": label,
            "ivps": runs.IVPS,
            "failures": sentences(conclusions.headline.failed),
            "spacing": float(numbers.drift["t"].iloc[1]),
        }

    return make_page("tolerances/page.html", out, "daebench report tolerances", progress, measure=measure, check=check, content=content)
