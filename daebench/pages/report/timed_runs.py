"""Runs of a report put into its store: looked at in two processes, which compile what they need, and then timed in this one, alone."""

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager
from dataclasses import replace

from daebench.errors import DaebenchError
from daebench.pages.report.deferred import meanwhile
from daebench.pages.report.page import Progress
from daebench.pages.report.two_processes import two_processes
from daebench.records.code import code_version
from daebench.records.rows import StoredRow
from daebench.records.store import Store
from daebench.studies.grid.measure import timed_request, with_time
from daebench.studies.grid.run_specification import GridRun
from daebench.studies.grid.runs import computed
from daebench.studies.grid.specification import key_of

Processes = Callable[[], AbstractContextManager[Executor]]

STEPS = 3
"""Steps of no consequence that have kernels compiled or read."""

LOOKED, COMPILED = 0.5, 0.6
"""Parts of the work that are done when all runs are looked at, and when what is timed is compiled."""


def make_runs(specifications: Iterable[GridRun], store: Store, tell: Progress, processes: Processes = two_processes) -> None:
    """Put the rows of runs that a store has not there; nothing else runs where time is measured.

    A row without its time is kept as well, as that of the same run with no repetition, so that what is interrupted goes on from there.
    """
    missing = {key: specification for specification in specifications if (key := key_of(specification)) not in store}
    if not missing:
        return
    looked = {key: replace(specification, repeat=0) for key, specification in missing.items()}
    timed = {key: specification for key, specification in missing.items() if specification.repeat}
    with processes() as pool:
        # One long run at the end would keep one process busy and the other waiting.
        dearest_first = sorted(looked.values(), key=lambda specification: specification.value)

        def look(done: int, of: int, specification: GridRun) -> None:
            tell(LOOKED * done / len(looked), doing(specification))

        computed(first_of_each(dearest_first), store, executor=pool, tell=look)  # what one compiles here, no other process compiles below
        rows = computed(dearest_first, store, executor=pool, tell=look)
        tell(LOOKED, "kernels")
        kernels = [pool.submit(warm, specification) for specification in first_of_each(timed.values())]
        meanwhile(kernels)
        for kernel in kernels:
            kernel.result()
    warmed = set(map(_kind, first_of_each(timed.values())))
    for k, (key, specification) in enumerate(timed.items()):
        if _kind(specification) in warmed:
            warm(specification)
            warmed.remove(_kind(specification))
        began = time.perf_counter()
        row = with_time(specification, rows[key_of(looked[key])])
        store.put([StoredRow(key, specification.plain(), row, code_version(), time.perf_counter() - began)])
        tell(COMPILED + (1 - COMPILED) * (k + 1) / len(timed), doing(specification))


def doing(specification: GridRun) -> str:
    """Return the run that is being made, in a few words."""
    return f"{specification.method} on {specification.problem}, {specification.value:g}"


def first_of_each(specifications: Iterable[GridRun]) -> Sequence[GridRun]:
    """Return the last run of each kind that has machine code of its own."""
    cell_by_kind: Mapping[GridRun, GridRun] = {_kind(specification): specification for specification in specifications}
    return list(cell_by_kind.values())


def _kind(specification: GridRun) -> GridRun:
    return replace(specification, value=1.0, t_end=1.0, parameters=(), outputs=0, metrics=())


def warm(specification: GridRun) -> None:
    """Take a few steps as they are timed; a run that fails is left to the process that reports why."""
    try:
        solver = specification.solver
        t_end = STEPS * specification.value if solver.knob == "h" else specification.t_end / 1000
        solver.solve(specification.ivp, replace(timed_request(specification, solver.knob), t_end=t_end))
    except DaebenchError:
        return
