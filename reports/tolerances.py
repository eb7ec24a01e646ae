"""What IDA's tolerance buys: asked tolerance against reached accuracy by formulation and cure, drift laws, cost, its own estimate."""

import time
from pathlib import Path
from types import SimpleNamespace

from daebench.report import Progress, picture, write_page
from daebench.reports import _tolerances_claims, _tolerances_drift, _tolerances_runs, _tolerances_tables
from daebench.reports._index_reduction_figures import label
from daebench.reports._tolerances_claims import check
from daebench.reports._tolerances_figures import draw
from daebench.reports._tolerances_numbers import measure
from daebench.reports._tolerances_tables import sentences, tables

COMMAND = "daebench report tolerances"

MODULES = (_tolerances_claims, _tolerances_drift, _tolerances_runs, _tolerances_tables)
CONSTANTS = SimpleNamespace(**{name: value for module in MODULES for name, value in vars(module).items() if name.isupper()})


def make(out: Path, progress: Progress) -> Path:
    """Compute, check, draw and write the page; return its path.

    Raises
    ------
    BadInput
        If a certified reference is missing.
    ClaimRefuted
        If a sentence of the page does not hold in this run.
    """
    began = time.perf_counter()
    out.mkdir(parents=True, exist_ok=True)
    progress(0.0, "references")
    numbers = measure(lambda fraction, doing: progress(0.95 * fraction, doing))
    found = check(numbers)
    progress(0.96, "figures")
    drawn = draw(numbers, out / "figures")
    content = vars(found) | {
        "c": CONSTANTS,
        "drawn": drawn,
        "picture": picture,
        "tables": tables(numbers, out / "tables"),
        "label": label,
        "scenes": _tolerances_runs.SCENES,
        "failures": sentences(found.headline.failed),
        "spacing": float(numbers.drift["t"].iloc[1]),
        "took": time.perf_counter() - began,
    }
    page = write_page("tolerances.html", out / "index.html", COMMAND, **content)
    progress(1.0, "done")
    return page
