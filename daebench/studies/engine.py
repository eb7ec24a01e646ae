"""Cells computed once each: what the store has is not computed again, and what is computed is stored before anything else happens."""

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from concurrent.futures.process import BrokenProcessPool

from daebench.errors import DaebenchError
from daebench.studies.cell import Cell
from daebench.studies.measure import Row, row_of
from daebench.studies.store import Store

Tell = Callable[[int, int, Cell], None]
"""Told how many cells are done, of how many, and which is the last of them."""

AHEAD = 4
"""Cells that wait for a process, for each one: enough for none to be idle, and few enough to be given up at once."""


def computed(cells: Sequence[Cell], store: Store, *, executor: Executor | None = None, tell: Tell | None = None) -> dict[str, Row]:
    """Return the row of every cell, by its key; those that the store has not are computed and put there.

    Parameters
    ----------
    cells : sequence of Cell
        What is wanted.
    store : Store
        Where rows are kept.
    executor : Executor, optional
        What computes them; without one they are computed in this process, one after the other.
    tell : callable, optional
        Told of progress.
    """
    wanted = {cell.key(): cell for cell in cells}
    found: dict[str, Row] = {}
    missing: dict[str, Cell] = {}
    for key, cell in wanted.items():
        row = store.get(key)
        if row is None:
            missing[key] = cell
        else:
            found[key] = row
    for key, row in _rows(missing, executor):
        store.put(key, wanted[key].plain(), row)
        found[key] = row
        if tell:
            tell(len(found), len(wanted), wanted[key])
    return {key: found[key] for key in wanted}


def _rows(cells: Mapping[str, Cell], executor: Executor | None) -> Iterator[tuple[str, Row]]:
    if executor is None:
        for key, cell in cells.items():
            yield key, row_of(cell)
        return
    yield from _from_others(cells, executor)


def _from_others(cells: Mapping[str, Cell], executor: Executor) -> Iterator[tuple[str, Row]]:
    """Give rows as they are done, with a few cells under way at any time."""
    left, ahead = iter(cells.items()), AHEAD * max(1, getattr(executor, "_max_workers", os.cpu_count() or 1))
    running: dict[Future[Row], str] = {}
    try:
        while True:
            while len(running) < ahead and (entry := next(left, None)):
                running[executor.submit(row_of, entry[1])] = entry[0]
            if not running:
                return
            done, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in done:
                key = running.pop(future)
                yield key, _result(future, cells[key])
    finally:
        for future in running:
            future.cancel()


def _result(future: "Future[Row]", cell: Cell) -> Row:
    try:
        return future.result()
    except BrokenProcessPool as error:
        raise DaebenchError(
            f"a process that computes cells ended while {cell.method} ran on {cell.problem}; what was done is kept: run again."
        ) from error
