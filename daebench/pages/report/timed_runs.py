"""Runs of a report put into its store: looked at in two processes, which compile what they need, and then timed in this one, alone."""

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager
from dataclasses import replace

from daebench.errors import DaebenchError
from daebench.pages.report.page import Progress
from daebench.pages.report.two_processes import two_processes
from daebench.studies.grid.measure import timed_request, with_time
from daebench.studies.grid.run_specification import Cell, code_version
from daebench.studies.grid.runs import computed
from daebench.studies.grid.specification_key import key_of
from daebench.studies.grid.store import Store, StoredRow

Processes = Callable[[], AbstractContextManager[Executor]]

STEPS = 3
"""Steps of no consequence that have kernels compiled or read."""

LOOKED, COMPILED = 0.5, 0.6
"""Parts of the work that are done when all runs are looked at, and when what is timed is compiled."""


def make_runs(cells: Iterable[Cell], kept: Store, tell: Progress, processes: Processes = two_processes) -> None:
    """Put the rows of cells that a store has not there; nothing else runs where time is measured.

    A row without its time is kept as well, as that of the same cell with no repetition, so that what is interrupted goes on from there.

    Raises
    ------
    DaebenchError
        If a process is lost.
    """
    missing = {key: cell for cell in cells if (key := key_of(cell)) not in kept}
    if not missing:
        return
    looked = {key: replace(cell, repeat=0) for key, cell in missing.items()}
    timed = {key: cell for key, cell in missing.items() if cell.repeat}
    with processes() as pool:
        dearest_first = sorted(looked.values(), key=lambda cell: cell.value)
        rows = computed(dearest_first, kept, executor=pool, tell=lambda done, of, cell: tell(LOOKED * done / of, doing(cell)))
        tell(LOOKED, "kernels")
        for _ in pool.map(warm, first_of_each(timed.values())):
            pass
    warmed = set(map(_kind, first_of_each(timed.values())))
    for k, (key, cell) in enumerate(timed.items()):
        if _kind(cell) in warmed:
            warm(cell)
            warmed.remove(_kind(cell))
        began = time.perf_counter()
        row = with_time(cell, rows[key_of(looked[key])])
        kept.put([StoredRow(key, cell.plain(), row, code_version(), time.perf_counter() - began)])
        tell(COMPILED + (1 - COMPILED) * (k + 1) / len(timed), doing(cell))


def doing(cell: Cell) -> str:
    """Return what is being done, in a few words."""
    return f"{cell.method} on {cell.problem}, {cell.value:g}"


def first_of_each(cells: Iterable[Cell]) -> Sequence[Cell]:
    """Return one cell of each kind that has machine code of its own."""
    found: Mapping[Cell, Cell] = {_kind(each): each for each in cells}
    return list(found.values())


def _kind(cell: Cell) -> Cell:
    return replace(cell, value=1.0, t_end=1.0, parameters=(), outputs=0, metrics=())


def warm(cell: Cell) -> None:
    """Take a few steps as they are timed; what cannot be run fails here as it does where it is looked at, which says why."""
    try:
        solver = cell.solver
        t_end = STEPS * cell.value if solver.knob == "h" else cell.t_end / 1000
        solver.solve(cell.ivp, replace(timed_request(cell, solver.knob), t_end=t_end))
    except DaebenchError:
        return
