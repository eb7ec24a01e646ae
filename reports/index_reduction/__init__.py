"""Why index reduction breaks symplecticity: HLW Figs. 1.1 and 1.2, defects, drifts, and IDA's accuracy, measured."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd

from daebench.pages.report import Progress, exact_motion
from daebench.pages.report.page import make_report
from daebench.pages.report.tables import Table
from daebench.pages.report.thumbnail import draw_thumbnail
from daebench.reports.index_reduction import drift_and_swing, ida, schemes
from daebench.reports.index_reduction.ida import check_ida, label, measure_ida
from daebench.reports.index_reduction.schemes import NAMES, Numbers, measure
from daebench.reports.index_reduction.two_form import Carried, check_two_form, draw_two_form, measure_two_form
from daebench.reports.index_reduction.two_motions import BEGUN, TORUS, Both, check_motions, measure_motions
from daebench.reports.index_reduction.two_motions_figure import draw_motions, write_lead

CONSTANTS = SimpleNamespace(
    **{name: value for name, value in vars(schemes).items() if name.isupper()},
    DIGITS=exact_motion.DIGITS,
    IDA_T_END=ida.T_END,
    IDA_POINTS=ida.POINTS,
    WINDOW=drift_and_swing.WINDOW,
    TORUS=TORUS,
    BEGUN=BEGUN,
)

Measured = tuple[Numbers, pd.DataFrame, Both, dict[str, Carried]]


def make(out: Path, progress: Progress) -> Path:
    """Make the report in a folder; return the path of its page, see :func:`daebench.pages.report.page.make_report`."""
    return make_report("index-reduction", out, progress, everything, check_everything, draw, tables, c=CONSTANTS, label=label)


def check_everything(numbers: Measured) -> SimpleNamespace:
    """Return the numbers of the text; the first claim that does not hold raises ClaimRefuted."""
    measured, formulations, motions, carried = numbers
    return SimpleNamespace(motions=check_motions(motions), why=check_two_form(carried), **vars(check(measured, formulations)))


def everything(progress: Progress) -> Measured:
    """Return the numbers of the fixed-step schemes, of IDA, of two motions, and of the two-form."""
    numbers = measure(lambda fraction, doing: progress(0.75 * fraction, doing))
    formulations = measure_ida(lambda fraction, doing: progress(0.75 + 0.2 * fraction, doing))
    progress(0.95, "two motions, and why")
    return numbers, formulations, measure_motions(), measure_two_form()


def check(numbers: Numbers, formulations: pd.DataFrame) -> SimpleNamespace:
    """Return the numbers of the text; the first sentence that does not hold raises ClaimRefuted."""
    table = numbers.table.set_index("method")
    schemes.check_symplecticity(numbers, table)
    schemes.check_table(table)
    return SimpleNamespace(
        drift=drift_and_swing.check_drift(numbers, table),
        swing=drift_and_swing.check_swing(numbers),
        ida=check_ida(formulations),
        **texts(numbers, table),
    )


def texts(numbers: Numbers, table: pd.DataFrame) -> dict[str, Any]:
    """Return numbers that the text needs and that no claim tests."""
    symplectic_names = [str(name) for name, claim in table["claimed_symplectic"].items() if claim]
    return {
        "row": {str(name): row for name, row in table.iterrows()},
        "first_step": {name: numbers.defects[name][0] for name in table.index},
        "second_step": numbers.defects["se"][1],
        "kept": symplectic_names,
        "kept_names": [
            "its adjoint" if name.endswith("_adjoint") else NAMES[name].removeprefix("constrained ") for name in symplectic_names
        ],
        "kept_most": float(numbers.defects[symplectic_names].max().max()),
    }


def draw(numbers: Measured, findings: SimpleNamespace, folder: Path) -> Iterator[Path]:
    """Draw all figures into a folder, and give the paths of the SVG files."""
    measured, formulations, motions, carried = numbers
    write_lead(findings.motions, folder.parent)
    yield draw_motions(motions, findings.motions, folder)
    yield draw_two_form(carried, folder)
    yield drift_and_swing.draw_energy(measured, folder)
    yield drift_and_swing.draw_together(measured, folder)
    yield drift_and_swing.draw_swing(measured.swing, folder)
    yield schemes.draw_defects(measured.defects, folder)
    yield ida.draw_ida(formulations, folder)
    yield draw_thumbnail(folder, lambda axis: drift_and_swing.thumbnail(axis, measured))


def tables(numbers: Measured, findings: SimpleNamespace) -> Mapping[str, Table | pd.DataFrame]:
    """Return the tables."""
    measured, formulations, *_ = numbers
    return {
        "schemes": measured.table,
        "orders": measured.errors,
        "structure": Table(measured.table, schemes.STRUCTURE, {}),
        "drift": Table(measured.table, drift_and_swing.DRIFT, {}),
        "cost": Table(measured.table, schemes.COST, {}),
        "ida": ida.ida_table(formulations),
    }
