"""Engines against exact solutions: MuJoCo, EXUDYN, Pinocchio, OpenMM, Mici, jax-md and CasADi on motions with known solutions."""

import inspect
import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from daebench.pages.report import Progress, make_page
from daebench.pages.report.page import constants
from daebench.reports.engines import claims, motions, truth
from daebench.reports.engines import numbers as _numbers
from daebench.reports.engines.adapters import ENGINES
from daebench.reports.engines.claims import check
from daebench.reports.engines.figures import draw
from daebench.reports.engines.numbers import Numbers, measure
from daebench.reports.engines.tables import at, tables

KEPT = "contenders"
"""Folder, beside the page, of measured contenders."""

CONSTANTS = constants(motions, truth, claims, _numbers)


def make(out: Path, progress: Progress) -> Path:
    """Make the report in a folder; return the path of its page, see :func:`daebench.pages.report.make_page`.

    Engines that are not installed are left out, and the page says so; with none at all there is nothing to compare. Measurements are stored
    in the folder: after an interruption, the next call continues from there.
    """

    def content(numbers: Numbers, conclusions: SimpleNamespace) -> dict[str, Any]:
        return {
            "c": CONSTANTS,
            "at": at,
            "kept": KEPT,
            "threads": os.environ.get("OMP_NUM_THREADS", ""),
            "drawn": draw(numbers, out / "figures"),
            "tables": tables(numbers, out / "tables"),
            "truths": {first.motion.key: truth.truth(first.motion.key) for first in conclusions.firsts},
            "all_engines": ENGINES,
            "code": {engine.name: inspect.getsource(engine.adapter) for engine in numbers.engines},
        }

    return make_page(
        "engines/page.html",
        out,
        "daebench report engines",
        progress,
        measure=lambda tell: measure(tell, out / KEPT),
        check=check,
        content=content,
    )
