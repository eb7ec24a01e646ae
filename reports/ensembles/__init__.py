"""Errors, winners, failures and verdicts from a thousand starts of one energy, and their cost."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

from daebench.pages.report import Progress, make_page
from daebench.pages.report.page import constants
from daebench.reports.ensembles import claims, motions
from daebench.reports.ensembles import numbers as _numbers
from daebench.reports.ensembles.claims import check
from daebench.reports.ensembles.figures import draw
from daebench.reports.ensembles.numbers import Numbers, measure
from daebench.reports.ensembles.tables import tables

CONSTANTS = constants(motions, claims, _numbers)


def make(out: Path, progress: Progress) -> Path:
    """Make the report in a folder; return the path of its page, see :func:`daebench.pages.report.make_page`."""

    def content(numbers: Numbers, conclusions: SimpleNamespace) -> dict[str, Any]:
        return {
            "c": CONSTANTS,
            "motions": numbers.motions,
            "drawn": draw(conclusions, out / "figures"),
            "tables": tables(numbers, conclusions, out / "tables"),
        }

    return make_page("ensembles/page.html", out, "daebench report ensembles", progress, measure=measure, check=check, content=content)
