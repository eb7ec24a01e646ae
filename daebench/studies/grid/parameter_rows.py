"""Runs that differ in a parameter, computed: as members of an ensemble where the method can do that, and one by one where it cannot."""

from collections.abc import Callable, Iterator
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
from daebench.runs.ivp import Array, Ivp
from daebench.runs.members import members
from daebench.runs.request import Request
from daebench.studies.ensemble.energies import along_run, ended_members, energy_columns
from daebench.studies.grid.parameter_runs import ParameterRuns
from daebench.studies.grid.run_specification import FEWEST, GridRun, Where, ivp_of
from daebench.studies.held_verdict import held_verdicts

NUMBERS = 2**22
"""Numbers of states that are in memory at a time."""

NAN = float("nan")

Row = dict[str, Any]

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
    nothing: Row = {name: [NAN] * len(run.failed) for name in specification.columns}
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
        columns["jump"] = along.jump.tolist() if every_step else [NAN] * len(ended)
    return columns
