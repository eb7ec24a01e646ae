"""Rolling without slipping: which methods keep the energy on which class of nonholonomic problems, and what the constraint costs."""

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
from daebench.reports.nonholonomic import classes, cost, levels, motions, rates, sleigh

CONSTANTS = constants(sleigh, motions, classes, rates, levels, cost)


def make(out: Path, progress: Progress) -> Path:
    """Make the report in a folder; return the path of its page, see :func:`daebench.pages.report.page.make_report`."""
    return make_report("nonholonomic", out, progress, measure, check, draw, tables, c=CONSTANTS)


@dataclass(frozen=True)
class Numbers:
    """The measurements of the report."""

    runs: pd.DataFrame
    series: pd.DataFrame
    """Verdicts on long runs, one row a motion and method; their energy errors over time."""
    rates: pd.DataFrame
    """Rates by transmission, scheme and step."""
    levels: pd.DataFrame
    levels_series: pd.DataFrame
    """IDA by formulation and tolerance; the distance from the constraint over time."""
    sleigh: pd.DataFrame
    """The sleigh, one row a method."""
    cost: pd.DataFrame
    """Errors and evaluations by method and step or tolerance."""


def measure(tell: Progress) -> Numbers:
    """Return the numbers; ``tell`` receives the fraction done and a description of the finished work."""
    long = [(*motion, name) for name in reversed(motions.METHODS) for motion in motions.MOTIONS]
    queue: list[Job] = [
        (cost.errors, ()),
        *((levels.by_level, (name,)) for name in motions.SOLVERS),
        *((motions.long_run, run) for run in long),
    ]
    queue += [(rates.rates, (case, name)) for case in rates.CASES for name in motions.SCHEMES]
    queue += [(sleigh.sleigh, (name,)) for name in motions.METHODS]
    results = dict(computed(queue, tell, "runs"))
    rows, series = zip(*(results[motions.long_run, run] for run in reversed(long)), strict=True)
    away, over_time = zip(*(results[levels.by_level, (name,)] for name in motions.SOLVERS), strict=True)
    return Numbers(
        runs=pd.DataFrame(rows),
        series=pd.concat(series, ignore_index=True),
        rates=pd.concat([results[job] for job in queue if job[0] == rates.rates], ignore_index=True),
        levels=pd.concat(away, ignore_index=True),
        levels_series=pd.concat(over_time, ignore_index=True),
        sleigh=pd.DataFrame([results[sleigh.sleigh, (name,)] for name in motions.METHODS]),
        cost=results[cost.errors, ()],
    )


def check(numbers: Numbers) -> SimpleNamespace:
    """Return the numbers of the text; the first sentence that does not hold raises ClaimRefuted."""
    return SimpleNamespace(
        classes=classes.check_classes(numbers.runs),
        rates=rates.check_rates(numbers.rates),
        levels=levels.check_levels(numbers.levels, numbers.levels_series),
        sleigh=sleigh.check_sleigh(numbers.sleigh),
        cost=cost.check_cost(numbers.cost),
    )


def draw(numbers: Numbers, findings: SimpleNamespace, folder: Path) -> Iterator[Path]:
    """Draw all figures into a folder, and give the paths of the SVG files."""
    yield classes.draw_energy(numbers.series, folder)
    yield rates.draw_rates(numbers.rates, folder)
    yield levels.draw_levels(numbers.levels_series, folder)
    yield cost.draw_cost(numbers.cost, folder)
    yield draw_thumbnail(folder, lambda axis: classes.thumbnail(axis, numbers.series))


def tables(numbers: Numbers, findings: SimpleNamespace) -> Mapping[str, Table | pd.DataFrame]:
    """Return the tables."""
    return {
        "classes": classes.table(numbers.runs),
        "rates": numbers.rates,
        "levels": levels.table(numbers.levels),
        "sleigh": sleigh.table(numbers.sleigh),
        "cost": cost.table(findings.cost.prices),
    }
