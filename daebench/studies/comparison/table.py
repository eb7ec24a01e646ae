"""Several methods on one initial value problem, side by side in one table."""

import textwrap
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Unpack

import numpy as np

from daebench.diagnostics.drift import Drift
from daebench.diagnostics.energy_verdict import energy_scales, size
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import Code, methods_of
from daebench.methods.solvers.drive import not_installed
from daebench.runs.ivp import Ivp
from daebench.runs.own_start import OwnStart
from daebench.runs.request import Request, Told, resolution_value, silent
from daebench.runs.result import Look, Result, Table, tabular
from daebench.runs.trajectory import Outcome
from daebench.studies.comparison.figure import curves_of, figure
from daebench.studies.comparison.position_error import position_errors
from daebench.studies.held_verdict import held_verdict
from daebench.systems.lazily import pandas as pd

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from daebench.systems.constrained import ConstrainedHamiltonian
    from daebench.systems.poisson import PoissonSystem

TOLERANCE = 1e-8
"""Default tolerance of tolerance-driven methods."""

MOST_STATES = 20000
"""States kept by a fixed-step method in a comparison, about."""

PLAIN = Look()
"""Layout of the picture where no other is chosen."""

WIDTH = 80
"""Width of a printed comparison in characters."""

LOST = 1.0
"""Energy error relative to the mean kinetic energy above which a motion is lost."""

COLUMNS = (
    *("method", "h", "tol", "steps", "t_end", "t_reached"),
    *("energy_error", "energy_size", "energy_verdict", "energy_law", "energy_reason", "energy_change_bound"),
    *("position_error", "position_bound", "position_reference", "seconds", "failure"),
)
"""Columns of a comparison in its summary, in this order; the table has all."""


@dataclass(frozen=True)
class Comparison(Result):
    """Several methods on one initial value problem.

    Parameters
    ----------
    ivp : InitialValueProblem
        The problem.
    runs : tuple of Trajectory or PoissonTrajectory
        One for each method; fewer if Ctrl-C ended them.
    frame : DataFrame
        The table, see :func:`daebench.compare`.
    """

    drawn_by: ClassVar[str] = "daebench.studies.comparison.figure"
    stem: ClassVar[str] = "comparison_drift"
    table_files: ClassVar[tuple[str, ...]] = ("comparison.csv",)
    fails_if: ClassVar[str] = "one stops early"

    ivp: Ivp
    runs: tuple[Any, ...]
    frame: "pd.DataFrame"

    @cached_property
    def drawn(self) -> "pd.DataFrame":
        """The errors along the runs."""
        return curves_of(self.ivp, self.runs)

    @property
    def origin(self) -> dict[str, str]:
        """The methods with their step sizes or tolerances."""
        return {"Methods": ", ".join(f"{run.method} with {run.knob} = {run.value:g}" for run in self.runs)}

    @property
    def status(self) -> int:
        """1 if a method stops early."""
        return int(any(run.failure for run in self.runs))

    def summary(self) -> dict[str, Any]:
        """Return the comparison, for JSON; a row has h or tol, depending on its method."""
        records, left_out = self.frame.to_dict("records"), {"h": "tol", "tol": "h"}
        rows = [
            {name: row[name] for name in COLUMNS if name in row and name != left_out[run.knob]} | {"failure": row["failure"] or None}
            for run, row in zip(self.runs, records, strict=True)
        ]
        return {**self.posed, "rows": rows}

    def printed(self) -> Iterator[str | Table]:
        """Yield the columns that fit on 80 characters, the references of positions, and why methods stopped."""
        yield narrow(self.frame)
        yield from notes(self.frame)
        yield from (run.failure for run in self.runs if run.failure)

    def plot(self, look: Look = PLAIN) -> "Figure":
        """Return a figure of the errors along the runs, a panel for each quantity."""
        return figure(self.ivp, self.runs, self.drawn, look)


