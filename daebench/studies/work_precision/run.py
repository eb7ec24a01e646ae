"""``daebench.work_precision``: errors of many methods against their cost, from the start of a case or from many."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Unpack

import numpy as np

from daebench.draw.figures import save_table
from daebench.errors import BadInput, unknown
from daebench.methods.outside.read import is_outside
from daebench.runs.ivp import Ivp
from daebench.runs.own_start import OwnStart
from daebench.runs.result import Result, Table
from daebench.studies.grid.metrics import metrics_of
from daebench.studies.grid.rows import by_method, rows_of
from daebench.studies.grid.run_specification import StartRuns
from daebench.studies.grid.runs import Runs, unstored
from daebench.studies.grid.runs_together import starts_of
from daebench.studies.grid.study import Study
from daebench.studies.work_precision.figure import bands, bands_figure, draw, families, figure
from daebench.studies.work_precision.starts import SOLVER_MEMBERS, Curves, curves_of, runs_from_starts
from daebench.studies.work_precision.study import LEVELS, REPEAT, cheapest, standard, with_costs
from daebench.studies.work_precision.winners import sentences, winners

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

DEFECT = "defect"
"""Column and metric that is measured only on request, because it takes the longest."""

NO_ERRORS = ("bound", "growth", "energy_verdict", "energy_scale")
"""Prefixes of columns that are not errors."""

NEIGHBOURHOOD = "neighbourhood"
"""Distribution of many starts where no other is given."""

SLOW = ("scipy:Radau", "solve_dae:Radau")
"""Methods in Python that take seconds per run: from many starts they run only on request."""

TABLE, WINNERS, STEM = "work_precision.csv", "winners.csv", "work_precision_starts"
"""Files of the runs from one start, and of the ranks; and the picture over many starts with its table."""

PRICES = (
    "costs are CPU times of runs of one start at a time: with fixed steps the median over a few starts, otherwise those of each start; "
    "errors with fixed steps are those of the same runs made many at a time"
)
"""Quantity by which methods are ranked."""

COLUMNS = ("level", "method", "price [s]", "cheapest [%]", "of", "next", "before next [%]", "starts", "next costs, times")
"""Columns of the printed ranks."""


@dataclass(frozen=True)
class WorkPrecision(Result):
    """Errors of methods against their costs."""

    ivp: Ivp
    """The problem."""
    error: str
    """Column of the error."""
    refused: Mapping[str, str]
    """Why methods are not run, by name."""

    @classmethod
    def outputs(cls, error: str | None = None, ensemble: int | None = None, **asked: Any) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Return the table and the picture, from one start or from many."""
        pictures = (error,) if error else ("error_q", "error_y")
        return ((TABLE,), tuple(f"work_precision_{name}" for name in pictures)) if ensemble is None else ((WINNERS,), (STEM,))

    @property
    def label(self) -> str:
        """The error in words."""
        return self.error.replace("_", " of ").replace("error", "largest error")


