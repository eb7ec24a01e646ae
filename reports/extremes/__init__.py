"""Where methods break: steps, parameters, penalties, round-off, chaos and precision."""

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd
from markupsafe import Markup

from daebench.pages.report import Progress, make_page
from daebench.pages.report.thumbnail import draw_thumbnail
from daebench.reports.extremes import ivps
from daebench.reports.extremes import numbers as _extremes_numbers
from daebench.reports.extremes.claims import check
from daebench.reports.extremes.first_picture import thumbnail
from daebench.reports.extremes.numbers import Numbers
from daebench.reports.extremes.tables import tables, typeset
from daebench.studies.precision import study
from daebench.studies.precision.figure import draw
from daebench.studies.stability.penalty import LIMITS
from daebench.studies.stability.study import EXTREMES


def make(out: Path, progress: Progress) -> Path:
    """Make the report in a folder; return the path of its page, see :func:`daebench.pages.report.make_page`."""
    sections = ivps.SECTIONS

    def content(numbers: Numbers, facts: SimpleNamespace) -> dict[str, Any]:
        figures = {
            section.key: EXTREMES[section.extreme].draw(out / "figures", section.key, numbers.tables[section.key]) for section in sections
        }
        draw_thumbnail(out / "figures", lambda axis: thumbnail(axis, numbers.tables["steps"]))
        return {
            "sections": sections,
            "drawn": figures | {"precision": draw(out / "figures", "precision", numbers.precision)},
            "says": {"steps": _said(EXTREMES["step-limit"].says, numbers.tables["steps"])},
            "precision": _said(study.says, numbers.precision),
            "tables": tables(numbers, out / "tables"),
            "store": _extremes_numbers.STORE,
        }

    def measure(callback: Progress) -> Numbers:
        return _extremes_numbers.measure(out, callback, sections)

    return make_page("extremes/page.html", out, "daebench report extremes", progress, measure=measure, check=check, content=content)


def _said(says: Callable[[pd.DataFrame], list[str]], table: pd.DataFrame) -> list[Markup]:
    """Return the sentences on a table, as HTML."""
    methods = set(table["method"]) | set(LIMITS.values())
    return [typeset(sentence, methods) for sentence in says(table)]
