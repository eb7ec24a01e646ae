"""What became of a run, in one word, by the size of its error; the trend of its energy is told apart."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from daebench.diagnostics.branch import WRONG
from daebench.diagnostics.manifold import residual_scales
from daebench.methods.fixed_step.stepping import REASONS
from daebench.runs.ivp import PoissonIvp
from daebench.studies.grid.measure import Row
from daebench.studies.grid.rows import rows_of
from daebench.studies.grid.run_specification import GridRun
from daebench.studies.grid.runs import Runs

if TYPE_CHECKING:
    import pandas as pd

FINE, COARSE, LOST, OFF, OTHER = "fine", "coarse", "lost", "off the manifold", "wrong branch"
NO_SOLUTION, SINGULAR, RANK_LOST, BLOWN_UP, STOPPED = "no solution", "singular", "rank lost", "blown up", "stopped"

OUTCOMES = {
    FINE: "it came to its end, on the manifold, and its energy error is at most a tenth of the mean kinetic energy",
    COARSE: "its energy error is more than a tenth of that",
    LOST: "its energy error is more than all of that",
    OFF: "it left the manifold by more than a thousandth of what a change of all positions by one part would do",
    OTHER: "a step ended far from where the velocities lead: Newton's iteration found another solution than that of the motion",
    NO_SOLUTION: "the equations of a step have no solution that Newton's iteration finds",
    SINGULAR: "their matrix is singular",
    RANK_LOST: "G loses rank on its way",
    BLOWN_UP: "a number is no longer finite",
    STOPPED: "it was stopped by something else, as a solver that gives up",
}
"""What became of a run, from the best to the worst, and what that says; whether its energy drifts is another matter."""

SIZED = (FINE, COARSE, LOST)
"""What became of runs that came to their end on the manifold: words for the size of their energy error."""

LARGE, ALL = 0.1, 1.0
"""Sizes of an energy error above which it is large, and above which the motion is lost."""

FAR = 1e-3
"""Relative residual of constraints from which on a state is off the manifold."""

TOLD = {
    "G loses rank": RANK_LOST,
    **{REASONS[status][0].split(" in {")[0].split(", residual")[0]: NO_SOLUTION for status in (1, 5)},
    REASONS[2][0].split(", residual")[0]: SINGULAR,
    **{REASONS[status][0].split(", or did")[0]: BLOWN_UP for status in (3, 4, 8)},
}
"""What the sentence of a failure begins its reason with, and the word for it."""


def varied_runs(specifications: Sequence[GridRun], parameter: str, runs: Runs) -> "pd.DataFrame":
    """Return the rows of runs in which a parameter is varied, with more columns: "outcome", "size", "trend", "parameter", "varied".

    The trend is the verdict on the energy, "" of a run that did not come to its end on the manifold; varied is the parameter's value.
    """
    table = runs(specifications)
    rows = rows_of(table)
    outcomes = [outcome_of(specification, row) for specification, row in zip(specifications, rows, strict=True)]
    trends = [str(row["energy_verdict"]) if word in SIZED else "" for word, row in zip(outcomes, rows, strict=True)]
    more: dict[str, Any] = {
        "size": [size_of(row) for row in rows],
        "trend": trends,
        "varied": [dict(specification.parameters)[parameter] for specification in specifications],
    }
    return table.assign(outcome=outcomes, parameter=parameter, **more)


def size_of(row: Row) -> float:
    """Return the energy error over the mean kinetic energy, or over the energy's scale where that is not known."""
    size = float(row.get("energy_size", float("nan")))
    return size if math.isfinite(size) else float(row["energy_error"] / row["energy_scale"])


def outcome_of(specification: GridRun, row: Row) -> str:
    """Return which of :data:`OUTCOMES` a row tells of.

    Of the metrics it needs "energy", and on a constrained problem "manifold"; "jump" where the other branch is to be told.
    """
    if row["failure"]:
        return next((word for text, word in TOLD.items() if text in row["failure"]), STOPPED)
    ivp = specification.ivp
    if not isinstance(ivp, PoissonIvp):
        scale = residual_scales(ivp, ivp.p0, ivp.q0)[0]
        if not row["g"] <= FAR * (scale or 1.0):
            return OFF
    if row.get("jump", 0.0) > WRONG:
        return OTHER
    size = size_of(row)
    return LOST if not size <= ALL else COARSE if size > LARGE else FINE