@dataclass(frozen=True)
class FromOneStart(WorkPrecision):
    """Errors and costs of runs from the start of the case."""

    frame: "pd.DataFrame"
    """One row a run."""
    cost: str
    """Column by which methods are ranked: "seconds", or "evaluations" if runs are not timed."""

    @cached_property
    def best(self) -> "pd.DataFrame":
        """The cheapest method for each accuracy."""
        return cheapest(self.frame, self.error, self.cost, LEVELS)

    @property
    def without_run(self) -> dict[str, str]:
        """Why methods have no run that reached its end."""
        return {name: str(rows["failure"].iloc[-1]) for name, rows in by_method(self.frame) if (rows["failure"] != "").all()}

    @property
    def left_out(self) -> dict[str, str]:
        """Why methods are not ranked."""
        ended = self.frame[self.frame["failure"] == ""]
        uncounted = [name for name, rows in by_method(ended) if rows[self.cost].isna().all()]
        why = "{0}: its work is not counted; give --repeat to rank it by time."
        return {**self.refused, **{name: why.format(name) for name in uncounted}, **self.without_run}

    @property
    def references(self) -> dict[str, float]:
        """The references of the error with their bounds; empty for other columns."""
        bound = self.error.replace("error_", "bound_")
        if bound == self.error or "reference" not in self.frame:
            return {}
        rows = self.frame[self.frame["reference"].notna() & (self.frame["reference"] != "")]
        return {str(words): float(group[bound].max()) for words, group in rows.groupby("reference")}

    @property
    def status(self) -> int:
        """1 if code from outside has no run that reached its end."""
        return int(any(map(is_outside, self.without_run)))

    def summary(self) -> dict[str, Any]:
        """Return the cheapest methods, and what the errors are against, for JSON."""
        counts = {"runs": len(self.frame), "failed": int((self.frame["failure"] != "").sum())}
        return {"best": rows_of(self.best), "left_out": self.left_out, **counts, "references": self.references}

    def printed(self) -> Iterator[str | Table]:
        """Yield the cheapest methods, what the errors are against, and why methods are left out."""
        yield Table.of(self.best, f"cheapest for {self.error}")
        for reference, bound in self.references.items():
            yield f"errors are against: {reference}{f', which may be wrong by {bound:.1e}' if bound == bound else ''}"
        yield from (f"left out: {why}" for why in self.left_out.values())

    def plot(self) -> "Figure":
        """Return a figure of the error against time and evaluations."""
        return figure(self.frame, self.error, self.label)

    def write(self, folder: Path) -> list[Path]:
        """Write the table of all runs, and the picture with its table; return their paths."""
        save_table(folder / TABLE, self.frame)
        return [folder / TABLE, draw(folder, self.frame, self.error, self.label)]


@dataclass(frozen=True)
class FromManyStarts(WorkPrecision):
    """Errors and costs of runs from many starts."""

    stem: ClassVar[str] = STEM
    table_files: ClassVar[tuple[str, ...]] = (WINNERS,)

    specifications: Sequence[StartRuns]
    """The runs."""
    runs: "pd.DataFrame"
    """One row for each method and step size or tolerance, with those of all starts."""
    solver_starts: int
    """Starts of solvers at most."""

    @cached_property
    def curves(self) -> list[Curves]:
        """The curves of all methods."""
        return curves_of(self.runs, self.error)

    @cached_property
    def table(self) -> "pd.DataFrame":
        """The methods for each accuracy, the cheapest first."""
        return winners(self.curves)

    @cached_property
    def drawn(self) -> "pd.DataFrame":
        """Quantiles of errors over starts."""
        return bands(self.curves)

    def summary(self) -> dict[str, Any]:
        """Return ranks, quantiles, and descriptions of starts, references and costs, for JSON."""
        failures = {some.method: int(some.failed.sum()) for some in self.curves if some.failed.any()}
        most = max(self.specifications, key=lambda run: run.count)
        bound = max(self.curves, key=lambda some: some.starts).bound
        known = bound[np.isfinite(bound)]
        worst = {"median": float(np.median(known)), "most": float(np.max(known))} if len(known) else {}
        return {
            "members": most.members,
            "solver_starts": min(most.members, self.solver_starts),
            "winners": rows_of(self.table),
            "bands": rows_of(self.drawn),
            "sentences": sentences(self.table),
            "runs": sum(run.count for run in self.specifications),
            "failed": sum(failures.values()),
            "failures": failures,
            "left_out": self.refused,
            "starts": starts_of(most).about,
            "t_end": most.t_end,
            "reference": str(self.runs["reference"].iloc[0]),
            "reference_error": {**worst, "members_without": int(len(bound) - len(known))},
            "prices": PRICES,
        }

    def printed(self) -> Iterator[str | Table]:
        """Yield which method is the cheapest, the ranks, and the description of starts, references and costs."""
        summary = self.summary()
        yield from summary["sentences"]
        yield Table(COLUMNS, list(map(_row, summary["winners"])), f"methods for {self.error}, with intervals of 95 % over starts")
        yield f"starts: {summary['starts']}"
        errors = summary["reference_error"]
        worst = f"{errors['median']:.1e} in the median, {errors['most']:.1e} at most" if "median" in errors else "unknown"
        without = f"; {errors['members_without']} starts have none" if errors["members_without"] else ""
        yield f"errors are against: {summary['reference']}, which may be wrong by {worst}{without}"
        yield f"{PRICES}."
        if summary["failed"]:
            named = ", ".join(f"{count} of {method}" for method, count in summary["failures"].items())
            yield f"{summary['failed']} of {summary['runs']} runs stopped early and reach no accuracy: {named}."
        yield from (f"left out: {why}" for why in self.refused.values())

    def plot(self) -> "Figure":
        """Return a figure of bands of errors against time."""
        return bands_figure(self.drawn, families(self.runs), self.label, sentences(self.table))


