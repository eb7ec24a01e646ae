"""Poisson systems and their integrators: HLW Fig. 4.1, Poisson defects, Casimir functions, a lattice and a rigid body, measured."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

from daebench.report import Progress, make_page
from daebench.reports import _poisson_body, _poisson_casimirs, _poisson_defects, _poisson_lattice, _poisson_methods, _poisson_orbits
from daebench.reports._poisson_claims import check
from daebench.reports._poisson_figures import draw
from daebench.reports._poisson_numbers import Numbers, measure
from daebench.reports._poisson_tables import tables

COMMAND = "daebench report poisson"

CONSTANTS = SimpleNamespace(
    ORBITS=_poisson_orbits,
    DEFECTS=_poisson_defects,
    CASIMIRS=_poisson_casimirs,
    LATTICE=_poisson_lattice,
    BODY=_poisson_body,
    METHODS=_poisson_methods,
)


def make(out: Path, progress: Progress) -> Path:
    """Make the report in a folder; return the path of its page, see :func:`daebench.report.make_page`."""

    def content(numbers: Numbers, _: SimpleNamespace) -> dict[str, Any]:
        return {
            "c": CONSTANTS,
            "drawn": draw(numbers, out / "figures"),
            "tables": tables(numbers, out / "tables"),
            "sizes": numbers.sizes,
            "speeds": numbers.speeds,
        }

    return make_page("poisson.html", out, COMMAND, progress, measure=measure, check=check, content=content)
