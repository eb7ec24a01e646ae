"""Runs of a study made once each, here or in batches by an executor: what the store has is not made again."""

import platform
import sys
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from pathlib import Path

from daebench.errors import BadInput, DaebenchError
from daebench.methods.outside.process import remember
from daebench.methods.outside.read import is_outside
from daebench.records.code import code_version
from daebench.records.rows import StoredRow
from daebench.records.store import Store
from daebench.studies.grid.measure import row_of, stored_row
from daebench.studies.grid.run_specification import GridRun, Row
from daebench.studies.grid.schedulers import has_workers, workers_of
from daebench.studies.grid.specification import key_of, require_row
from daebench.systems.files.execute import is_path
from daebench.systems.lazily import pandas as pd

MOMENT = 0.1
"""Seconds that a batch should take: handing it out costs a hundredth of that, and no more is lost with what computes it."""

MOST = 64
"""Most runs of a batch."""

AHEAD = 2
"""Batches under way for each process: one that it computes, and one that waits for it."""

GLANCE = 1.0
"""Seconds between looks at whether a cluster still has workers."""

UNATTENDED_SECONDS = 60.0
"""How long a cluster may have no workers before a study gives up."""

Entry = tuple[str, GridRun]
Batch = tuple[StoredRow, ...]


def rows_in_batches(specifications: Mapping[str, GridRun], executor: Executor) -> Iterator[Batch]:
    """Give the rows of runs with their keys, batch by batch as they are done; where one is lost, those that were done before it."""
    left = list(specifications.items())[::-1]
    workers, size = workers_of(executor), 1
    running: dict[Future[Batch], list[Entry]] = {}
    try:
        while left or running:
            while left and len(running) < AHEAD * workers:
                batch = [left.pop() for _ in range(min(size, 1 + len(left) // (AHEAD * workers)))]
                running[executor.submit(rows_of, batch, code_version())] = batch
            for future in sorted(_done(running, executor), key=_failed):
                rows = _result(future, running.pop(future))
                size = max(1, min(MOST, int(len(rows) * MOMENT / max(sum(row.took for row in rows), 1e-9))))
                yield rows
    finally:
        for future in running:
            future.cancel()


def _done(running: Iterable[Future[Batch]], executor: Executor) -> set[Future[Batch]]:
    """Wait for batches that are done; no longer than :data:`UNATTENDED_SECONDS` where nobody computes them."""
    deserted = None
    while True:
        done, _ = wait(running, timeout=GLANCE, return_when=FIRST_COMPLETED)
        if done:
            return done
        if has_workers(executor):
            deserted = None
        elif deserted is None:
            deserted = time.monotonic()
            warnings.warn(f"the Dask cluster has no workers any more; waiting {UNATTENDED_SECONDS:g} s for one.", stacklevel=2)
        elif time.monotonic() - deserted > UNATTENDED_SECONDS:
            raise DaebenchError(
                f"the Dask cluster has had no workers for {UNATTENDED_SECONDS:g} s; earlier results are stored: start some, and run again.",
                "cluster-lost-workers",
            )


def rows_of(batch: Sequence[Entry], made_by: str) -> Batch:
    """Return the rows of runs by their keys; raise BadInput if this process would make them with something else than the keys say.

    ``made_by`` is the :func:`daebench.records.code.code_version` of the process that made the keys.
    """
    if code_version() != made_by:
        worker = f"a worker on {platform.node() or 'another machine'}"
        raise BadInput(
            f"{worker} has another version of daebench, NumPy or another library than the study; install the same there.",
            "worker-of-other-version",
        )
    return tuple(stored_row(key, specification) for key, specification in batch)


def _failed(future: Future[Batch]) -> bool:
    return future.cancelled() or future.exception() is not None


def _result(future: Future[Batch], batch: Sequence[Entry]) -> Batch:
    try:
        return future.result()
    except _losses() as error:
        specification = batch[0][1]
        raise DaebenchError(
            f"the process that computed {specification.method} on {specification.problem} is lost ({type(error).__name__}); "
            "earlier results are stored: run again.",
            "worker-lost",
        ) from error


def _losses() -> tuple[type[BaseException], ...]:
    """Return the exceptions that stand for a worker that ended; Dask's own is known where Dask is used."""
    dask = sys.modules.get("distributed")
    return (BrokenExecutor, CancelledError, OSError, *((dask.KilledWorker,) if dask else ()))


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
