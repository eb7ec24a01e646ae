"""Each method and its claims, measured: orders, two-form, symmetry, manifold, energy and work."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

from daebench.pages.report import Progress, make_page
from daebench.reports.methods import families, guide, reverse, series, sweep
from daebench.reports.methods.claims import check
from daebench.reports.methods.figures import draw
from daebench.reports.methods.numbers import REPEATS, Numbers, measure
from daebench.reports.methods.tables import tables
from daebench.studies.claims.bench import DEFECT_STEPS, ROUNDINGS

CONSTANTS = SimpleNamespace(
    SWEEP=sweep,
    SERIES=series,
    REVERSE=reverse,
    GUIDE=guide,
    TITLES=families.TITLES,
    ROUNDINGS=ROUNDINGS,
    DEFECT_STEPS=DEFECT_STEPS,
    REPEATS=REPEATS,
)


def make(out: Path, progress: Progress) -> Path:
    """Make the report in a folder; return the path of its page, see :func:`daebench.pages.report.make_page`."""

    def content(numbers: Numbers, conclusions: SimpleNamespace) -> dict[str, Any]:
        return {
            "c": CONSTANTS,
            "drawn": draw(numbers, conclusions.table, out / "figures"),
            "tables": tables(numbers, conclusions.table, out / "tables"),
        }

    return make_page("methods/page.html", out, "daebench report methods", progress, measure=measure, check=check, content=content)
