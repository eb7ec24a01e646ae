"""What IDA's tolerance buys: asked tolerance against reached accuracy by formulation and cure, drift laws, cost, its own estimate."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

from daebench.report import Progress, make_page
from daebench.reports import _tolerances_claims, _tolerances_drift, _tolerances_runs, _tolerances_tables
from daebench.reports._index_reduction_figures import label
from daebench.reports._tolerances_claims import check
from daebench.reports._tolerances_figures import draw
from daebench.reports._tolerances_numbers import Numbers, measure
from daebench.reports._tolerances_tables import sentences, tables

COMMAND = "daebench report tolerances"

MODULES = (_tolerances_claims, _tolerances_drift, _tolerances_runs, _tolerances_tables)
CONSTANTS = SimpleNamespace(**{name: value for module in MODULES for name, value in vars(module).items() if name.isupper()})


def make(out: Path, progress: Progress) -> Path:
    """Make the report in a folder; return the path of its page, see :func:`daebench.report.make_page`."""

    def content(numbers: Numbers, found: SimpleNamespace) -> dict[str, Any]:
        return {
            "c": CONSTANTS,
            "drawn": draw(numbers, out / "figures"),
            "tables": tables(numbers, out / "tables"),
            "label": label,
            "ivps": _tolerances_runs.IVPS,
            "failures": sentences(found.headline.failed),
            "spacing": float(numbers.drift["t"].iloc[1]),
        }

    return make_page("tolerances.html", out, COMMAND, progress, measure=measure, check=check, content=content)