def _row(row: Mapping[Any, Any]) -> list[str]:
    """Return a row of the ranks in words."""
    head = [f"{row['level']:.0e}", row["method"], f"{row['price']:.3g}", _interval(row, "cheapest", 100), str(row["of"])]
    if not row["next"]:
        return [*head, "", "", "", ""]
    return [*head, row["next"], _interval(row, "before", 100), f"{row['starts']:.0f}", _interval(row, "ratio", 1)]


def _interval(row: Mapping[Any, Any], name: str, unit: float) -> str:
    value, low, high = (f"{unit * row[key]:.3g}" for key in (name, f"{name}_low", f"{name}_high"))
    return f"{value} [{low}, {high}]"


def work_precision(
    problem: str,
    *,
    case: str | None = None,
    methods: Sequence[str] | None = None,
    h: Sequence[float] | None = None,
    tol: Sequence[float] | None = None,
    t_end: float | None = None,
    parameters: Mapping[str, float] | None = None,
    error: str | None = None,
    ensemble: int | None = None,
    solver_starts: int = SOLVER_MEMBERS,
    starts: str = NEIGHBOURHOOD,
    drawn: Mapping[str, Any] | None = None,
    seed: int = 0,
    repeat: int = REPEAT,
    anyway: bool = False,
    on_singular: str | None = None,
    runs: Runs = unstored,
    beside: bool = False,
    **start: Unpack[OwnStart],
) -> WorkPrecision:
    """Measure errors of many methods against time and work, and name the cheapest for each accuracy.

    Errors are against the certified reference if it has these parameters and reaches the end, otherwise against the closed form or a finer
    run; the output names it and its error bound.

    With ``ensemble`` methods run from many starts, drawn as ``starts`` says. Errors are then against runs of heyoka's batch mode or, if
    heyoka is not installed or cannot solve the problem, of a composition of order 8 with a third of the smallest step size.

    Runs are timed one at a time, the best of several after a first run that is not timed; without times they are made side by side.
    heyoka's Taylor series (heyoka:taylor) and solve_dae's Radau method (solve_dae:Radau) are included if their packages are installed
    (extra peers).

    Parameters
    ----------
    problem : str
        Name in the catalogue, or the path of a problem file, which is executed.
    case : str, optional
        Named initial values; by default the problem's first.
    methods : sequence of str, optional
        Names of methods; by default some of each family; FILE.py:NAME, LIBRARY.so:NAME and exec:PROGRAM are executed.
    h : sequence of float, optional
        Step sizes, s; by default halvings.
    tol : sequence of float, optional
        Tolerances; by default 1e-3 to 1e-13.
    t_end : float, optional
        End of all runs, s; 10 or the end of the reference if left out.
    parameters : mapping of str to float, optional
        Values of the problem's parameters.
    error : str, optional
        Column to draw against costs; error_q, or error_y, if left out. defect: of the two-form.
    ensemble : int, optional
        Number of starts in place of one: bands of errors, and in how many starts a method is the cheapest.
    solver_starts : int
        Number of starts for solvers, which run one by one.
    starts : str
        Distribution of many starts: "neighbourhood" of the case, "liouville" or "energy".
    drawn : mapping of str, optional
        Settings of the distribution, see :class:`daebench.starts.members.Neighbourhood` and the classes beside it.
    seed : int
        Seed of many starts.
    repeat : int
        Number of timed runs, of which the best counts; 0: no times.
    anyway : bool
        Whether schemes may run on Poisson systems for which they are not Poisson integrators.
    on_singular : str, optional
        What happens where G loses rank, see :func:`daebench.run`; by default what the case declares.
    runs : callable
        Makes the rows of runs; ``daebench.studies.grid.runs.runs_of`` has them in a store.
    beside : bool
        Whether timed runs are made beside others, whose load then affects the times.
    **start : OwnStart
        A start of one's own in place of the case's: q0, p0, v0, y0 and project, as for :func:`daebench.initial_value_problem`.

    Returns
    -------
    WorkPrecision

    Raises
    ------
    BadInput
        If a name or number is invalid, or of no use.

    Examples
    --------
    >>> import daebench
    >>> asked = {"case": "rotating", "methods": ["scipy:RK45", "scipy:DOP853"], "tol": [1e-4, 1e-6, 1e-8], "t_end": 2, "repeat": 0}
    >>> best = daebench.work_precision("planar_pendulum", **asked).best
    >>> best[["level", "method"]].values.tolist()
    [[0.01, 'scipy:RK45'], [0.0001, 'scipy:RK45'], [1e-06, 'scipy:DOP853']]
    """
    asked: dict[str, Any] = {"case": case, "methods": methods, "h": h, "tol": tol, "t_end": t_end, "parameters": parameters}
    asked |= {"repeat": repeat, "beside": beside, "anyway": anyway, "on_singular": on_singular}
    study, refused = standard(problem, **asked, **start, also=(DEFECT,) if error == DEFECT else ())
    column = _column(error, study)
    if ensemble is None:
        _refuse_of_no_use(drawn or {}, seed, starts, solver_starts)
        specifications = study.specifications()
        cost = "seconds" if repeat else "evaluations"
        return FromOneStart(specifications[0].ivp, column, refused, with_costs(runs(specifications)), cost)
    study = study if methods else without_slow(study, refused)
    given: dict[str, Any] = {"distribution": starts, "settings": drawn, "seed": seed}
    many = runs_from_starts(study, members=ensemble, solver_members=solver_starts, **given)
    if column.removeprefix("error_") not in many[0].metrics:
        known = ", ".join(f"error_{name}" for name in many[0].metrics)
        raise BadInput(f"over many starts errors are {known}; {column} is of one start, without --ensemble.", "column-of-one-start")
    return FromManyStarts(many[0].ivp, column, refused, many, runs(many), solver_starts)


