"""The runs of the report on extremes, kept in a store beside the page."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from daebench.report import Progress
from daebench.reports._extremes_scenes import PRECISION, SECTIONS, Section
from daebench.studies.cell import Cell
from daebench.studies.precision import cells_of, table_of
from daebench.studies.runs import Runs, runs_of
from daebench.studies.stability import EXTREMES
from daebench.studies.store import opened

STORE = "studies.db"
"""File in which runs are kept."""


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


def measure(out: Path, progress: Progress, sections: Sequence[Section] = SECTIONS) -> Numbers:
    """Return the numbers; runs that the store in the folder has are taken from there."""
    tables: dict[str, pd.DataFrame] = {}
    with opened(out / STORE) as kept:

        def runs(k: int, name: str) -> Runs:
            def tell(done: int, of: int, cell: Cell) -> None:
                progress((k + done / of) / (len(sections) + 1), f"{name}: {cell.method}")

            return runs_of(kept, tell=tell)

        for k, section in enumerate(sections):
            tables[section.key] = EXTREMES[section.extreme].measure(section.asked, runs(k, section.key))
        precision = table_of(cells_of(PRECISION)[0], runs(len(sections), "precision"))
    return Numbers(tables, precision)
