"""Methods driven to where they break: steps, parameters, penalties, round-off, chaos and precision."""

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd
from markupsafe import Markup

from daebench.report import Progress, make_page
from daebench.reports import _extremes_ivps, _extremes_numbers
from daebench.reports._extremes_claims import check
from daebench.reports._extremes_numbers import Numbers
from daebench.reports._extremes_tables import tables, typeset
from daebench.studies import precision
from daebench.studies.extremes.penalty import LIMITS
from daebench.studies.precision_figure import draw
from daebench.studies.stability import EXTREMES

COMMAND = "daebench report extremes"


def make(out: Path, progress: Progress) -> Path:
    """Make the report in a folder; return the path of its page, see :func:`daebench.report.make_page`."""
    sections = _extremes_ivps.SECTIONS

    def content(numbers: Numbers, found: SimpleNamespace) -> dict[str, Any]:
        figures = {each.key: EXTREMES[each.extreme].draw(out / "figures", each.key, numbers.tables[each.key]) for each in sections}
        return {
            "sections": sections,
            "drawn": figures | {"precision": draw(out / "figures", "precision", numbers.precision)},
            "says": {each.key: _said(EXTREMES[each.extreme].says, numbers.tables[each.key]) for each in sections},
            "precision": _said(precision.says, numbers.precision),
            "tables": tables(numbers, out / "tables"),
            "store": _extremes_numbers.STORE,
        }

    def measure(told: Progress) -> Numbers:
        return _extremes_numbers.measure(out, told, sections)

    return make_page("extremes.html", out, COMMAND, progress, measure=measure, check=check, content=content)


def _said(says: Callable[[pd.DataFrame], list[str]], table: pd.DataFrame) -> list[Markup]:
    """Return what is said of a table, as HTML."""
    methods = set(table["method"]) | set(LIMITS.values())
    return [typeset(sentence, methods) for sentence in says(table)]
