"""Why index reduction breaks symplecticity: HLW Figs. 1.1 and 1.2, defects, drifts, and IDA's accuracy, measured."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd

from daebench.pages.report import Progress, exact_motion, make_page
from daebench.reports.index_reduction import figures, ida
from daebench.reports.index_reduction import numbers as _index_reduction_numbers
from daebench.reports.index_reduction.claims import check
from daebench.reports.index_reduction.figures import NAMES, draw, label
from daebench.reports.index_reduction.ida import measure_ida
from daebench.reports.index_reduction.numbers import Numbers, measure
from daebench.reports.index_reduction.tables import tables

CONSTANTS = SimpleNamespace(
    **{name: value for name, value in vars(_index_reduction_numbers).items() if name.isupper()},
    DIGITS=exact_motion.DIGITS,
    IDA_T_END=ida.T_END,
    IDA_POINTS=ida.POINTS,
    WINDOW=figures.WINDOW,
)


def make(out: Path, progress: Progress) -> Path:
    """Make the report in a folder; return the path of its page, see :func:`daebench.pages.report.make_page`."""

    def content(numbers: tuple[Numbers, pd.DataFrame], facts: SimpleNamespace) -> dict[str, Any]:
        return {
            "c": CONSTANTS,
            "drawn": draw(*numbers, out / "figures"),
            "tables": tables(*numbers, out / "tables"),
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
        measure=both,
        check=lambda numbers: check(*numbers),
        content=content,
    )


def both(progress: Progress) -> tuple[Numbers, pd.DataFrame]:
    """Return the numbers of the fixed-step schemes and those of IDA."""
    numbers = measure(lambda fraction, doing: progress(0.8 * fraction, doing))
    return numbers, measure_ida(lambda fraction, doing: progress(0.8 + 0.2 * fraction, doing))
