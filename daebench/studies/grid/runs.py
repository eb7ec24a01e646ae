"""The rows of cells as a table, in the order in which they are asked for."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from typing import TYPE_CHECKING

from daebench.studies.grid.run_specification import Cell
from daebench.studies.grid.specification_key import key_of
from daebench.studies.grid.store import Store

if TYPE_CHECKING:
    import pandas as pd

    from daebench.studies.grid.engine import Tell

Runs = Callable[[Sequence[Cell]], "pd.DataFrame"]
"""Makes the rows of cells, in their order."""


def runs_of(store: Store, *, executor: Executor | None = None, tell: "Tell | None" = None) -> Runs:
    """Return what makes the rows of cells: those that the store has are taken from there."""

    def runs(cells: Sequence[Cell]) -> "pd.DataFrame":
        import pandas as pd

        from daebench.studies.grid.engine import computed

        rows = computed(cells, store, executor=executor, tell=tell)
        return pd.DataFrame([rows[key_of(cell)] for cell in cells])

    return runs
