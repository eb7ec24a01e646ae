"""The error of IDA against its tolerance, by formulation and treatment, with drift laws, costs, and an estimate of the error."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import pandas as pd

from daebench.pages.report import Progress
from daebench.pages.report.page import constants, make_report
from daebench.pages.report.tables import Table
from daebench.pages.report.thumbnail import draw_thumbnail
from daebench.pages.report.two_processes import Job, computed
from daebench.reports.index_reduction.ida import label
from daebench.reports.tolerances import accuracy, cost, drift, exact, projection, runs, treatments
from daebench.reports.tolerances.drift import RUNS, T_LONG, drift_run, laws
from daebench.reports.tolerances.runs import FAST, IVPS, REACHED, STARTS, exact_of, member

CONSTANTS = constants(accuracy, cost, drift, exact, runs)


def make(out: Path, progress: Progress) -> Path:
    """Make the report in a folder; return the path of its page, see :func:`daebench.pages.report.page.make_report`."""
    return make_report(
        "tolerances",
        out,
        progress,
        measure,
        check,
        draw,
        tables,
        c=CONSTANTS,
        p=constants(projection),
        label=label,
        ivps=IVPS,
        failures=treatments.sentences,
    )


LONG_PART = 0.85
"""Fraction of the work that is not timed."""


@dataclass(frozen=True)
class Numbers:
    """The measurements of the report."""

    runs: pd.DataFrame
    """One row per run to t = 10, see :func:`daebench.reports.tolerances.runs.row`, by problem, start, formulation, treatment and tolerance.
    """
    drift: pd.DataFrame
    """The long runs, one after the other: formulation, tol, t, g, energy, error."""
    laws: pd.DataFrame
    """Fitted powers of time: formulation, tol, quantity, exponent, error, factor, windows."""
    projected: pd.DataFrame
    """CVODE with projected steps and other methods, see :func:`daebench.reports.tolerances.projection.compared`."""
    example: pd.DataFrame
    """SUNDIALS' example of a projected pendulum, see :func:`daebench.reports.tolerances.projection.example`."""


def measure(tell: Progress) -> Numbers:
    """Return the numbers; ``tell`` receives the fraction done and a description of the finished work.

    The most expensive problems come first, so that both cores finish at about the same time. Timed runs come last, one at a time; what
    they run is compiled before.
    """
    members: list[Job] = [(member, (name, start)) for name in reversed(IVPS) for start in range(STARTS)]
    long: list[Job] = [(drift_run, run) for run in RUNS]
    kernels: list[Job] = [(projection.compiled, (name,)) for name in reversed(IVPS)]
    exact_of(FAST, T_LONG)  # a missing reference is found before anything is computed
    results = dict(computed([*kernels, *members, *long], lambda part, what: tell(LONG_PART * part, what), "measured"))
    in_order = sorted(members, key=lambda job: list(IVPS).index(job[1][0]))
    runs = pd.DataFrame([row for job in in_order for row in results[job][0]])
    drift = [results[job] for job in long]
    fitted = [row for run in drift for row in laws(run, exact_of(FAST, T_LONG).floor)]
    timed = []
    for k, name in enumerate(IVPS):
        tell(LONG_PART + (1 - LONG_PART) * k / len(IVPS), f"CVODE with projected steps, {IVPS[name]}")
        references = [results[member, (name, start)][1] for start in range(projection.STARTS)]
        paces = projection.paces(name)
        timed += [row for start, reference in enumerate(references) for row in projection.compared(name, start, reference, paces)]
    tell(1.0, "CVODE with projected steps, the example of SUNDIALS")
    frames = runs, pd.concat(drift, ignore_index=True), pd.DataFrame(fitted), pd.DataFrame(timed), pd.DataFrame(projection.example())
    return Numbers(*frames)


def check(numbers: Numbers) -> SimpleNamespace:
    """Return the numbers of the text; the first sentence that does not hold raises ClaimRefuted."""
    default = numbers.runs[numbers.runs["default"]]
    done, bands = default[default["end"] == REACHED], accuracy.typical(default)
    return SimpleNamespace(
        headline=accuracy.check_headline(default, done),
        tight=accuracy.check_tight(done[done["tol"] == accuracy.TIGHT], bands[bands["tol"] == accuracy.TIGHT]),
        luck=accuracy.luck(done, bands),
        floor=accuracy.check_floor(done),
        slopes=cost.slopes(bands),
        last=cost.last_decade(bands),
        treatments=treatments.check_treatments(numbers.runs[numbers.runs["start"] == 0]),
        cost=cost.check_cost(bands),
        estimate=cost.check_estimate(done),
        laws=drift.check_laws(numbers.laws),
        projected=projection.check_projected(numbers.projected),
        example=projection.check_example(numbers.example),
    )


def draw(numbers: Numbers, findings: SimpleNamespace, folder: Path) -> Iterator[Path]:
    """Draw all figures into a folder, and give the paths of the SVG files."""
    runs, bands = numbers.runs, accuracy.typical(numbers.runs[numbers.runs["default"]])
    yield accuracy.draw_accuracy(bands, folder)
    yield treatments.draw_treatments(runs[runs["start"] == 0], folder)
    yield drift.draw_drift(numbers.drift, numbers.laws, folder)
    yield cost.draw_cost(bands, folder)
    yield cost.draw_estimate(runs, folder)
    yield projection.draw_projected(numbers.projected, folder)
    yield draw_thumbnail(folder, lambda axis: accuracy.thumbnail(axis, bands))


def tables(numbers: Numbers, findings: SimpleNamespace) -> Mapping[str, Table | pd.DataFrame]:
    """Return the tables."""
    runs = numbers.runs
    return {
        "runs": runs,
        "laws": drift.laws_table(numbers.laws),
        "reached": accuracy.reached_table(accuracy.reached(runs[runs["default"]])),
        "ends": treatments.ends_table(treatments.ends(runs[runs["start"] == 0])),
        "projected": numbers.projected,
        "example": projection.example_table(numbers.example),
    }
