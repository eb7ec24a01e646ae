"""The runs of the report on extremes, in a store beside the page."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from daebench.pages.report import Progress
from daebench.pages.report.timed_runs import Processes, make_runs
from daebench.pages.report.two_processes import two_processes
from daebench.records.store import opened
from daebench.reports.extremes.ivps import PRECISION, SECTIONS, Section
from daebench.studies.grid.runs import runs_of
from daebench.studies.precision.study import specifications_of, table_of
from daebench.studies.stability.study import EXTREMES

STORE = "studies.db"
"""File of the stored runs."""

KNOWN = 0.95
"""Fraction of the work that is done after the runs that are known beforehand."""


@dataclass(frozen=True)
class Numbers:
    """What was measured.

    Parameters
    ----------
    tables : mapping of str to DataFrame
        The table of each section, by its key.
    precision : DataFrame
        Runs in several precisions.
    """

    tables: Mapping[str, pd.DataFrame]
    precision: pd.DataFrame


def measure(out: Path, progress: Progress, sections: Sequence[Section] = SECTIONS, processes: Processes = two_processes) -> Numbers:
    """Return the numbers; runs in the store of the folder are not repeated.

    Runs that are known beforehand are made in two processes, timed runs in different precisions last; bisections make further runs.
    """
    ways = specifications_of(PRECISION)[0]
    with opened(out / STORE) as store:
        known = [specification for section in sections for specification in EXTREMES[section.extreme].specifications(section.asked)]
        make_runs(
            [*known, *(specification for _, specification in ways)], store, lambda done, doing: progress(KNOWN * done, doing), processes
        )
        tables: dict[str, pd.DataFrame] = {}
        for k, section in enumerate(sections):
            progress(KNOWN + (1 - KNOWN) * k / len(sections), section.title)
            tables[section.key] = EXTREMES[section.extreme].measure(section.asked, runs_of(store))
        return Numbers(tables, table_of(ways, runs_of(store)))
