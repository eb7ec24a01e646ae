"""Why index reduction breaks symplecticity: HLW Figs. 1.1 and 1.2, defects, drifts, and IDA's accuracy, measured."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd

from daebench.draw.figures import drawing
from daebench.pages.report import Progress, exact_motion, make_page
from daebench.pages.report.index import MOVING
from daebench.reports.index_reduction import figures, ida, rods
from daebench.reports.index_reduction import numbers as _index_reduction_numbers
from daebench.reports.index_reduction.claims import check
from daebench.reports.index_reduction.figures import NAMES, draw, label
from daebench.reports.index_reduction.ida import measure_ida
from daebench.reports.index_reduction.numbers import Numbers, measure
from daebench.reports.index_reduction.rods import Held, check_rods, measure_rods
from daebench.reports.index_reduction.rods_figure import draw_rods
from daebench.reports.index_reduction.rods_moving import write_moving
from daebench.reports.index_reduction.tables import tables
from daebench.reports.index_reduction.two_form import Carried, check_two_form, draw_two_form, measure_two_form

CONSTANTS = SimpleNamespace(
    **{name: value for name, value in vars(_index_reduction_numbers).items() if name.isupper()},
    DIGITS=exact_motion.DIGITS,
    IDA_T_END=ida.T_END,
    IDA_POINTS=ida.POINTS,
    WINDOW=figures.WINDOW,
    RODS_H=rods.H,
)


Measured = tuple[Numbers, pd.DataFrame, dict[str, Held], dict[str, Carried]]


def make(out: Path, progress: Progress) -> Path:
    """Make the report in a folder; return the path of its page, see :func:`daebench.pages.report.make_page`."""

    def content(numbers: Measured, facts: SimpleNamespace) -> dict[str, Any]:
        schemes, formulations, held, carried = numbers
        write_moving(held, facts.rods, out / MOVING)
        with drawing():
            pictures = [draw_rods(held, facts.rods, out / "figures"), draw_two_form(carried, out / "figures")]
        return {
            "c": CONSTANTS,
            "drawn": draw(schemes, formulations, out / "figures") | {picture.stem: picture for picture in pictures},
            "tables": tables(schemes, formulations, out / "tables"),
            "label": label,
            "kept_names": [
                "its adjoint" if name == "symplectic_euler_adjoint" else NAMES[name].removeprefix("constrained ") for name in facts.kept
            ],
            "useless_names": [label(name) for name in facts.ida.useless["formulation"].unique()],
        }

    return make_page(
        "index_reduction/page.html",
        out,
        "daebench report index-reduction",
        progress,
        measure=everything,
        check=check_everything,
        content=content,
    )


def check_everything(numbers: Measured) -> SimpleNamespace:
    """Return the numbers of the text; the first claim that does not hold raises ClaimRefuted."""
    schemes, formulations, held, carried = numbers
    return SimpleNamespace(rods=check_rods(held), why=check_two_form(carried), **vars(check(schemes, formulations)))


def everything(progress: Progress) -> Measured:
    """Return the numbers of the fixed-step schemes, of IDA, of three ways to hold the rod, and of the two-form."""
    numbers = measure(lambda fraction, doing: progress(0.75 * fraction, doing))
    formulations = measure_ida(lambda fraction, doing: progress(0.75 + 0.2 * fraction, doing))
    progress(0.95, "three ways to hold the rod, and why")
    return numbers, formulations, measure_rods(), measure_two_form()
