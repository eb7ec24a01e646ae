"""Where cells are computed besides this process: processes of this machine, or the workers of a Dask cluster."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing.context import BaseContext

from daebench.errors import BadInput

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
"""What numerical libraries read: one thread for each process."""

LOADED = ("numba", "scipy.linalg", "daebench.studies.shares")
"""What every process needs, loaded once by the server that they are forked from."""

REACHED_SECONDS = 10.0
"""How long a scheduler may take to answer."""


@contextmanager
def local_processes(workers: int | None = None) -> Iterator[Executor]:
    """Open a pool of processes on this machine, one thread each; they end with the block, whatever ends it, and with this process."""
    workers = workers or cores()
    old = {name: os.environ.get(name) for name in THREADS}
    os.environ |= dict.fromkeys(THREADS, "1")
    before = set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(workers, mp_context=_context(), initializer=_begin_process)
    try:
        yield pool
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
        for process in set(multiprocessing.active_children()) - before:
            process.terminate()
        for name, value in old.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _context() -> BaseContext:
    """Return how processes are begun: forked from a server that begins to load now what all of them need, where there is one."""
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    from multiprocessing.forkserver import ensure_running

    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(list(LOADED))
    ensure_running()
    return context


def _begin_process() -> None:
    """Leave Ctrl-C to the process that hands out cells, and end with it even where it is killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if parent := multiprocessing.parent_process():

        def end_with_parent() -> None:
            parent.join()
            os._exit(1)

        threading.Thread(target=end_with_parent, daemon=True).start()


def workers_of(executor: Executor) -> int:
    """Return how many calls an executor makes at a time; Dask's has a client that tells."""
    if client := getattr(executor, "_client", None):
        threads: dict[str, int] = client.nthreads()
        return sum(threads.values()) or 1
    told: int | None = getattr(executor, "_max_workers", None) or getattr(executor, "num_workers", None)
    return told or os.cpu_count() or 1


@contextmanager
def dask_cluster(address: str) -> Iterator[Executor]:
    """Connect to the scheduler of a Dask cluster; its workers need this version of daebench, and cells that a lost one had go to others.

    Raises
    ------
    BadInput
        If Dask is not installed, or there is no scheduler at the address.
    """
    try:
        from distributed import Client
    except ImportError as error:
        raise BadInput("a scheduler takes Dask; install it by: pip install 'daebench[scale]'.") from error
    try:
        client = Client(address, timeout=REACHED_SECONDS, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise BadInput(f"there is no Dask scheduler at {address}: {error}; start one by: dask scheduler.") from error
    try:
        yield client.get_executor(pure=False)
    finally:
        client.close()
