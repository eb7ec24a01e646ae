"""The effect of precision: single, double and compensated arithmetic, and Newton's iteration ended early, with their costs."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Unpack

from daebench.draw.figures import curve, drawing, grid_of_axes, legend_below
from daebench.errors import BadInput, DaebenchError
from daebench.methods.outside.read import is_outside
from daebench.runs.ivp import Ivp
from daebench.runs.own_start import OwnStart
from daebench.runs.result import Result, Table
from daebench.runs.state import CONSTRAINED, POISSON
from daebench.studies.grid.claimed import feasible
from daebench.studies.grid.rows import by_method, endless, error_of, rows_of
from daebench.studies.grid.run_specification import GridRun, Row
from daebench.studies.grid.runs import Runs, unstored
from daebench.studies.grid.specification import require_possible
from daebench.studies.grid.study import computed_in
from daebench.studies.stability.extreme import Asked, asked_of, uncertified
from daebench.studies.work_precision.study import REPEAT
from daebench.systems.lazily import pandas as pd

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WAYS = ("float64", "compensated", "float32", "sweeps=1", "sweeps=2", "sweeps=3", "newton=1e-6")
"""How to compute, in the words of :class:`daebench.studies.grid.study.Study`."""

BASE = "float64"
"""The arithmetic that the others are compared with."""

METHODS = {CONSTRAINED: ("rattle", "lobatto3", "dla", "spark_lobatto3"), POISSON: ("midpoint", "strang")}
"""Default methods by the state of the problem."""

HALVINGS = (2, 4, 6, 8)
"""Halvings of the distance of stored times, where no step sizes are given."""

AS_GOOD = 1.1
"""A number is as good as that of double precision up to this factor."""

ROUND_OFF = 1e-14
"""Where numbers are no worse than this, in parts of their size, they are of round-off all."""

SHOWN = ("method", "way", "time_ratio", "error_q", "error_y", "energy_error", "energy_verdict", "g", "casimirs", "defect", "failure")
"""Columns of the printed table."""

LABELS = {
    "error_q": "largest error of q",
    "error_y": "largest error of y",
    "energy_error": "largest energy error",
    "defect": "defect of the two-form",
}
"""Columns that are drawn, and their labels."""

SMALLEST = 1e-18
"""Where what is zero is drawn."""


@dataclass(frozen=True)
class Precision(Result):
    """Runs in several kinds of arithmetic, and with Newton's iteration ended early."""

    stem: ClassVar[str] = "precision"

    ivp: Ivp
    """The problem."""
    frame: "pd.DataFrame"
    """One row a run, with the way in which it is computed."""
    absent: Mapping[str, str]
    refused: Mapping[str, str]
    """Why methods, and ways of methods, are left out."""

    def summary(self) -> dict[str, Any]:
        """Return the sentences, and the runs with the smallest steps, for JSON."""
        return {
            "says": says(self.frame),
            "smallest_steps": rows_of(smallest_steps(self.frame)),
            "left_out": {**self.absent, **self.refused},
        }

    def printed(self) -> Iterator[str | Table]:
        """Yield the runs with the smallest steps, the sentences, and what is left out."""
        last = smallest_steps(self.frame)
        yield Table.of(last[[name for name in SHOWN if name in last and not last[name].isna().all()]], "with the smallest steps")
        yield from says(self.frame)
        yield from (f"left out: {why}" for why in (*self.absent.values(), *(f"{name}: {why}" for name, why in self.refused.items())))

    def plot(self) -> "Figure":
        """Return a figure of error, energy error and two-form against time."""
        return figure(self.frame)


