"""Poisson systems and their integrators: HLW Fig. 4.1, Poisson defects, Casimir functions, a lattice and a rigid body, measured."""

import time
from pathlib import Path
from types import SimpleNamespace

from daebench.report import Progress, picture, write_page
from daebench.reports import _poisson_body, _poisson_casimirs, _poisson_defects, _poisson_lattice, _poisson_methods, _poisson_orbits
from daebench.reports._poisson_claims import check
from daebench.reports._poisson_figures import draw
from daebench.reports._poisson_numbers import measure
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
        "drawn": drawn,
        "picture": picture,
        "tables": tables(numbers, out / "tables"),
        "sizes": numbers.sizes,
        "speeds": numbers.speeds,
        "took": time.perf_counter() - began,
    }
    page = write_page("poisson.html", out / "index.html", COMMAND, **content)
    progress(1.0, "done")
    return page
