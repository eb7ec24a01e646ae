"""The cost of accuracy over many starts: the runs, and the work-precision curves of each start."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from dataclasses import fields as dataclass_fields
from fractions import Fraction
from math import lcm
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from daebench.errors import BadInput, whole
from daebench.runs.grid import require_memory_of_members
from daebench.runs.trajectory import Array
from daebench.starts.draw import distribution_of
from daebench.studies.grid.run_specification import FEWEST, GridRun, StartRuns
from daebench.studies.grid.runs_together import made_together
from daebench.studies.grid.study import Study

if TYPE_CHECKING:
    import pandas as pd

SOLVER_MEMBERS = 16
"""Starts of methods whose members are run one by one, where their number is not said."""

OUTPUTS = 64
"""Times at which errors are taken, at most."""

DENOMINATOR = 10**9
"""Largest denominator of a fraction that a step size is taken for."""


def runs_from_starts(
    study: Study,
    *,
    members: int,
    solver_members: int = SOLVER_MEMBERS,
    distribution: str = "neighbourhood",
    settings: Mapping[str, Any] | None = None,
    seed: int = 0,
) -> list[StartRuns]:
    """Return the runs of a work-precision study from many starts in place of one.

    Fixed-step methods are run from all starts; other methods, one by one, from the first ``solver_members`` of them. All errors are taken
    at the same times, which are stored times of every step size; runs end at the last of these.
    """
    if distribution == "grid":
        raise BadInput("starts of work-precision must be random; give neighbourhood, liouville or energy.", "starts-not-random")
    distribution_of(distribution, settings or {})
    if min(whole("members", members), whole("solver members", solver_members)) < 1:
        raise BadInput(
            f"{members} starts for fixed-step methods and {solver_members} for solvers: each must be at least 1.", "starts-not-positive"
        )
    whole("seed", seed, 0)
    if study.repeat < 1:
        raise BadInput("methods are ranked by time over many starts; give --repeat 1 or more.", "ranked-without-repeat")
    sizes = [value for name, values in study.values.items() if name != "tol" for value in values]
    t_end, outputs = output_times(sizes, study.t_end)
    single = replace(study, t_end=t_end, metrics=("energy",)).specifications()
    if single:
        require_memory_of_members(2 * outputs, single[0].ivp.size, members)
    fields: dict[str, Any] = {
        "metrics": single[0].ivp.state.columns if single else (),
        "outputs": outputs,
        "finest": min(sizes, default=t_end / OUTPUTS / 16),
    }
    fields |= {"distribution": distribution, "settings": json.dumps(settings or {}, sort_keys=True), "seed": seed}
    return [_from_starts(run, fields, members, solver_members) for run in single]


def _from_starts(run: GridRun, fields: Mapping[str, Any], members: int, solver_members: int) -> StartRuns:
    """Return one run from as many starts as its method gets."""
    count = members if made_together(run.solver, run.ivp) else min(members, solver_members)
    given = {field.name: getattr(run, field.name) for field in dataclass_fields(GridRun)}
    return StartRuns(**{**given, **fields, "members": count})


def output_times(sizes: Sequence[float], t_end: float) -> tuple[float, int]:
    """Return the end of runs, and the number of equidistant times until there that all step sizes come to.

    ::

        >>> from daebench.studies.work_precision.starts import output_times
        >>> output_times([0.1, 0.025], 10.0)
        (10.0, 50)
    """
    if not sizes:
        return t_end, OUTPUTS
    parts = [Fraction(h).limit_denominator(DENOMINATOR) for h in (*sizes, t_end)]
    denominator = lcm(*(part.denominator for part in parts))
    *whole_sizes, end = (int(part * denominator) for part in parts)
    common = lcm(*whole_sizes)
    count = end // common if common else 0
    if count < FEWEST:
        raise BadInput(
            f"step sizes {', '.join(f'{h:g}' for h in sizes)} have fewer than {FEWEST} common multiples up to t = {t_end:g}, "
            "at which errors could be taken; choose halvings of one, or a later end.",
            "few-common-output-times",
        )
    divisors = [k for k in range(1, count // FEWEST + 1) if count % k == 0 and count // k <= OUTPUTS]
    every = divisors[0] if divisors else -(-count // OUTPUTS)
    outputs = count // every
    return outputs * every * common / denominator, outputs


@dataclass(frozen=True)
class Curves:
    """The work-precision curves of one method from n starts, each of m step sizes or tolerances."""

    method: str
    knob: str
    """The method, and its control parameter: "h" or "tol"."""
    values: Array
    """Step sizes or tolerances; shape (m,)."""
    errors: Array
    """Errors, infinite where a run stopped early; at least the bound of the start's reference, below which nothing is known; shape (m, n).
    """
    seconds: Array
    """What a run costs, s, NaN where it is not known; shape (m, n)."""
    bound: Array
    """What the reference of each start may be wrong by; shape (n,)."""
    failed: NDArray[np.int64]
    """Runs that stopped early; shape (m,)."""
    scatter: float = 0.0
    """By which part times differ between the starts that are timed, where all starts have one cost: the median over step sizes of the
    longest over the shortest, less 1; 0 where each run is timed.
    """

    @property
    def starts(self) -> int:
        """Number of starts."""
        return len(self.bound)


def curves_of(table: "pd.DataFrame", error: str) -> list[Curves]:
    """Return the curves of all methods from the stored rows of runs from starts, see :func:`runs_from_starts`."""
    curves = []
    for method, rows in table.groupby("method", sort=False):
        errors = np.array(rows[error].to_list(), dtype=float)
        bound = np.array(rows[error.replace("error_", "bound_")].iloc[0], dtype=float)
        errors = np.where(np.isnan(errors), np.inf, np.maximum(errors, bound))
        seconds = np.array([np.broadcast_to(x, len(bound)) for x in rows["seconds"]], dtype=float)
        failed = np.array([sum(map(bool, failures)) for failures in rows["failure"]])
        values = rows["value"].to_numpy(dtype=float)
        curves.append(Curves(str(method), str(rows["knob"].iloc[0]), values, errors, seconds, bound, failed, _scatter(rows)))
    return curves


def _scatter(rows: "pd.DataFrame") -> float:
    """Return by which part the times of a method differ between starts that are timed."""
    if "seconds_most" not in rows or rows["seconds_most"].isna().all():
        return 0.0
    return float((rows["seconds_most"] / rows["seconds_least"]).median()) - 1