def _column(error: str | None, study: Study) -> str:
    """Return the column of an error; refuse one that the study does not have."""
    known = [name for metric in metrics_of(study.metrics) for name in metric.columns if not name.startswith(NO_ERRORS)]
    if error is not None and error not in known:
        raise unknown("column", error, {*known, DEFECT})
    return error or known[0]


def _refuse_of_no_use(drawn: Mapping[str, Any], seed: int, starts: str, solver_starts: int) -> None:
    """Refuse options of many starts that are given if there is one start."""
    given = ["--energy" if name == "E" else f"--{name}" for name in drawn]
    options = {"--seed": seed != 0, "--starts": starts != NEIGHBOURHOOD, "--solver-starts": solver_starts != SOLVER_MEMBERS}
    if given := [*given, *(name for name, is_given in options.items() if is_given)]:
        raise BadInput(
            f"{', '.join(given)} {'is' if len(given) == 1 else 'are'} for many starts; give their number with --ensemble.",
            "option-of-many-starts",
        )


def without_slow(study: Study, left_out: dict[str, str]) -> Study:
    """Return a study without the methods of :data:`SLOW`, and note why these are left out."""
    why = "{0}: it takes seconds per run, which is long from many starts; name it in --methods to include it."
    left_out |= {name: why.format(name) for name in study.methods if name in SLOW}
    return replace(study, methods=[name for name in study.methods if name not in SLOW])
