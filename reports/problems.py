"""The constrained problems, a section each: picture, definition, degrees of freedom, and what each family of methods does on it."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

from daebench.claims_bench import ROUNDINGS
from daebench.report import Progress, make_page
from daebench.reports import _problems_ivps, _problems_path, _problems_rank
from daebench.reports._problems_claims import check
from daebench.reports._problems_figures import draw
from daebench.reports._problems_numbers import Numbers, measure
from daebench.reports._problems_tables import reason, tables

COMMAND = "daebench report problems"

CONSTANTS = SimpleNamespace(
    RANK=_problems_rank, STEPS=_problems_ivps.STEPS, TOL=_problems_ivps.TOL, ROUNDINGS=ROUNDINGS, FINE=_problems_path.FINE
)


def make(out: Path, progress: Progress) -> Path:
    """Make the report in a folder; return the path of its page, see :func:`daebench.report.make_page`."""

    def content(numbers: Numbers, found: SimpleNamespace) -> dict[str, Any]:
        return {
            "c": CONSTANTS,
            "facts": numbers.facts,
            "drawings": numbers.drawings,
            "horizon": _problems_ivps.horizon,
            "step_size": _problems_ivps.step_size,
            "reason": reason,
            "drawn": draw(numbers, out / "figures"),
            "tables": tables(numbers, found.across.table, out / "tables"),
        }

    return make_page("problems.html", out, COMMAND, progress, measure=measure, check=check, content=content)
