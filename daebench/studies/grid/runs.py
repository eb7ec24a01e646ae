"""Runs of a study made once each: what the store has is not made again, and what is made is stored before anything else happens."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path

from daebench.methods.outside.read import is_outside
from daebench.records.store import Store
from daebench.studies.grid.batches import Batch, rows_in_batches
from daebench.studies.grid.measure import Row, row_of, stored_row
from daebench.studies.grid.row_fields import require_row
from daebench.studies.grid.run_specification import GridRun
from daebench.studies.grid.specification_key import key_of
from daebench.systems.files.execute import is_path
from daebench.systems.lazily import pandas as pd

Runs = Callable[[Sequence[GridRun]], "pd.DataFrame"]
"""Makes the rows of runs, in their order."""

Tell = Callable[[int, int, GridRun], None]
"""Told how many runs are done, of how many, and which is the last of them."""


def runs_of(store: Store, *, executor: Executor | None = None, tell: Tell | None = None) -> Runs:
    """Return the function that makes the rows of runs: those that the store has are taken from there."""

    def runs(specifications: Sequence[GridRun]) -> "pd.DataFrame":

        rows = computed(specifications, store, executor=executor, tell=tell)
        return pd.DataFrame([_named(rows[key_of(specification)], specification) for specification in specifications])

    return runs


def unstored(specifications: Sequence[GridRun]) -> "pd.DataFrame":
    """Return the rows of runs, made in this process one after the other."""
    return pd.DataFrame([row_of(specification) for specification in specifications])


def computed(
    specifications: Sequence[GridRun], store: Store, *, executor: Executor | None = None, tell: Tell | None = None
) -> dict[str, Row]:
    """Return the row of every run, by its key; those that the store has not are computed and put there.

    Without an executor they are computed in this process, one after the other.
    """
    wanted = {key_of(specification): specification for specification in specifications}
    rows_by_key: dict[str, Row] = {}
    missing: dict[str, GridRun] = {}
    for key, specification in wanted.items():
        row = store.get(key)
        if row is None:
            missing[key] = specification
        else:
            require_row(specification, row)
            rows_by_key[key] = row
    for rows in rows_in_batches(missing, executor) if executor else _here(missing):
        store.put(rows)
        for entry in rows:
            rows_by_key[entry.key] = dict(entry.row)
            if tell:
                tell(len(rows_by_key), len(wanted), wanted[entry.key])
    for key, specification in wanted.items():
        if is_outside(specification.method):
            _remember_end(specification.method, rows_by_key[key])
    return {key: rows_by_key[key] for key in wanted}


def _remember_end(method: str, row: Row) -> None:
    """Note code from outside that ended its process, so that a command says so whether it ran now or is stored."""
    from daebench.methods.outside.process import remember

    if row["failure"]:
        remember(method, str(row["failure"]))


def _named(row: Row, specification: GridRun) -> Row:
    """Return a row under the name of the problem that is asked for, and of another file with the same problem if it was made for that."""
    other = row["problem"]
    return row | {"problem": specification.problem} | ({"made_for": other} if are_two_files(other, specification.problem) else {})


def are_two_files(one: str, other: str) -> bool:
    """Return whether two names are of different files, both of which are there: of a file that was moved only one is."""
    return one != other and all(is_path(name) and Path(name).is_file() for name in (one, other)) and not Path(one).samefile(other)


def _here(specifications: Mapping[str, GridRun]) -> Iterator[Batch]:
    """Give the rows of runs one by one, computed in this process."""
    for key, specification in specifications.items():
        yield (stored_row(key, specification),)
