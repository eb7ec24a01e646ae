"""Poisson systems and their integrators: HLW Fig. 4.1, Poisson defects, Casimir functions, a lattice and a rigid body, measured."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd

from daebench.pages.report import Progress
from daebench.pages.report.page import make_report
from daebench.pages.report.tables import Table
from daebench.pages.report.thumbnail import draw_thumbnail
from daebench.pages.report.two_processes import Job, computed
from daebench.reports.poisson import body, casimirs, defects, lattice, methods, orbits

CONSTANTS = SimpleNamespace(ORBITS=orbits, DEFECTS=defects, CASIMIRS=casimirs, LATTICE=lattice, BODY=body, METHODS=methods)


def make(out: Path, progress: Progress) -> Path:
    """Make the report in a folder; return the path of its page, see :func:`daebench.pages.report.page.make_report`."""
    return make_report("poisson", out, progress, measure, check, draw, tables, c=CONSTANTS)


@dataclass(frozen=True)
class Numbers:
    """The measurements of the report."""

    orbits: orbits.Orbits
    """Fig. 4.1."""
    defects: pd.DataFrame
    lemma: pd.DataFrame
    """Poisson defects by method and h; both defects of constrained methods."""
    casimirs: pd.DataFrame
    casimir_series: pd.DataFrame
    break_off: pd.DataFrame
    """One row per system and method; errors over time; where runs on the three species break off."""
    lattice: pd.DataFrame
    lattice_series: pd.DataFrame
    cost: pd.DataFrame
    """One row per method; errors over time; time of a step per site."""
    sizes: Mapping[str, float]
    """Energy and integrals of the lattice at the start."""
    speeds: Mapping[str, float]
    """Speed of the lattice at the start, and the speed that one part alone would give it."""
    body: pd.DataFrame
    trajectories: pd.DataFrame
    polhodes: pd.DataFrame
    """One row per method; states of runs with a large step; the exact curves."""
    methods: pd.DataFrame
    """The closing table."""


def jobs() -> list[Job]:
    """Return the measurements, the most expensive first, so that both cores finish at about the same time."""
    queue: list[Job] = [(lattice.invariants, (name,)) for name in lattice.METHODS]
    queue += [(lattice.invariants, ("strang", lattice.FINE)), *((lattice.cost, (sites,)) for sites in reversed(lattice.SIZES))]
    queue += [(methods.summary, (name,)) for name in methods.METHODS]
    queue += [(casimirs.casimirs, (problem,)) for problem in casimirs.SYSTEMS]
    queue += [(body.body, (name,)) for name in body.METHODS] + [(body.trajectories, (name,)) for name in body.SHOWN]
    queue += [(defects.lemma, (name,)) for name in defects.CONSTRAINED] + [(defects.defects, (name,)) for name in defects.METHODS]
    return [*queue, *((casimirs.break_off, (name,)) for name in casimirs.METHODS)]


def measure(tell: Progress) -> Numbers:
    """Return the numbers; ``tell`` receives the fraction done and a description of the finished work."""
    job_results = dict(computed(jobs(), tell, "measured"))
    results: dict[Any, list[Any]] = {}
    for job in sorted(job_results, key=jobs().index):
        results.setdefault(job[0], []).append(job_results[job])
    tables, series = zip(*results[casimirs.casimirs], strict=True)
    rows, over_time = zip(*results[lattice.invariants], strict=True)
    return Numbers(
        orbits=orbits.orbits(),
        defects=pd.concat(results[defects.defects], ignore_index=True),
        lemma=pd.concat(results[defects.lemma], ignore_index=True),
        casimirs=pd.concat(tables, ignore_index=True),
        casimir_series=pd.concat(series, ignore_index=True),
        break_off=pd.DataFrame(results[casimirs.break_off]),
        lattice=pd.DataFrame(rows),
        lattice_series=pd.concat(over_time, ignore_index=True),
        cost=pd.DataFrame(results[lattice.cost]).sort_values("sites", ignore_index=True),
        sizes=lattice.sizes_of_integrals(),
        speeds=lattice.speeds(),
        body=pd.DataFrame(results[body.body]),
        trajectories=pd.concat(results[body.trajectories], ignore_index=True),
        polhodes=body.polhodes(),
        methods=pd.DataFrame(results[methods.summary]),
    )


def check(numbers: Numbers) -> SimpleNamespace:
    """Return the numbers of the text; the first sentence that does not hold raises ClaimRefuted."""
    return SimpleNamespace(
        orbits=orbits.check_orbits(numbers.orbits),
        defects=defects.check_defects(defects.slopes(numbers.defects).set_index("method")),
        lemma=defects.check_lemma(numbers.lemma),
        casimirs=casimirs.check_casimirs(numbers.casimirs, numbers.break_off),
        lattice=lattice.check_lattice(numbers.lattice, numbers.sizes, numbers.speeds, numbers.cost),
        body=body.check_body(numbers.body, numbers.trajectories),
        closing=methods.check_methods(numbers.methods),
    )


def draw(numbers: Numbers, findings: SimpleNamespace, folder: Path) -> Iterator[Path]:
    """Draw all figures into a folder, and give the paths of the SVG files."""
    yield orbits.draw_orbits(numbers.orbits, folder)
    yield orbits.draw_energy(numbers.orbits, folder)
    yield defects.draw_defects(numbers.defects, numbers.lemma, folder)
    yield casimirs.draw_casimirs(numbers.casimir_series, folder)
    yield lattice.draw_lattice(numbers.lattice_series, numbers.sizes, folder)
    yield body.draw_sphere(numbers.trajectories, numbers.polhodes, folder)
    yield draw_thumbnail(folder, lambda axis: orbits.draw_orbit(axis, numbers.orbits, "verlet"))


def tables(numbers: Numbers, findings: SimpleNamespace) -> Mapping[str, Table | pd.DataFrame]:
    """Return the tables."""
    return {
        "orbits": orbits.table(numbers.orbits.table),
        "slopes": defects.all_slopes(numbers.defects, numbers.lemma),
        "casimirs": casimirs.table(numbers.casimirs, numbers.break_off),
        "break_off": numbers.break_off,
        "lattice": Table(numbers.lattice.assign(us=numbers.lattice["ns"] / 1e3), lattice.COLUMNS, numbers.lattice),
        "cost": numbers.cost,
        "body": Table(numbers.body, body.COLUMNS),
        "methods": methods.table(numbers.methods),
    }