@tabular
def compare(
    problem: "str | ConstrainedHamiltonian | PoissonSystem",
    *,
    methods: Sequence[Code],
    h: float | None = None,
    t_end: float,
    case: str | None = None,
    tol: float = TOLERANCE,
    parameters: Mapping[str, float] | None = None,
    options: Mapping[str, float] | None = None,
    anyway: bool = False,
    on_singular: str | None = None,
    algebra: str = "",
    progress: Told | None = None,
    **start: Unpack[OwnStart],
) -> Comparison:
    """Compare methods on one problem: error, size and trend of the energy, error of the position, time.

    The position, or the state y of a Poisson system, is compared with a certified reference if there is one, otherwise with a closed form
    or a finer run; the output says which. The table also has manifold or Casimir errors, integrals, and work.

    Parameters
    ----------
    problem : str, ConstrainedHamiltonian or PoissonSystem
        Name in the catalogue, the path of a problem file, which is executed, or a definition.
    methods : sequence of str or callable
        Names of methods, see :mod:`daebench.methods.names`; FILE.py:NAME, LIBRARY.so:NAME and exec:PROGRAM are executed.
    h : float, optional
        Step size of the fixed-step methods, s.
    t_end : float
        End time, s.
    case : str, optional
        Named initial values; by default the problem's first.
    tol : float
        Tolerance of the tolerance-driven methods.
    parameters : mapping of str to float, optional
        Values of the problem's parameters.
    options : mapping of str to float, optional
        Free numbers of the methods; each is passed to the methods that have it.
    project : bool
        Whether the initial values of a constrained problem are first projected onto the manifold.
    anyway : bool
        Whether schemes may be run on a Poisson system outside of the class for which they are Poisson integrators.
    on_singular : str, optional
        What to do where G loses rank: one of :data:`daebench.runs.request.ON_SINGULAR`; by default what the case declares.
    algebra : str
        Form of vectors: "values", or "arrays" for a chain of nodes; by its size if "".
    progress : callable, optional
        Called with the fraction done and a label of the current task.
    **start : OwnStart
        A start of one's own in place of the case's: q0, p0, v0, y0 and project, as for :func:`daebench.initial_value_problem`.

    Returns
    -------
    DataFrame
        Columns method, h or tol, steps, t_reached (s), energy_error (largest modulus over all steps), energy_size (the same
        over the mean kinetic energy; above 1 the motion is lost), energy_verdict, energy_law, energy_reason and energy_change_bound (see
        :class:`daebench.diagnostics.drift.Drift`), slope (per s); g and Gv, the largest distances from g = 0 and G H_p = 0, or the Casimir
        functions by name; seconds (CPU time of stepping), us_per_step (microseconds), counts of work n_H_p, n_H_q, ...; t_end, as
        requested; position_error, the largest error of a coordinate of q, or of y, at about 64 outputs; position_bound, the error bound of
        its reference; position_reference, its description: the certified reference if it fits, otherwise a closed form or a finer run;
        failure. A method that stopped early has a row with the reason in ``failure``.

    Raises
    ------
    BadInput
        If the request cannot be met.

    Examples
    --------
    >>> import daebench
    >>> table = daebench.compare("spherical_pendulum", case="fig1.1", methods=["seproj", "rattle"], h=0.03, t_end=10)
    >>> table[["method", "energy_error"]].round(6).values.tolist()
    [['seproj', 5.7e-05], ['rattle', 1e-06]]
    """
    ivp = initial_value_problem(problem, case, parameters, on_singular=on_singular, algebra=algebra, **start)
    chosen, tell = methods_of(ivp, methods, options, anyway=anyway), progress or silent
    names = [method.name for method in chosen]
    runs = trajectories(
        ivp, chosen, h=h, tol=tol, t_end=t_end, began=lambda name: tell(names.index(name) / len(names), f"{name} on {ivp.problem}")
    )
    tell(1.0, "errors of the positions")
    return Comparison(ivp, tuple(runs), table_of(ivp, chosen, runs, t_end))


def table_of(ivp: Ivp, methods: Sequence[Any], runs: Sequence[Any], t_end: float) -> "pd.DataFrame":
    """Return one row a run of a comparison to ``t_end``, see :func:`compare`; where it was ended, there are fewer runs than methods."""
    begun = methods[: len(runs)]
    errors = position_errors(ivp, begun, runs)
    asked = (_request(ivp, method, run.value, run.value, t_end) for method, run in zip(begun, runs, strict=True))
    drifts = [held_verdict(ivp, method, request, run) for method, request, run in zip(begun, asked, runs, strict=True)]
    return pd.DataFrame(
        [
            {
                **{name: value for name, value in columns.items() if name != "failure"},
                "t_end": t_end,
                "position_error": error.value,
                "position_bound": error.bound,
                "position_reference": error.reference,
                "failure": columns["failure"],
            }
            for columns, error in ((row(ivp, run, drift), error) for run, drift, error in zip(runs, drifts, errors, strict=True))
        ]
    )


def trajectories(
    ivp: Ivp,
    methods: Sequence[Any],
    *,
    h: float | None,
    tol: float = TOLERANCE,
    t_end: float,
    began: Callable[[str], None] | None = None,
) -> list[Any]:
    """Return one trajectory a method, in order; all requests are checked before the first run, and an interruption ends all.

    The trajectory of a method whose package is not installed ends at the start.
    """
    missing = {method.name: sentence for method in methods if (sentence := not_installed(method.name))}
    for method in methods:
        resolution_value(method, h=h if method.knob == "h" else None, tol=tol if method.knob == "tol" else None)
        if method.name not in missing:
            method.check(ivp, _request(ivp, method, h, tol, t_end))
    runs: list[Any] = []
    for method in methods:
        if began:
            began(method.name)
        request = _request(ivp, method, h, tol, t_end)
        runs.append(_not_begun(ivp, method, request, missing[method.name]) if method.name in missing else method.solve(ivp, request))
        if runs[-1].interrupted:
            break
    return runs


