"""Cells handed out to an executor in shares: as many to a share as take a moment, and a few shares ahead of those that compute."""

import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait

from daebench.errors import BadInput, DaebenchError
from daebench.studies.cell import Cell, made_by
from daebench.studies.measure import Row, row_of
from daebench.studies.schedulers import workers_of

MOMENT = 0.1
"""Seconds that a share should take: handing it out costs a hundredth of that, and no more is lost with what computes it."""

MOST = 64
"""Most cells of a share."""

AHEAD = 2
"""Shares under way for each process: one that it computes, and one that waits for it."""

Entry = tuple[str, Cell]
Computed = tuple[str, Row]
Share = tuple[Computed, ...]


def handed_out(cells: Mapping[str, Cell], executor: Executor) -> Iterator[Share]:
    """Give the rows of cells with their keys, share by share as they are done; where one is lost, those that were done before it.

    Raises
    ------
    BadInput
        If one that computes has another version of daebench or of a library.
    DaebenchError
        If one that computes is lost, and its cells with it.
    """
    left = list(cells.items())[::-1]
    workers, size = workers_of(executor), 1
    running: dict[Future[tuple[Share, float]], list[Entry]] = {}
    try:
        while left or running:
            while left and len(running) < AHEAD * workers:
                share = [left.pop() for _ in range(min(size, 1 + len(left) // (AHEAD * workers)))]
                running[executor.submit(rows_of, share, made_by())] = share
            done, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in sorted(done, key=_failed):
                rows, seconds = _result(future, running.pop(future))
                size = max(1, min(MOST, int(len(rows) * MOMENT / max(seconds, 1e-9))))
                yield rows
    finally:
        for future in running:
            future.cancel()


def rows_of(share: Sequence[Entry], maker: str) -> tuple[Share, float]:
    """Return the rows of a share, and how long they took, s.

    Parameters
    ----------
    share : sequence of (str, Cell)
        Cells by their keys.
    maker : str
        What those keys say made the rows, see :func:`daebench.studies.cell.made_by`.

    Raises
    ------
    BadInput
        If this process would make them with something else.
    """
    if made_by() != maker:
        raise BadInput(f"{_host()} has another version of daebench, numba or another library than the study; install the same there.")
    began = time.perf_counter()
    return tuple((key, row_of(cell)) for key, cell in share), time.perf_counter() - began


def _host() -> str:
    import platform

    return f"a worker on {platform.node() or 'another machine'}"


def _failed(future: "Future[tuple[Share, float]]") -> bool:
    return future.cancelled() or future.exception() is not None


def _result(future: "Future[tuple[Share, float]]", share: Sequence[Entry]) -> tuple[Share, float]:
    try:
        return future.result()
    except _losses() as error:
        cell = share[0][1]
        raise DaebenchError(
            f"what computed {cell.method} on {cell.problem} is lost ({type(error).__name__}); what was done before is kept: run again."
        ) from error


def _losses() -> tuple[type[BaseException], ...]:
    """Return what is raised in place of a result by one that ended; Dask's own is known where Dask is used."""
    dask = sys.modules.get("distributed")
    return (BrokenExecutor, CancelledError, OSError, *((dask.KilledWorker,) if dask else ()))