def precision(
    problem: str,
    *,
    case: str | None = None,
    methods: Sequence[str] | None = None,
    ways: Sequence[str] | None = None,
    h: Sequence[float] | None = None,
    t_end: float | None = None,
    repeat: int = REPEAT,
    anyway: bool = False,
    on_singular: str | None = None,
    runs: Runs = unstored,
    beside: bool = False,
    **start: Unpack[OwnStart],
) -> Precision:
    """Compare single, double and compensated arithmetic, and Newton's iteration ended early, in error, energy, two-form and time.

    Newton's iteration is ended after 1, 2, 3 iterations or at a tolerance, and compared with a converged one.

    Parameters
    ----------
    problem : str
        Name in the catalogue, or the path of a problem file, which is executed.
    case : str, optional
        Named initial values; by default the problem's first.
    methods : sequence of str, optional
        Names of fixed-step methods of daebench; by default some.
    ways : sequence of str, optional
        Among float64, mixed, float32, compensated, sweeps=K, newton=TOL; by default some of them.
    h : sequence of float, optional
        Step sizes, s; by default those that the times of the reference allow.
    t_end : float, optional
        End of all runs, s; 10 or the end of the reference if left out.
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
    Precision

    Raises
    ------
    BadInput
        If a way or a method is unknown, none has fixed steps, no way can be run, or the reference ends before the runs.

    Examples
    --------
    >>> import daebench
    >>> study = daebench.precision("planar_pendulum", case="rotating", methods=["rattle"], ways=["float64", "float32"], t_end=2, repeat=0)
    >>> study.table.groupby("way")["error_q"].min().round(7).to_dict()
    {'float32': 3.6e-06, 'float64': 7e-07}
    """
    asked = asked_of(problem, case, methods, h, t_end, start=start, anyway=anyway, on_singular=on_singular)
    labelled, refused = specifications_of(asked, ways or (), repeat=repeat, beside=beside)
    return Precision(asked.ivp, table_of(labelled, runs), asked.left_out, refused)


def specifications_of(
    asked: Asked, ways: Sequence[str] = (), *, repeat: int = REPEAT, beside: bool = False
) -> tuple[list[tuple[str, GridRun]], dict[str, str]]:
    """Return every way to compute with its run, and why some are left out.

    BadInput is raised if a way or a method is unknown, a method is from outside, none has fixed steps, no way can be run, or the reference
    ends before the runs.
    """
    if asked.reference and asked.end > asked.reference.horizon:
        raise BadInput(f"{uncertified(asked)}; take a smaller t_end.", "precision-uncertified")
    methods = _methods(asked)
    labelled: list[tuple[str, GridRun]] = []
    refused: dict[str, str] = {}
    for method in methods:
        for way in ways or WAYS:
            specifications = [
                asked.specification(method, h, _metrics(asked), repeat=repeat, beside=beside and repeat > 0, **computed_in(way))
                for h in asked.h or _steps(asked)
            ]
            try:
                for specification in specifications:
                    require_possible(specification)
            except BadInput as error:
                refused[f"{method}, {way}"] = str(error)
                continue
            labelled += [(way, specification) for specification in specifications]
    if not labelled:
        raise BadInput(f"none of these ways can be run: {next(iter(refused.values()))}", "precision-ways-refused")
    return labelled, refused


def _methods(asked: Asked) -> list[str]:
    """Return the methods that are compared."""
    for name in filter(is_outside, asked.methods):
        raise BadInput(
            f"{name} is from outside, and computes in its own arithmetic; precision compares kinds of arithmetic for methods of daebench.",
            "precision-from-outside",
        )
    methods = asked.fixed if asked.methods else feasible(asked.ivp, METHODS[asked.ivp.state], anyway=asked.anyway)[0]
    if not methods:
        raise BadInput(
            "precision is compared for fixed-step methods, and none is given; give some, for example rattle.", "precision-without-method"
        )
    return methods


def _metrics(asked: Asked) -> tuple[str, ...]:
    error = () if asked.reference is None else (asked.ivp.state.position,)
    form = () if asked.ivp.nonholonomic else ("defect",)
    return (*error, "energy", asked.ivp.state.conserved, *form)


def _steps(asked: Asked) -> list[float]:
    spacing = float(asked.reference.t[1]) if asked.reference else asked.end / 128
    return [spacing / 2**k for k in HALVINGS]


def table_of(labelled: Sequence[tuple[str, GridRun]], runs: Runs) -> "pd.DataFrame":
    """Return one row a run, with the column "way"."""
    table = runs([specification for _, specification in labelled])
    return table.assign(way=[way for way, _ in labelled])


