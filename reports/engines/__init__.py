"""Engines against exact solutions: MuJoCo, EXUDYN, Pinocchio, OpenMM, Mici, jax-md and CasADi on motions with known solutions."""

import inspect
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd

from daebench.pages.report import Progress
from daebench.pages.report.page import constants, make_report
from daebench.pages.report.tables import Table
from daebench.pages.report.thumbnail import draw_thumbnail
from daebench.reports.engines import error_and_cost, findings, measured, motions
from daebench.reports.engines.adapters import ENGINES, Engine
from daebench.reports.engines.findings import at, check
from daebench.reports.engines.measured import Numbers, measure

KEPT = "contenders"
"""Folder, beside the page, of measured contenders."""

CONSTANTS = constants(motions, findings, measured)


def make(out: Path, progress: Progress) -> Path:
    """Make the report in a folder; return the path of its page, see :func:`daebench.pages.report.page.make_report`.

    Engines that are not installed are left out, and the page says so; with none at all there is nothing to compare. Measurements are stored
    in the folder: after an interruption, the next call continues from there.
    """
    content: dict[str, Any] = {
        "c": CONSTANTS,
        "at": at,
        "kept": KEPT,
        "threads": os.environ.get("OMP_NUM_THREADS", ""),
        "all_engines": ENGINES,
    }
    content |= {"reference_of": motions.reference_of, "code_of": code_of}
    return make_report("engines", out, progress, lambda tell: measure(tell, out / KEPT), check, draw, tables, **content)


def code_of(engine: Engine) -> str:
    """Return the source of the adapter of an engine."""
    return inspect.getsource(engine.adapter)


def draw(numbers: Numbers, conclusions: SimpleNamespace, folder: Path) -> Iterator[Path]:
    """Draw all figures into a folder, and give the paths of the SVG files; none if no engine ran."""
    if numbers.engines:
        best = error_and_cost.most_accurate(numbers.chosen)
        yield error_and_cost.draw_answer(best, folder)
        yield error_and_cost.draw_cost(numbers.runs, folder)
        yield draw_thumbnail(folder, lambda axis: error_and_cost.thumbnail(axis, best))


def tables(numbers: Numbers, conclusions: SimpleNamespace) -> Mapping[str, Table | pd.DataFrame]:
    """Return the tables; none if no engine ran."""
    if not numbers.engines:
        return {}
    declared: dict[str, Table | pd.DataFrame] = {"runs": numbers.runs, "chosen": numbers.chosen}
    declared |= {
        f"motion-{motion}": findings.motion_table(str(motion), rows, numbers.runs)
        for motion, rows in numbers.chosen.groupby("motion", sort=False)
    }
    if len(numbers.sentences):
        declared["documentation"] = Table(numbers.sentences, findings.DOCUMENTATION)
    if len(numbers.tuned):
        declared["tuned"] = findings.tuned_table(numbers.tuned)
    return declared
