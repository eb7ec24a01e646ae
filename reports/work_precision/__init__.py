"""Error against CPU time and evaluations for methods of all families, what each conserves, and which to choose."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd

from daebench.pages.report import Progress
from daebench.pages.report.page import constants, make_report
from daebench.pages.report.tables import Table
from daebench.pages.report.thumbnail import draw_thumbnail
from daebench.reports.work_precision import conclusions, overview, works
from daebench.reports.work_precision.conclusions import check, setting, times
from daebench.reports.work_precision.works import Numbers, measure
from daebench.studies.grid import measure as _grid_measure
from daebench.studies.work_precision import figure, study

CONSTANTS = constants(_grid_measure, study, conclusions, works)


def make(out: Path, progress: Progress) -> Path:
    """Make the report in a folder; return the path of its page, see :func:`daebench.pages.report.page.make_report`.

    Runs are stored in the folder: after an interruption, the next call continues from there.
    """
    content: dict[str, Any] = {"c": CONSTANTS, "setting": setting, "times": times}
    return make_report("work-precision", out, progress, lambda tell: measure(out, tell), check, draw, tables, **content)


def draw(numbers: Numbers, findings: SimpleNamespace, folder: Path) -> Iterator[Path]:
    """Draw all figures into a folder, and give the paths of the SVG files."""
    ratios = overview.ratios(numbers.works, numbers.runs)
    yield overview.draw_overview(numbers.works, ratios, folder)
    for work in numbers.works:
        label, runs = f"largest error of a component of ${work.letter}$", numbers.runs[work.key]
        yield figure.draw(folder, runs, work.error, label, stem=work.key, against=["seconds"], methods=findings.found[work.key].curves)
        for stem, cost in ((f"{work.key}-all", "seconds"), (f"{work.key}-evaluations", "evaluations")):
            yield figure.draw(folder, runs, work.error, label, stem=stem, against=[cost])
    yield draw_thumbnail(folder, lambda axis: overview.thumbnail(axis, ratios))


def tables(numbers: Numbers, findings: SimpleNamespace) -> Mapping[str, Table | pd.DataFrame]:
    """Return the tables, by name and motion."""
    declared: dict[str, Table | pd.DataFrame] = {"defects": numbers.defects}
    declared["summary"] = conclusions.summary_table(numbers.works, findings.found)
    for work in numbers.works:
        summary, runs = findings.found[work.key], numbers.runs[work.key]
        declared |= {
            f"runs-{work.key}": runs,
            f"winners-{work.key}": conclusions.winners_table(work, summary.winners, dict(runs.groupby("method")["knob"].first())),
            f"keeps-{work.key}": conclusions.keeps_table(work, summary.keeps, numbers.defects),
            f"advice-{work.key}": conclusions.advice_table(work, summary.advice),
            f"front-{work.key}": conclusions.front_table(work, summary.front["seconds"]),
            f"failed-{work.key}": Table(summary.failed, conclusions.FAILED, {}),
        }
    return declared