def smallest_steps(table: "pd.DataFrame") -> "pd.DataFrame":
    """Return the rows with each method's smallest step, where precision matters most, and their time over that of double precision."""
    rows: list[dict[str, Any]] = []
    for _, runs in by_method(table):
        last = rows_of(runs[runs["value"] == runs["value"].min()])
        base = next((float(row["seconds"]) for row in last if row["way"] == BASE), float("nan"))
        rows += [{**row, "time_ratio": row["seconds"] / base} for row in last]
    return pd.DataFrame(rows)


def says(table: "pd.DataFrame") -> list[str]:
    """Return, for each method, what double precision reaches and the cheapest way that is as good, and what single precision loses."""
    error, sentences = error_of(table), []
    for method, runs in by_method(smallest_steps(table)):
        rows = {str(row["way"]): row for row in rows_of(runs) if not row["failure"]}
        if BASE not in rows:
            continue
        base = rows[BASE]
        sentences.append(f"{method} with h = {base['value']:.2g} s: {_held(rows, base, error)}")
    return sentences


def _held(rows: dict[str, Row], base: Row, error: str) -> str:
    """Return the effects of ending Newton's iteration early, of compensation and of single precision, against double precision."""
    parts = [f"{'energy error' if error == 'energy_error' else error.replace('_', ' of ')} {base[error]:.1e}"]
    early = [way for way in rows if "=" in way]
    good = [way for way in early if _as_good(rows[way], base, error)]
    if good:
        best = min(good, key=lambda way: float(rows[way]["time_ratio"]))
        compared = "error, energy, constraints and two-form" if "defect" in rows[best] else "error, energy and constraints"
        parts.append(f"{best} is as accurate in {compared}{_time(rows[best])}")
    elif early:
        parts.append("Newton's iteration ended early is never as accurate")
    if "compensated" in rows:
        parts.append(f"compensated sums give {rows['compensated'][error]:.1e}{_time(rows['compensated'])}")
    if "mixed" in rows:
        parts.append(f"single precision of the forces alone {rows['mixed'][error]:.1e}{_time(rows['mixed'])}")
    if "float32" in rows:
        parts.append(f"single precision {rows['float32'][error]:.1e}{_time(rows['float32'])}")
    return "; ".join(parts) + "."


def _as_good(row: Row, base: Row, error: str) -> bool:
    """Return whether error, energy, constraints and two-form are as good, or of round-off."""
    sizes = {error: 1.0, "energy_error": base["energy_scale"]} | dict.fromkeys(("g", "Gv", "casimirs", "defect"), 1.0)
    return all(row[name] <= max(AS_GOOD * base[name], ROUND_OFF * size) for name, size in sizes.items() if name in row)


def _time(row: Row) -> str:
    """Return the time over that of double precision, if it was timed."""
    return f", in {row['time_ratio']:.2f} times the time" if row["time_ratio"] == row["time_ratio"] else ""


def figure(table: "pd.DataFrame") -> "Figure":
    """Return the picture: error, energy error and two-form against time, a row of panels for each method, a curve for each way."""
    if why := endless(table):
        raise DaebenchError(f"there is nothing to draw: {why}.", "precision-nothing-to-draw")
    cost, unit = ("seconds", "CPU time [s]") if table["seconds"].notna().any() else ("value", "step size h [s]")
    columns = [name for name in dict.fromkeys((error_of(table), "energy_error", "defect")) if name in table and table[name].notna().any()]
    methods = by_method(table[table["failure"] == ""])
    ways = list(dict.fromkeys(table["way"]))
    with drawing():
        drawn, axes = grid_of_axes(len(methods), len(columns), 0.8 + 2.3 * len(methods), sharex="row")
        for line, (method, rows) in zip(axes, methods, strict=True):
            for axis, column in zip(line, columns, strict=True):
                for k, way in enumerate(ways):
                    runs = rows[rows["way"] == way].dropna(subset=[column]).sort_values("value")
                    axis.plot(runs[cost], runs[column].clip(lower=SMALLEST), label=way, **curve(k))
                axis.set(xscale="log", yscale="log", title=method, ylabel=LABELS[column])
        for axis in axes[-1]:
            axis.set_xlabel(unit)
        legend_below(drawn, axes[0, 0], 5)
    return drawn
