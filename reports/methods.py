"""Which method is which, what each promises, and whether it keeps it: orders, two-form, reversal, manifold, energy and work, measured."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

from daebench.claims_bench import DEFECT_STEPS, ROUNDINGS
from daebench.report import Progress, make_page
from daebench.reports import _methods_families, _methods_guide, _methods_reverse, _methods_series, _methods_sweep
from daebench.reports._methods_claims import check
from daebench.reports._methods_figures import draw
from daebench.reports._methods_numbers import REPEATS, Numbers, measure
from daebench.reports._methods_tables import tables

COMMAND = "daebench report methods"

CONSTANTS = SimpleNamespace(
    SWEEP=_methods_sweep,
    SERIES=_methods_series,
    REVERSE=_methods_reverse,
    GUIDE=_methods_guide,
    TITLES=_methods_families.TITLES,
    ROUNDINGS=ROUNDINGS,
    DEFECT_STEPS=DEFECT_STEPS,
    REPEATS=REPEATS,
)


def make(out: Path, progress: Progress) -> Path:
    """Make the report in a folder; return the path of its page, see :func:`daebench.report.make_page`."""

    def content(numbers: Numbers, found: SimpleNamespace) -> dict[str, Any]:
        return {
            "c": CONSTANTS,
            "drawn": draw(numbers, found.table, out / "figures"),
            "tables": tables(numbers, found.table, out / "tables"),
        }

    return make_page("methods.html", out, COMMAND, progress, measure=measure, check=check, content=content)
