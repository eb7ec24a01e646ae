"""Error against CPU time and evaluations for methods of all families, what each conserves, and which to choose."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

from daebench.pages.report import Progress, make_page
from daebench.pages.report.page import constants
from daebench.reference.keep import store
from daebench.reference.keep.folders import DATA
from daebench.reports.work_precision import claims, ivps
from daebench.reports.work_precision import numbers as _numbers
from daebench.reports.work_precision.claims import check
from daebench.reports.work_precision.figures import draw_all
from daebench.reports.work_precision.numbers import Numbers, measure
from daebench.reports.work_precision.tables import setting, tables, times
from daebench.studies.grid import measure as _grid_measure
from daebench.studies.work_precision import recommend, study

CONSTANTS = constants(_grid_measure, recommend, study, ivps, claims, _numbers)


def make(out: Path, progress: Progress) -> Path:
    """Make the report in a folder; return the path of its page, see :func:`daebench.pages.report.make_page`.

    Runs are stored in the folder: after an interruption, the next call continues from there.
    """

    def content(numbers: Numbers, conclusions: SimpleNamespace) -> dict[str, Any]:
        used = {f"{work.problem}-{work.case}" for work in numbers.works}
        methods = {method for runs in numbers.runs.values() for method in runs["method"]}
        return {
            "c": CONSTANTS,
            "coarse": {method: tol for method, tol in ivps.COARSE.items() if method in methods},
            "drawn": draw_all(numbers, out / "figures"),
            "tables": tables(numbers, conclusions.found, out / "tables"),
            "references": len(store.names(DATA)),
            "unused": len(set(store.names(DATA)) - used),
            "left_out": numbers.left_out,
            "setting": setting,
            "times": times,
        }

    return make_page(
        "work_precision/page.html",
        out,
        "daebench report work-precision",
        progress,
        measure=lambda tell: measure(out, tell),
        check=check,
        content=content,
    )
