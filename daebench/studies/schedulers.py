"""Where cells are computed besides this process: processes of this machine, or the workers of a Dask cluster."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing.process import BaseProcess

from daebench.errors import BadInput

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
"""What numerical libraries read: one thread for each process."""

REACHED_SECONDS = 10.0
"""How long a scheduler may take to answer."""

LAST_SECONDS = 30.0
"""How long a process may take to end that is asked to: it may have something to write."""


@contextmanager
def local_processes(workers: int | None = None) -> Iterator[Executor]:
    """Open a pool of processes on this machine, one thread each; they end with the block or with this process, whatever ends it."""
    workers = workers or len(os.sched_getaffinity(0))
    old = {name: os.environ.get(name) for name in THREADS}
    os.environ |= dict.fromkeys(THREADS, "1")
    before = set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn"), initializer=_end_with_parent)
    try:
        yield pool
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
        children = set(multiprocessing.active_children()) - before
        for process in children:
            process.terminate()
        for process in children:
            process.join(LAST_SECONDS)
            process.kill()
        for name, value in old.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _end_with_parent() -> None:
    """Have this process leave Ctrl-C to its parent, and end when that does, even if it is killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_after, args=(parent,), daemon=True).start()


def _end_after(parent: BaseProcess) -> None:
    parent.join()
    os._exit(1)


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
