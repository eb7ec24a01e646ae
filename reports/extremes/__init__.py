"""Where methods break: steps, parameters, penalties, round-off, chaos and precision."""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
from markupsafe import Markup

from daebench.draw.figures import save
from daebench.pages.report import Progress
from daebench.pages.report.claims import require
from daebench.pages.report.page import make_report
from daebench.pages.report.tables import Table
from daebench.pages.report.thumbnail import draw_thumbnail
from daebench.reports.extremes import sections
from daebench.reports.extremes.findings import BY_EXTREME, horizons, in_precision, largest_steps, limits, ratios, thumbnail, typeset
from daebench.reports.extremes.sections import Numbers
from daebench.studies import precision
from daebench.studies.grid.outcomes import OUTCOMES
from daebench.studies.stability.penalty import LIMITS
from daebench.studies.stability.study import EXTREMES


def make(out: Path, progress: Progress) -> Path:
    """Make the report in a folder; return the path of its page, see :func:`daebench.pages.report.page.make_report`."""

    def measure(callback: Progress) -> Numbers:
        return sections.measure(out, callback, sections.SECTIONS)

    return make_report("extremes", out, progress, measure, check, draw, tables, sections=sections.SECTIONS, store=sections.STORE)


def check(numbers: Numbers) -> SimpleNamespace:
    """Return the numbers of the text; the first sentence that does not hold raises ClaimRefuted."""
    for key, table in numbers.tables.items():
        require(len(table), f"the section {key} has runs", "none")
    words = set(numbers.tables["map"]["outcome"])
    return SimpleNamespace(
        runs=sum(len(table) for table in numbers.tables.values()) + len(numbers.precision),
        steps=limits(numbers.tables["steps"]),
        masses=ratios(numbers.tables["masses"]),
        chaos=horizons(numbers.tables["chaos"]),
        says=_said(EXTREMES["step-limit"].says, numbers.tables["steps"]),
        precision=_said(precision.says, numbers.precision),
        outcomes={word: OUTCOMES[word] for word in OUTCOMES if word in words},
    )


def _said(says: Callable[[pd.DataFrame], list[str]], table: pd.DataFrame) -> list[Markup]:
    """Return the sentences on a table, as HTML."""
    methods = set(table["method"]) | set(LIMITS.values())
    return [typeset(sentence, methods) for sentence in says(table)]


def draw(numbers: Numbers, findings: SimpleNamespace, folder: Path) -> Iterator[Path]:
    """Draw all figures into a folder, and give the paths of the SVG files."""
    for section in sections.SECTIONS:
        yield EXTREMES[section.extreme].draw(folder, section.key, numbers.tables[section.key])
    yield save(precision.figure(numbers.precision), folder, "precision", numbers.precision)
    yield draw_thumbnail(folder, lambda axis: thumbnail(axis, numbers.tables["steps"]))


def tables(numbers: Numbers, findings: SimpleNamespace) -> Mapping[str, Table | pd.DataFrame]:
    """Return the tables."""
    shown = {section.key: section.extreme for section in sections.SECTIONS if section.extreme in BY_EXTREME}
    return {
        "limits": largest_steps(numbers.tables["steps"]),
        "precision": in_precision(numbers.precision),
        **{key: BY_EXTREME[extreme](numbers.tables[key]) for key, extreme in shown.items()},
    }
