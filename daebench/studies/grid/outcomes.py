"""The outcome of a run in one word, by the size of its error; the trend of its energy is separate."""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.diagnostics.branch import WRONG
from daebench.diagnostics.manifold import residual_scales
from daebench.diagnostics.rank import TOO_LARGE
from daebench.errors import DaebenchError
from daebench.methods.fixed_step.reasons import REASONS
from daebench.runs.ivp import Array
from daebench.schemes.kernels.branch import ANOTHER_BRANCH
from daebench.studies.grid.run_specification import GridRun, ParameterRuns, ivp_of
from daebench.studies.grid.runs import Runs
from daebench.systems.lazily import pandas as pd

FINE, COARSE, LOST, OFF, OTHER = "fine", "coarse", "lost", "off the manifold", "wrong branch"
NO_SOLUTION, SINGULAR, RANK_LOST, BLOWN_UP, STOPPED = "no solution", "singular", "rank lost", "blown up", "stopped"

OUTCOMES = {
    FINE: "it reached its end, on the manifold, and its energy error is at most a tenth of the mean kinetic energy",
    COARSE: "its energy error is more than a tenth of that",
    LOST: "its energy error is more than all of that",
    OFF: "|g| is more than the change that moving every coordinate by 0.1 % causes",
    OTHER: "a step ended far from where the velocities lead: it is too large, or Newton's iteration found another solution",
    NO_SOLUTION: "the equations of a step have no solution that Newton's iteration finds",
    SINGULAR: "their matrix is singular",
    RANK_LOST: "G loses rank on its way",
    BLOWN_UP: "a number is no longer finite",
    STOPPED: "it was stopped for another reason, for example by a solver that gives up",
}
"""What became of a run, from the best to the worst, and what that says; whether its energy drifts is another matter."""

SIZED = (FINE, COARSE, LOST)
"""What became of runs that came to their end on the manifold: words for the size of their energy error."""

LARGE, ALL = 0.1, 1.0
"""Sizes of an energy error above which it is large, and above which the motion is lost."""

FAR = 1e-3
"""Relative residual of constraints from which on a state is off the manifold."""

COLUMNS = (
    "problem",
    "case",
    "method",
    "value",
    "parameter",
    "varied",
    "steps",
    "failure",
    "energy_error",
    "energy_size",
    "energy_scale",
    "energy_verdict",
    "g",
    "jump",
    "outcome",
    "size",
    "trend",
)
"""Columns of a table of runs in a parameter."""

ENERGY = ("energy_size", "energy_error", "energy_scale")
"""Columns that the size of the energy error is taken from."""

TOLD = {
    "G loses rank": RANK_LOST,
    TOO_LARGE: SINGULAR,
    **{REASONS[status][0].split(" in {")[0].split(", residual")[0]: NO_SOLUTION for status in (1, 5)},
    REASONS[2][0].split(", residual")[0]: SINGULAR,
    REASONS[ANOTHER_BRANCH][0]: OTHER,
    **{REASONS[status][0].split(", or did")[0]: BLOWN_UP for status in (3, 4, 8)},
}
"""What the sentence of a failure begins its reason with, and the word for it."""


def varied_runs(specifications: Sequence[GridRun], parameter: str, runs: Runs) -> "pd.DataFrame":
    """Return the rows of runs in which a parameter is varied, with more columns: "outcome", "size", "trend", "parameter", "varied".

    The trend is the verdict on the energy, "" of a run that did not come to its end on the manifold; varied is the parameter's value.
    """
    table = runs(specifications)
    varied = [dict(specification.parameters)[parameter] for specification in specifications]
    scales = [_scale(specification.problem, specification.case, specification.parameters) for specification in specifications]
    return _judged(table.assign(parameter=parameter, varied=varied), scales)


def parameter_table(specifications: Sequence[ParameterRuns], runs: Runs) -> "pd.DataFrame":
    """Return the same of runs in a parameter, a row each, with :data:`COLUMNS` alone."""
    parts: dict[str, list[Any]] = {name: [] for name in COLUMNS[:-3]}
    scales: list[float] = []
    columns = {name: column.tolist() for name, column in runs(specifications).items()}
    for k, some in enumerate(specifications):
        common = {"problem": some.problem, "case": some.case, "method": some.method, "value": some.value, "parameter": some.varied}
        for name, part in parts.items():
            part += [common[name]] * some.count if name in common else some.values if name == "varied" else _column(columns, name, k, some)
        scales += [_scale(some.problem, some.case, ((some.varied, value),)) for value in some.values]
    return _judged(pd.DataFrame(parts), scales)[list(COLUMNS)]


def _column(columns: Mapping[Any, list[Any]], name: str, k: int, some: ParameterRuns) -> list[Any]:
    return list(columns[name][k]) if name in some.columns else [float("nan")] * some.count


def _judged(table: "pd.DataFrame", scales: Sequence[float]) -> "pd.DataFrame":
    """Return a table with the columns "outcome", "size" and "trend"."""
    outcomes, sizes = outcomes_of(table, np.array(scales)), sizes_of(table)
    return table.assign(outcome=outcomes, size=sizes, trend=np.where(np.isin(outcomes, SIZED), table["energy_verdict"], ""))


def sizes_of(rows: "Mapping[str, Any] | pd.DataFrame") -> Array:
    """Return energy errors over mean kinetic energies, or over the energies' scales where those are not known, shape(n,)."""
    size, error, scale = (np.asarray(rows[name], dtype=float) for name in ENERGY)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(np.isfinite(size), size, error / scale)


def outcomes_of(rows: "Mapping[str, Any] | pd.DataFrame", scales: Array) -> NDArray[Any]:
    """Return which of :data:`OUTCOMES` each row tells of, shape(n,)."""
    failures = np.asarray(rows["failure"], dtype=object)
    words = np.array([word_of(failure) for failure in failures], dtype=object)
    size, nothing = sizes_of(rows), np.zeros(len(failures))
    g = np.asarray(rows["g"], dtype=float) if "g" in rows else nothing
    off = ~np.isnan(scales) & ~(g <= FAR * np.where(scales != 0, scales, 1.0))
    jump = np.asarray(rows["jump"], dtype=float) if "jump" in rows else nothing
    choices = [words != "", off, jump > WRONG, ~(size <= ALL), size > LARGE]
    return np.select(choices, [words, OFF, OTHER, LOST, COARSE], FINE)


def word_of(failure: str) -> str:
    """Return which of :data:`OUTCOMES` the sentence of a failure tells of; "" for an empty sentence."""
    return next((word for text, word in TOLD.items() if text in failure), STOPPED) if failure else ""


@lru_cache(maxsize=4096)
def _scale(problem: str, case: str, parameters: tuple[tuple[str, float], ...]) -> float:
    """Return by how much g changes where all positions change by one part; NaN where there is no g, or no start."""
    try:
        ivp = ivp_of(problem, case, parameters, "")
    except DaebenchError:
        return float("nan")  # the run has failed, and says so
    return residual_scales(ivp, *ivp.start)[0] if ivp.on_manifold else float("nan")
