"""Runs of a study made once each: what the store has is not made again, and what is made is stored before anything else happens."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from typing import TYPE_CHECKING

from daebench.studies.grid.batches import Batch, rows_in_batches
from daebench.studies.grid.measure import Row, stored_row
from daebench.studies.grid.run_specification import Cell
from daebench.studies.grid.specification_key import key_of
from daebench.studies.grid.store import Store

if TYPE_CHECKING:
    import pandas as pd

Runs = Callable[[Sequence[Cell]], "pd.DataFrame"]
"""Makes the rows of cells, in their order."""

Tell = Callable[[int, int, Cell], None]
"""Told how many cells are done, of how many, and which is the last of them."""


def runs_of(store: Store, *, executor: Executor | None = None, tell: Tell | None = None) -> Runs:
    """Return what makes the rows of cells: those that the store has are taken from there."""

    def runs(cells: Sequence[Cell]) -> "pd.DataFrame":
        import pandas as pd

        rows = computed(cells, store, executor=executor, tell=tell)
        return pd.DataFrame([rows[key_of(cell)] for cell in cells])

    return runs


def computed(cells: Sequence[Cell], store: Store, *, executor: Executor | None = None, tell: Tell | None = None) -> dict[str, Row]:
    """Return the row of every cell, by its key; those that the store has not are computed and put there.

    Without an executor they are computed in this process, one after the other.
    """
    wanted = {key_of(cell): cell for cell in cells}
    found: dict[str, Row] = {}
    missing: dict[str, Cell] = {}
    for key, cell in wanted.items():
        row = store.get(key)
        if row is None:
            missing[key] = cell
        else:
            found[key] = row | {name: cell.problem for name in ("problem",) if name in row}  # its file may have been elsewhere
    for rows in rows_in_batches(missing, executor) if executor else _here(missing):
        store.put(rows)
        for each in rows:
            found[each.key] = dict(each.row)
            if tell:
                tell(len(found), len(wanted), wanted[each.key])
    return {key: found[key] for key in wanted}


def _here(cells: Mapping[str, Cell]) -> Iterator[Batch]:
    """Give the rows of cells one by one, computed in this process."""
    for key, cell in cells.items():
        yield (stored_row(key, cell),)
