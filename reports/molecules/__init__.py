"""Which constraint tolerance a molecule needs: energy drift with the constraint solvers of molecular dynamics, its law, and its cost."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

from daebench.pages.report import Progress, make_page
from daebench.pages.report.page import constants
from daebench.reports.molecules import claims, laws, motions, well
from daebench.reports.molecules import numbers as _numbers
from daebench.reports.molecules.claims import check
from daebench.reports.molecules.figures import draw
from daebench.reports.molecules.numbers import Numbers, measure
from daebench.reports.molecules.tables import femtoseconds, tables

CONSTANTS = constants(motions, well, claims, laws, _numbers)


def make(out: Path, progress: Progress) -> Path:
    """Make the report in a folder; return the path of its page, see :func:`daebench.pages.report.make_page`."""

    def content(numbers: Numbers, conclusions: SimpleNamespace) -> dict[str, Any]:
        return {
            "c": CONSTANTS,
            "drawn": draw(numbers, conclusions, out / "figures"),
            "tables": tables(numbers, conclusions, out / "tables"),
            "femtoseconds": femtoseconds,
        }

    return make_page("molecules/page.html", out, "daebench report molecules", progress, measure=measure, check=check, content=content)
