"""Runs from many starts, computed: errors of fixed steps of all members at once, of other methods one by one, and what a run costs."""

import json
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from daebench.errors import DaebenchError
from daebench.methods.ensemble.run import run_members
from daebench.runs.ivp import Array, InitialValueProblem
from daebench.runs.members import Members
from daebench.runs.request import Request
from daebench.starts.draw import draw_starts
from daebench.starts.members import Starts
from daebench.studies.ensemble.references import MemberReferences, member_references
from daebench.studies.grid.parameter_rows import made_together
from daebench.studies.grid.run_specification import Where, ivp_of
from daebench.studies.grid.start_runs import StartRuns

NAN = float("nan")

Row = dict[str, Any]

FEW_STEPS = 200_000
"""Steps of all members up to which they run one after another: to compile a kernel for several at once takes longer than these steps."""

TIMED = 5
"""Starts from which a method with fixed steps is timed."""

Timed = Callable[[InitialValueProblem], Mapping[str, Any]]
"""Returns columns of work and time of a run by itself."""


def members_of(specification: StartRuns) -> Members:
    """Return the members of runs from many starts, whose step size is not theirs."""
    return starts_of(specification).members


def starts_of(specification: StartRuns) -> Starts:
    """Return the starts with the sentence that says how they are drawn."""
    settings = specification.distribution, specification.settings, specification.members, specification.seed
    return _starts(specification.where, *settings)


def references_of(specification: StartRuns) -> MemberReferences:
    """Return the references of their errors, see :func:`daebench.studies.ensemble.references.member_references`."""
    settings = specification.distribution, specification.settings, specification.members, specification.seed
    return _references(specification.where, *settings, specification.t_end, specification.outputs, specification.finest)


@lru_cache(maxsize=4)
def _starts(where: Where, distribution: str, settings: str, members: int, seed: int) -> Starts:
    return draw_starts(ivp_of(*where), distribution, members=members, h=1.0, seed=seed, **json.loads(settings))


@lru_cache(maxsize=4)
def _references(
    where: Where, distribution: str, settings: str, members: int, seed: int, t_end: float, outputs: int, h: float
) -> MemberReferences:
    return member_references(_starts(where, distribution, settings, members, seed).members, t_end, outputs, h)


def start_row(specification: StartRuns, timed: Callable[[StartRuns, Any, InitialValueProblem], Row]) -> Row:
    """Return the outcome of the runs: lists with an entry for each start.

    Columns are error_q and bound_q, ..., steps, failure, and seconds. Of a method that runs members together all have the same cost: the
    median time of runs by themselves from the first :data:`TIMED` starts that come to their end, after one that warms up, with
    seconds_least and seconds_most; others have the time and counts n_... of work of each run. ``timed`` returns these of one run.
    """
    solver, reference = specification.solver, references_of(specification)
    common = {name: getattr(specification, name) for name in ("problem", "case", "method", "value", "t_end")}
    row: Row = common | dict(specification.parameters) | {"knob": solver.knob, "reference": reference.words}
    columns = _together if made_together(solver, specification.ivp) else _one_by_one
    return row | columns(specification, solver, reference, lambda ivp: timed(specification, solver, ivp))


def errors(states: Mapping[str, Array], reference: MemberReferences, parts: Sequence[str]) -> dict[str, Array]:
    """Return the largest error of a component of each member, shape(n,), by column; NaN where a member stopped, and the bounds."""
    columns = {}
    for part in parts:
        columns[f"error_{part}"] = np.max(np.abs(states[part] - reference.states[part]), axis=(0, 2))
        columns[f"bound_{part}"] = reference.bound[part]
    return columns


def _together(specification: StartRuns, solver: Any, reference: MemberReferences, timed: Timed) -> Row:
    """Return the columns of a method with fixed steps."""
    some, h, outputs = members_of(specification), specification.value, specification.outputs
    every = round(specification.t_end / outputs / h)
    asked = Request(value=h, steps=every * outputs, every=every, watch=(), count=False)
    few = len(some) * every * outputs <= FEW_STEPS
    run = run_members(solver, Members(some.ivp, some.start, h, some.parameters), asked, lanes=1 if few else None)
    states = dict(zip(reference.states, some.ivp.vectors(run.states), strict=True))
    columns: Row = {name: values.tolist() for name, values in errors(states, reference, specification.metrics).items()}
    columns |= {"steps": run.steps.tolist(), "failure": [run.reason(i) for i in range(len(some))]}
    ended = np.flatnonzero(run.status == 0)
    return columns | _price([float(timed(some.member(int(i))).get("seconds", NAN)) for i in [*ended[:1], *ended[:TIMED]]][1:])


def _price(times: list[float]) -> Row:
    """Return the columns of the cost that runs have in common: the median of some times, the least of them and the most."""
    known = sorted(seconds for seconds in times if np.isfinite(seconds)) or [NAN]
    return {"seconds": float(np.median(known)), "seconds_least": known[0], "seconds_most": known[-1]}


def _one_by_one(specification: StartRuns, solver: Any, reference: MemberReferences, timed: Timed) -> Row:
    """Return the columns of any other method."""
    some = members_of(specification)
    rows = [_alone(specification, solver, reference, i, some.member(i), timed) for i in range(len(some))]
    names = dict.fromkeys(name for row in rows for name in row)
    return {name: [row.get(name, NAN) for row in rows] for name in names}


def _alone(specification: StartRuns, solver: Any, reference: MemberReferences, i: int, ivp: InitialValueProblem, timed: Timed) -> Row:
    """Return the row of one start."""
    row: Row = {f"{what}_{part}": NAN for part in specification.metrics for what in ("error", "bound")}
    row |= {f"bound_{part}": float(reference.bound[part][i]) for part in specification.metrics}
    row |= {"steps": 0, "failure": "", "seconds": NAN}
    try:
        run = solver.solve(ivp, specification.asked(solver.knob))
        row |= {"steps": run.steps, "failure": run.failure or ""}
        if not run.failure:
            for part in specification.metrics:
                off = np.asarray(getattr(run, part)) - reference.states[part][:, i]
                row[f"error_{part}"] = float(np.max(np.abs(off)))
            row |= timed(ivp)
    except DaebenchError as error:
        row["failure"] = str(error)
    return row