def _not_begun(ivp: Ivp, method: Any, request: Request, failure: str) -> Any:
    """Return a run that has not begun, with its initial state and no numbers."""
    about: dict[str, Any] = {"problem": ivp.problem, "case": ivp.case, "parameters": dict(ivp.parameters), "failure": failure}
    about |= {"method": method.name, "knob": method.knob, "value": request.value, "t": np.zeros(1), "steps": 0, "seconds": float("nan")}
    about["maxima"] = {"energy": float("nan")}
    states = ivp.trajectory.parts(np.concatenate(ivp.start)[None])
    return ivp.trajectory(**states, ivp=ivp, **about)


def _request(ivp: Ivp, method: Any, h: float | None, tol: float, t_end: float) -> Request:
    watch = ivp.state.monitors
    if method.knob == "tol" or h is None:
        return Request(value=tol, t_end=t_end, watch=watch, keep_interrupted=True)
    every = max(1, int(t_end / h / MOST_STATES)) if h > 0 and np.isfinite(t_end / h) else 1
    return Request(value=h, t_end=t_end, every=every, watch=watch, keep_interrupted=True)


def row(ivp: Ivp, trajectory: Outcome, drift: Drift) -> dict[str, Any]:
    """Return the columns of a comparison for one run and the verdict on its energy.

    ``energy_error`` is the largest modulus, ``energy_size`` the same over the mean kinetic energy, the other columns of the energy and
    ``slope`` are those of :func:`daebench.studies.held_verdict.held_verdict`, ``g`` and ``Gv``, or the Casimir
    functions, and the first integrals are maxima, ``seconds`` is CPU time of stepping and ``us_per_step`` the same for one step, in
    microseconds.
    """
    maxima = dict(trajectory.maxima)
    error = maxima.pop("energy")
    return {
        "method": trajectory.method,
        trajectory.knob: trajectory.value,
        "steps": trajectory.steps,
        "t_reached": float(trajectory.t[-1]),
        "energy_error": error,
        "energy_size": size(error, energy_scales(ivp, trajectory)),
        "energy_verdict": drift.verdict,
        "energy_law": drift.words,
        "energy_reason": drift.reason,
        "energy_change_bound": drift.change_bound,
        "slope": drift.slope,
        **maxima,
        "seconds": trajectory.seconds,
        "us_per_step": 1e6 * trajectory.seconds / trajectory.steps if trajectory.steps else float("nan"),
        **{f"n_{kind}": count for kind, count in trajectory.work.items()},
        "failure": trajectory.failure,
    }


def narrow(table: "pd.DataFrame") -> Table:
    """Return one line per method: its step size or tolerance, error, size and trend of the energy, error of the position, and time."""
    resolutions = [name for name in ("h", "tol") if name in table]
    columns = ["method", " or ".join(resolutions), "energy\nerror", "over\nmean T", "energy", "position\nerror", "seconds"]
    return Table(columns, [_line(row, resolutions) for row in table.to_dict("records")], width=WIDTH)


def _line(row: dict[Any, Any], resolutions: list[str]) -> list[str]:
    value = next(row[name] for name in resolutions if row[name] == row[name])
    return [
        str(row["method"]),
        f"{value:.3g}",
        _number(row["energy_error"]),
        _size(row.get("energy_size", float("nan"))),
        str(row.get("energy_verdict", "")),
        _position(row["position_error"], row["position_bound"]),
        _number(row["seconds"]),
    ]


def _number(value: float) -> str:
    return f"{value:.2g}" if value == value else ""


def _size(value: float) -> str:
    """Return the size of an energy error, and whether the motion is lost."""
    return f"{_number(value)}{' lost' if value > LOST else ''}"


def _position(error: float, bound: float) -> str:
    """Return an error of the position; an error that equals the bound of its reference is marked as an upper bound."""
    if error != error:
        return "unknown" if bound == bound else ""
    return f"< {_number(error)}" if error == bound else _number(error)


def notes(table: "pd.DataFrame") -> list[str]:
    """Return the references of positions, on 80 columns: a note for each reference, with its methods if there are several references."""
    compared_rows = table[table["position_reference"] != ""]
    remarks = []
    for words, rows in compared_rows.groupby("position_reference", sort=False):
        of = "" if compared_rows["position_reference"].nunique() == 1 else f" of {', '.join(rows['method'])}"
        bound = "" if str(words).startswith("unknown") else f", which may be wrong by {rows['position_bound'].max():.1e}"
        note = f"position error{of}: {'against ' if bound else ''}{words}{bound}"
        remarks.append(textwrap.fill(note, WIDTH, subsequent_indent="  ", break_on_hyphens=False))
    return remarks
