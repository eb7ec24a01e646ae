"""Why index reduction breaks symplecticity: HLW Figs. 1.1 and 1.2, defects, drifts, and IDA's accuracy, measured."""

import time
from pathlib import Path
from types import SimpleNamespace

from daebench.report import Progress, picture, write_page
from daebench.reports import _exact_motion, _index_reduction_figures, _index_reduction_ida, _index_reduction_numbers
from daebench.reports._index_reduction_claims import check
from daebench.reports._index_reduction_figures import NAMES, draw, label
from daebench.reports._index_reduction_ida import measure_ida
from daebench.reports._index_reduction_numbers import measure
from daebench.reports._index_reduction_tables import tables

COMMAND = "daebench report index-reduction"

CONSTANTS = SimpleNamespace(
    **{name: value for name, value in vars(_index_reduction_numbers).items() if name.isupper()},
    DIGITS=_exact_motion.DIGITS,
    IDA_T_END=_index_reduction_ida.T_END,
    IDA_POINTS=_index_reduction_ida.POINTS,
    WINDOW=_index_reduction_figures.WINDOW,
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
    numbers = measure(lambda fraction, doing: progress(0.75 * fraction, doing))
    ida = measure_ida(lambda fraction, doing: progress(0.75 + 0.15 * fraction, doing))
    found = check(numbers, ida)
    progress(0.9, "figures")
    drawn = draw(numbers, ida, out / "figures")
    content = vars(found) | {
        "c": CONSTANTS,
        "drawn": drawn,
        "picture": picture,
        "tables": tables(numbers, ida, out / "tables"),
        "label": label,
        "kept_names": [
            "its adjoint" if name == "symplectic_euler_adjoint" else NAMES[name].removeprefix("constrained ") for name in found.kept
        ],
        "useless_names": [label(name) for name in found.ida.useless["formulation"].unique()],
        "took": time.perf_counter() - began,
    }
    page = write_page("index_reduction.html", out / "index.html", COMMAND, **content)
    progress(1.0, "done")
    return page
