"""A run computed: one run, what it gave by column, and the best time of it."""

import math
import time
from dataclasses import replace
from typing import Any

from daebench.errors import DaebenchError
from daebench.records.code import code_version
from daebench.records.rows import StoredRow
from daebench.runs.ivp import InitialValueProblem
from daebench.runs.request import Request
from daebench.studies.grid.member_runs import MemberRuns, member_row
from daebench.studies.grid.metrics import Measured, metrics_of
from daebench.studies.grid.run_specification import GridRun, ParameterRuns, Row, StartRuns
from daebench.studies.grid.runs_together import parameter_row, start_row

LONG = 0.3
"""CPU time after which a run is not timed again, s: what disturbs a run of that length is small beside it."""


def stored_row(key: str, specification: GridRun) -> StoredRow:
    """Return the row of a run as it is kept under its key, with how long it took."""
    began = time.perf_counter()
    row = row_of(specification)
    return StoredRow(key, specification.plain(), row, code_version(), time.perf_counter() - began)


def row_of(specification: GridRun) -> Row:
    """Return the row of a run: what :func:`measured_row` gives, and the time where it is asked for; or that of several runs."""
    if isinstance(specification, MemberRuns):
        return member_row(specification)
    if isinstance(specification, ParameterRuns):
        return parameter_row(specification, measured_row)
    if isinstance(specification, StartRuns):
        return start_row(specification, timed)
    row = measured_row(specification)
    return with_time(specification, row) if specification.repeat else row


def measured_row(specification: GridRun) -> Row:
    """Return the row of a run without its time: names, numbers asked for, work, and why it failed where it did.

    A run that failed, took no step, or was looked at twice has NaN where numbers would be, and says why: a row is never left out. Ctrl-C
    leaves none: what somebody did not wait for is no failure of the method.

    The work of a tolerance-driven run is that of the run that is looked at, in which some methods evaluate more for each output.
    """
    row: Row = {
        "problem": specification.problem,
        "case": specification.case,
        "method": specification.method,
        "knob": "",
        "value": specification.value,
        **dict(specification.parameters),
        **dict(specification.options),
        "precision": specification.precision,
        "compensated": specification.compensated,
        "sweeps": specification.sweeps,
        "newton": specification.newton,
        "t_end": specification.t_end,
        **({"start": specification.start} if specification.spread else {}),
    }
    metrics = metrics_of(specification.metrics)
    row |= {column: math.nan for metric in metrics for column in metric.columns}
    row |= {"reference": ""} if any(metric.certified for metric in metrics) else {}
    row |= {"steps": 0, "seconds": math.nan, "callback_seconds": math.nan, "t_reached": 0.0, "failure": ""}
    try:
        ivp, solver = specification.ivp, specification.solver
        row["knob"] = solver.knob
        run = solver.solve(ivp, specification.asked(solver.knob))
        row |= {f"n_{kind}": count for kind, count in run.work.items()}
        row |= {"steps": run.steps, "t_reached": float(run.t[-1]), "failure": run.failure or ""}
        measured = Measured(specification, ivp, solver, run)
        if not measured.told:
            nothing = f"{run.steps} steps and {len(run.t)} states tell nothing; take a smaller {solver.knob} or more outputs"
            row["failure"] = row["failure"] or nothing
            return row
        for metric in metrics:
            if metric.measures(solver):
                row |= metric.measure(measured)
                row |= {"reference": measured.against} if metric.certified else {}
    except DaebenchError as error:
        row["failure"] = str(error)
    return row


def with_time(specification: GridRun, row: Row) -> Row:
    """Return the row of a run with its time, and the work of the run that is timed; a row of a run that failed is as it was."""
    if row["failure"]:
        return row
    try:
        return row | timed(specification, specification.solver, specification.ivp)
    except DaebenchError as error:
        return row | {"failure": str(error)}


def timed(specification: GridRun, solver: Any, ivp: InitialValueProblem) -> Row:
    """Return the least time of several runs that watch and keep nothing, of one if it is long; the run that was looked at has warmed up.

    Of a run by tolerance it returns the work as well: solvers count their calls in any case, and each output that DOP853 interpolates
    takes some, so that time and work are of the same run. IDA, CVODE, heyoka and solve_dae interpolate by what they have.
    """
    request, best = timed_request(specification, solver.knob), None
    for _ in range(specification.repeat):
        run = solver.solve(ivp, request)
        if run.failure is None and (best is None or run.seconds < best.seconds):
            best = run
        if run.seconds > LONG:
            break
    if best is None:
        return {}
    inside = best.callback_seconds
    work = {f"n_{kind}": count for kind, count in best.work.items()}
    return {**work, "seconds": best.seconds, "callback_seconds": math.nan if inside is None else inside}


def timed_request(specification: GridRun, resolution: str) -> Request:
    """Return the request for a timed run of this resolution: its end alone, nothing monitored, and no costly work counted."""
    if resolution == "h":
        return replace(specification.asked(resolution), watch=(), count=False, every=0)
    return replace(specification.asked(resolution), watch=(), points=2)
