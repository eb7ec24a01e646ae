"""Rows of runs that are made together: over values of a parameter as members of an ensemble, or from many starts that are drawn."""

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.errors import DaebenchError
from daebench.methods.ensemble.result import EnsembleRun
from daebench.methods.ensemble.run import run_members
from daebench.methods.fixed_step.base import FixedStepMethod
from daebench.runs.ivp import Array, InitialValueProblem, Ivp
from daebench.runs.members import Members, members
from daebench.runs.request import Request
from daebench.starts.draw import draw_starts
from daebench.starts.members import Starts
from daebench.studies.ensemble.energies import along_run, ended_members, energy_columns
from daebench.studies.ensemble.references import MemberReferences, member_references
from daebench.studies.grid.run_specification import FEWEST, GridRun, ParameterRuns, Row, StartRuns, Where, ivp_of
from daebench.studies.held_verdict import held_verdicts

NUMBERS = 2**22
"""Numbers of states that are in memory at a time."""

Indices = NDArray[np.int64]


def made_together(solver: Any, ivp: Ivp) -> bool:
    """Return whether runs of a method are made as members of an ensemble: those of fixed steps on problems without arrays are."""
    return isinstance(solver, FixedStepMethod) and not ivp.arrays and not ivp.singular


def parameter_row(specification: ParameterRuns, alone: Callable[[GridRun], Row]) -> Row:
    """Return the outcome of the runs: a list in each of their columns.

    A run that cannot be begun, or has numbers that are not finite, is made by itself by ``alone``, which says why; so are all runs of
    methods that do not run members of ensembles.
    """
    common = {name: getattr(specification, name) for name in ("problem", "case", "method", "value", "t_end")}
    columns: dict[str, list[Any]] = {name: [None] * len(specification.values) for name in specification.columns}
    done = np.zeros(len(specification.values), dtype=bool)
    for which, some in _ensembles(specification):
        for name, values in some.items():
            for i, value in zip(which.tolist(), values, strict=True):
                columns[name][i] = value
        done[which] = True
    for i in np.flatnonzero(~done).tolist():
        row = alone(specification.run(i))
        for name, column in columns.items():
            column[i] = row[name]
    return {**common, **columns}


def _ensembles(specification: ParameterRuns) -> Iterator[tuple[Indices, Row]]:
    """Give the outcomes of runs as members of ensembles, no larger than memory allows: which runs these are, and their columns."""
    try:
        solver, begun = specification.solver, _begun_of(specification)
        if begun is None or not made_together(solver, begun.ivp) or specification.precision != "float64":
            return
        grid = solver.grid(begun.ivp, specification.asked("h"))
    except DaebenchError:
        return  # a run by itself says why
    if grid.rows + 1 < FEWEST:
        return
    asked = Request(value=grid.h, steps=grid.steps, every=grid.every, count=False)
    at_once = max(1, NUMBERS // (grid.rows * begun.ivp.size))
    for k in range(0, len(begun.which), at_once):
        which, start = begun.which[k : k + at_once], tuple(vectors[k : k + at_once] for vectors in begun.start)
        values = np.array(specification.values)[which]
        run = run_members(solver, members(begun.ivp, start, grid.h, {specification.varied: values}), asked, threads=1)
        yield which[run.failed], _stopped(specification, run)
        if len(ended := ended_members(run)):
            with np.errstate(all="ignore"):  # a run that has lost its motion may have squares beyond all numbers
                columns = _measured(specification, run, ended)
                if "energy_verdict" in columns:
                    columns["energy_verdict"] = held_verdicts(columns["energy_verdict"], run, ended, solver, asked, threads=1)
            yield which[ended], columns


@dataclass(frozen=True)
class _Begun:
    """The runs that can be begun: the initial value problem of the first, which they are, and their starts."""

    ivp: Ivp
    which: Indices
    start: tuple[Array, ...]


def _begun_of(specification: ParameterRuns) -> _Begun | None:
    return _begun(specification.where, specification.varied, specification.values)


@lru_cache(maxsize=4)
def _begun(where: Where, varied: str, values: tuple[float, ...]) -> _Begun | None:
    """Return the runs that can be begun, or None; runs with other step sizes have the same starts, which are made once."""
    problem, case, parameters, *others = where
    problems = {}
    for i, value in enumerate(values):
        with suppress(DaebenchError):  # such a run by itself says why
            problems[i] = ivp_of(problem, case, (*parameters, (varied, value)), *others)
    if not problems:
        return None
    starts = zip(*(ivp.start for ivp in problems.values()), strict=True)
    return _Begun(next(iter(problems.values())), np.array(list(problems)), tuple(map(np.array, starts)))


def _stopped(specification: ParameterRuns, run: EnsembleRun) -> Row:
    """Return the columns of the runs that stopped early, which have no numbers."""
    nothing: Row = {name: [math.nan] * len(run.failed) for name in specification.columns}
    return nothing | {"steps": run.steps[run.failed].tolist(), "failure": [run.failure(int(i)) for i in run.failed]}


def _measured(specification: ParameterRuns, run: EnsembleRun, ended: Indices) -> Row:
    """Return the columns of runs that came to their end."""
    t, along = along_run(run, ended)
    columns: Row = {"steps": run.steps[ended].tolist(), "failure": [""] * len(ended)}
    if "energy" in specification.metrics:
        columns |= energy_columns(t, along, run.maxima["energy"][ended], int(run.index[-1]))
    if "manifold" in specification.metrics:
        columns |= {name: run.maxima[name][ended].tolist() for name in ("g", "Gv")}
    if "jump" in specification.metrics:
        every_step = len(t) > run.index[-1] and run.members.ivp.on_manifold
        columns["jump"] = along.jump.tolist() if every_step else [math.nan] * len(ended)
    return columns


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
    return columns | _price([float(timed(some.member(int(i))).get("seconds", math.nan)) for i in [*ended[:1], *ended[:TIMED]]][1:])


def _price(times: list[float]) -> Row:
    """Return the columns of the cost that runs have in common: the median of some times, the least of them and the most."""
    known = sorted(seconds for seconds in times if np.isfinite(seconds)) or [math.nan]
    return {"seconds": float(np.median(known)), "seconds_least": known[0], "seconds_most": known[-1]}


def _one_by_one(specification: StartRuns, solver: Any, reference: MemberReferences, timed: Timed) -> Row:
    """Return the columns of any other method."""
    some = members_of(specification)
    rows = [_alone(specification, solver, reference, i, some.member(i), timed) for i in range(len(some))]
    names = dict.fromkeys(name for row in rows for name in row)
    return {name: [row.get(name, math.nan) for row in rows] for name in names}


def _alone(specification: StartRuns, solver: Any, reference: MemberReferences, i: int, ivp: InitialValueProblem, timed: Timed) -> Row:
    """Return the row of one start."""
    row: Row = {f"{what}_{part}": math.nan for part in specification.metrics for what in ("error", "bound")}
    row |= {f"bound_{part}": float(reference.bound[part][i]) for part in specification.metrics}
    row |= {"steps": 0, "failure": "", "seconds": math.nan}
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
