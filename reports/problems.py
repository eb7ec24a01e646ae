"""The constrained problems, a section each: picture, definition, degrees of freedom, and what each family of methods does on it."""

import time
from pathlib import Path
from types import SimpleNamespace

from daebench.claims_bench import ROUNDINGS
from daebench.report import Progress, picture, write_page
from daebench.reports import _problems_path, _problems_rank, _problems_scenes
from daebench.reports._problems_claims import check
from daebench.reports._problems_figures import draw
from daebench.reports._problems_numbers import measure
from daebench.reports._problems_tables import reason, tables

COMMAND = "daebench report problems"

CONSTANTS = SimpleNamespace(
    RANK=_problems_rank, STEPS=_problems_scenes.STEPS, TOL=_problems_scenes.TOL, ROUNDINGS=ROUNDINGS, FINE=_problems_path.FINE
)


def make(out: Path, progress: Progress) -> Path:
    """Compute, check, draw and write the page; return its path.

    Raises
    ------
    ClaimRefuted
        If a sentence of the page does not hold in this run.
    """
    began = time.perf_counter()
    out.mkdir(parents=True, exist_ok=True)
    progress(0.0, "runs")
    numbers = measure(lambda fraction, doing: progress(0.92 * fraction, doing))
    found = check(numbers)
    progress(0.93, "figures")
    drawn = draw(numbers, out / "figures")
    content = vars(found) | {
        "c": CONSTANTS,
        "facts": numbers.facts,
        "drawings": numbers.drawings,
        "horizon": _problems_scenes.horizon,
        "step_size": _problems_scenes.step_size,
        "reason": reason,
        "drawn": drawn,
        "picture": picture,
        "tables": tables(numbers, found.across.table, out / "tables"),
        "took": time.perf_counter() - began,
    }
    page = write_page("problems.html", out / "index.html", COMMAND, **content)
    progress(1.0, "done")
    return page
