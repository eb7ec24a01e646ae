"""Why index reduction breaks symplecticity: HLW Figs. 1.1 and 1.2, defects, drifts, and IDA's accuracy, measured."""

import time
from pathlib import Path
from types import SimpleNamespace

from daebench.report import Progress, picture, write_page
from daebench.reports import _exact_motion, _index_reduction_ida, _index_reduction_numbers
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
)

CAPTIONS = {
    "energy": (
        "<b>Energy error</b>, HLW Fig. 1.1 (upper row) and two schemes for the constrained system (lower row). Each panel has its own scale. "
        "Dashed: the least-squares line.",
        "Four curves of energy error against time: with se a straight rising line, with seproj an oscillation about a rising line, "
        "with constrained symplectic Euler and RATTLE oscillations about level lines.",
    ),
    "drift": (
        f"<b>The same runs on common scales</b>: the largest energy error and the largest distance from the manifold in windows of "
        f"{_index_reduction_numbers.T_END / 33:.0f} units of time. Distances below 10<sup>−17</sup> are drawn there.",
        "Left, energy errors on a logarithmic scale: se and seproj rise, constrained symplectic Euler and RATTLE are level. "
        "Right, distances from the manifold: se rises, the other three stay at round-off.",
    ),
    "swing": (
        "<b>Height and energy</b>, HLW Fig. 1.2: the same start and the same step size with symplectic and with implicit Euler, both on the constraint.",
        "With symplectic Euler the height oscillates evenly and the energy is a level line; with implicit Euler the swings become "
        "slower and lower and the energy decays.",
    ),
    "symplecticity": (
        "<b>Symplecticity defect</b> after <i>n</i> steps of 0.03 from the start of Fig. 1.1. In <code>se</code> it appears with the second step.",
        "Defect against number of steps on a logarithmic scale: se starts at round-off and jumps up at the second step; seproj and implicit "
        "Euler are above it from the first step; four schemes stay at round-off.",
    ),
    "ida": (
        "<b>IDA</b>: tolerance asked for, relative and absolute, against the largest position error up to t = 10.",
        "Error against tolerance on logarithmic scales, one panel a case: all curves lie above the diagonal, those of index 3 furthest.",
    ),
}


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
    figures = {stem: picture(path, CAPTIONS[stem][1], CAPTIONS[stem][0]) for stem, path in drawn.items()}
    content = vars(found) | {
        "c": CONSTANTS,
        "figures": figures,
        "tables": tables(numbers, ida, out / "tables"),
        "label": label,
        "kept_names": [NAMES[name].replace("constrained ", "") for name in found.kept],
        "useless_names": [label(name) for name in found.ida.useless["formulation"].unique()],
        "took": time.perf_counter() - began,
    }
    page = write_page("index_reduction.html", out / "index.html", COMMAND, **content)
    progress(1.0, "done")
    return page
