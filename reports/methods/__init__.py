"""Each method and its claims, measured: orders, two-form, symmetry, manifold, energy and work."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from types import SimpleNamespace

import pandas as pd

from daebench.pages.report import Progress
from daebench.pages.report.page import make_report
from daebench.pages.report.tables import Table
from daebench.pages.report.thumbnail import draw_thumbnail
from daebench.reports.methods import defects, families, guide, long_runs, matrix, reverse, signs, sweep
from daebench.reports.methods.measured import REPEATS, Numbers, measure
from daebench.studies.claims.bench import DEFECT_STEPS, ROUNDINGS

CONSTANTS = SimpleNamespace(
    SWEEP=sweep,
    DEFECTS=defects,
    LONG=long_runs,
    REVERSE=reverse,
    GUIDE=guide,
    TITLES=families.TITLES,
    ROUNDINGS=ROUNDINGS,
    DEFECT_STEPS=DEFECT_STEPS,
    REPEATS=REPEATS,
)


def make(out: Path, progress: Progress) -> Path:
    """Make the report in a folder; return the path of its page, see :func:`daebench.pages.report.page.make_report`."""
    return make_report("methods", out, progress, measure, check, draw, tables, c=CONSTANTS)


def check(numbers: Numbers) -> SimpleNamespace:
    """Return the numbers of the text; the first sentence that does not hold raises ClaimRefuted."""
    matrix.check_claims(numbers.claims)
    table = matrix.matrix(numbers.claims)
    return SimpleNamespace(
        table=table,
        tally=matrix.tally(numbers.claims, table),
        orders=sweep.check_orders(numbers.orders, table),
        defects=defects.check_defects(defects.powers(numbers.defects)),
        long=long_runs.check_long(numbers.drift, table),
        reverse=reverse.reverse(numbers.reverse),
        work=sweep.check_work(numbers.work),
        guide=guide.guide(numbers, table),
    )


def draw(numbers: Numbers, findings: SimpleNamespace, folder: Path) -> Iterator[Path]:
    """Draw all figures into a folder, and give the paths of the SVG files."""
    rows = signs.rows_of(findings.table, numbers.ida, numbers.drift)
    yield signs.draw_main(rows, folder)
    yield signs.draw_matrix(rows, folder)
    yield sweep.draw_orders(numbers.points, folder)
    yield defects.draw_defects(numbers.defects, folder)
    yield long_runs.draw_long(numbers.energy, folder)
    yield signs.draw_work(numbers.work, folder)
    yield draw_thumbnail(folder, lambda axis: signs.draw_few(axis, rows))


def tables(numbers: Numbers, findings: SimpleNamespace) -> Mapping[str, Table | pd.DataFrame]:
    """Return the tables."""
    return {
        "methods": matrix.methods_table(findings.table, numbers.drift),
        "sources": Table(findings.table, matrix.SOURCES, {}),
        "claims": numbers.claims,
        "orders": numbers.orders,
        "powers": defects.powers_table(defects.powers(numbers.defects)),
        "long": Table(numbers.drift, long_runs.COLUMNS),
        "work": Table(numbers.work, sweep.WORK_COLUMNS),
        "ida": Table(numbers.ida, sweep.IDA_COLUMNS),
        "reverse": numbers.reverse,
    }
