"""Why index reduction breaks symplecticity: HLW Figs. 1.1 and 1.2, defects, drifts, and IDA's accuracy, measured."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd

from daebench.draw.figures import drawing
from daebench.pages.report import Progress, exact_motion, make_page
from daebench.reports._two_motions import BEGUN, TORUS
from daebench.reports.index_reduction import figures, ida
from daebench.reports.index_reduction import numbers as _index_reduction_numbers
from daebench.reports.index_reduction.claims import check
from daebench.reports.index_reduction.figures import NAMES, draw, label
from daebench.reports.index_reduction.ida import measure_ida
from daebench.reports.index_reduction.numbers import Numbers, measure
from daebench.reports.index_reduction.tables import tables
from daebench.reports.index_reduction.two_form import Carried, check_two_form, draw_two_form, measure_two_form
from daebench.reports.index_reduction.two_motions import Both, check_motions, measure_motions
from daebench.reports.index_reduction.two_motions_figure import draw_motions, write_lead

CONSTANTS = SimpleNamespace(
    **{name: value for name, value in vars(_index_reduction_numbers).items() if name.isupper()},
    DIGITS=exact_motion.DIGITS,
    IDA_T_END=ida.T_END,
    IDA_POINTS=ida.POINTS,
    WINDOW=figures.WINDOW,
    TORUS=TORUS,
    BEGUN=BEGUN,
)


Measured = tuple[Numbers, pd.DataFrame, Both, dict[str, Carried]]


def make(out: Path, progress: Progress) -> Path:
    """Make the report in a folder; return the path of its page, see :func:`daebench.pages.report.make_page`."""

    def content(numbers: Measured, facts: SimpleNamespace) -> dict[str, Any]:
        schemes, formulations, motions, carried = numbers
        write_lead(facts.motions, out)
        with drawing():
            pictures = [draw_motions(motions, facts.motions, out / "figures"), draw_two_form(carried, out / "figures")]
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
    schemes, formulations, motions, carried = numbers
    return SimpleNamespace(motions=check_motions(motions), why=check_two_form(carried), **vars(check(schemes, formulations)))


def everything(progress: Progress) -> Measured:
    """Return the numbers of the fixed-step schemes, of IDA, of two motions, and of the two-form."""
    numbers = measure(lambda fraction, doing: progress(0.75 * fraction, doing))
    formulations = measure_ida(lambda fraction, doing: progress(0.75 + 0.2 * fraction, doing))
    progress(0.95, "two motions, and why")
    return numbers, formulations, measure_motions(), measure_two_form()
