"""The constrained problems, one section each: picture, definition, degrees of freedom, and the results of each family of methods."""

from importlib import resources
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from markupsafe import Markup

from daebench.pages.report import Progress, make_page
from daebench.reports.problems import cards, ivps, path, rank
from daebench.reports.problems.claims import check
from daebench.reports.problems.figures import draw
from daebench.reports.problems.numbers import Numbers, measure
from daebench.reports.problems.tables import reason, tables
from daebench.studies.claims.bench import ROUNDINGS

CONSTANTS = SimpleNamespace(RANK=rank, STEPS=ivps.STEPS, TOL=ivps.TOL, ROUNDINGS=ROUNDINGS, FINE=path.FINE, SECONDS=cards.SECONDS)


def make(out: Path, progress: Progress) -> Path:
    """Make the report in a folder; return the path of its page, see :func:`daebench.pages.report.make_page`."""

    def content(numbers: Numbers, conclusions: SimpleNamespace) -> dict[str, Any]:
        return {
            "c": CONSTANTS,
            "facts": numbers.facts,
            "drawings": numbers.drawings,
            "motions": cards.motions(numbers.drawings),
            "moving": Markup((resources.files(__package__) / "cards.js").read_text(encoding="utf-8")),
            "horizon": ivps.horizon,
            "step_size": ivps.step_size,
            "reason": reason,
            "drawn": draw(numbers, out / "figures"),
            "tables": tables(numbers, conclusions.across.table, out / "tables"),
        }

    return make_page("problems/page.html", out, "daebench report problems", progress, measure=measure, check=check, content=content)
