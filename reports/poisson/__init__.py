"""Poisson systems and their integrators: HLW Fig. 4.1, Poisson defects, Casimir functions, a lattice and a rigid body, measured."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

from daebench.pages.report import Progress, make_page
from daebench.reports.poisson import body, casimirs, defects, lattice, methods, orbits
from daebench.reports.poisson.claims import check
from daebench.reports.poisson.figures import draw
from daebench.reports.poisson.numbers import Numbers, measure
from daebench.reports.poisson.tables import tables

CONSTANTS = SimpleNamespace(
    ORBITS=orbits,
    DEFECTS=defects,
    CASIMIRS=casimirs,
    LATTICE=lattice,
    BODY=body,
    METHODS=methods,
)


def make(out: Path, progress: Progress) -> Path:
    """Make the report in a folder; return the path of its page, see :func:`daebench.pages.report.make_page`."""

    def content(numbers: Numbers, _: SimpleNamespace) -> dict[str, Any]:
        return {
            "c": CONSTANTS,
            "drawn": draw(numbers, out / "figures"),
            "tables": tables(numbers, out / "tables"),
            "sizes": numbers.sizes,
            "speeds": numbers.speeds,
        }

    return make_page("poisson/page.html", out, "daebench report poisson", progress, measure=measure, check=check, content=content)
