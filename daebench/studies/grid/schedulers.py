"""Where runs are computed besides this process: processes of this machine, or the workers of a Dask cluster.

A study takes any executor of ``concurrent.futures``. One of mpi4py makes it run under MPI, with a process that hands out runs and
keeps their rows, and others that compute::

    # study_mpi.py; run by: mpiexec -n 9 python -m mpi4py.futures study_mpi.py
    from pathlib import Path

    from mpi4py.futures import MPIPoolExecutor

    from daebench.records.store import opened
    from daebench.studies.grid.study import Study

    if __name__ == "__main__":
        study = Study(problem="planar_pendulum", methods=["rattle"], values={"h": [0.1, 0.05]}, t_end=100.0)
        with opened(Path("studies.db")) as store, MPIPoolExecutor() as executor:
            table = study.table(store, executor=executor)

A Dask cluster and this machine may know each other by certificates: whoever reaches a scheduler runs code on its workers, and whoever
stands in for it on this machine, since a message of Dask is a pickle. With an address tls://host:port both sides show a certificate, and
each asks that one authority has signed it. The name of the host is not compared, so that the authority must be the cluster's own: with any
other, whoever gets a certificate from it is let in.
"""

import gc
import logging
import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import closing, contextmanager
from dataclasses import dataclass
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from multiprocessing.context import BaseContext
from pathlib import Path
from typing import Any

from daebench.errors import BadInput
from daebench.runs.machine import cores

OPTIONS = ("--tls-ca-file", "--tls-cert", "--tls-key")


@dataclass(frozen=True)
class Tls:
    """Files of certificates, in PEM."""

    ca_file: Path | None = None
    """Certificate of the cluster's own authority."""
    cert: Path | None = None
    """Certificate by which this machine is known."""
    key: Path | None = None
    """Its key; by default in the same file."""

    def __post_init__(self) -> None:
        if not self:
            return
        if self.ca_file is None or self.cert is None:
            raise BadInput(
                "--tls-ca-file and --tls-cert belong together: one identifies the cluster, the other this machine; give both.",
                "tls-files-incomplete",
            )
        for option, path in zip(OPTIONS, (self.ca_file, self.cert, self.key), strict=True):
            if path is not None and not path.is_file():
                raise BadInput(f"{option} {path}: there is no such file.", "no-such-tls-file")

    def __bool__(self) -> bool:
        """Return whether any file is given."""
        return any(path is not None for path in (self.ca_file, self.cert, self.key))


NO_TLS = Tls()
"""No files of certificates."""


def security(address: str, tls: Tls) -> Any:
    """Return the ``security`` of Dask's client: None for an address without encryption.

    Where no files are given, they are those that Dask's own configuration names, ``distributed.comm.tls``. BadInput is raised if there are
    certificates for an address without encryption, none for one with it, or they cannot be used.
    """
    if not address.startswith("tls://"):
        if tls:
            raise BadInput(
                f"{address} is without encryption, and certificates are given; its address must be tls://host:port.",
                "scheduler-not-encrypted",
            )
        return None
    from distributed import Security

    files = {"tls_ca_file": tls.ca_file, "tls_client_cert": tls.cert, "tls_client_key": tls.key or tls.cert} if tls else {}
    try:
        settings = Security(require_encryption=True, **{name: str(path) for name, path in files.items()})
        ready = settings.get_connection_args("client").get("ssl_context") is not None
    except (OSError, ValueError) as error:  # those of ssl are OSError too
        raise BadInput(
            f"the certificates for {address} cannot be used ({error}); give files in PEM that belong together.", "tls-certificates-unusable"
        ) from error
    if not ready:
        raise BadInput(
            f"{address} takes certificates; give --tls-ca-file, --tls-cert and --tls-key, or set Dask's distributed.comm.tls.",
            "scheduler-needs-certificates",
        )
    return settings


THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""What numerical libraries read: one thread for each process."""

LOADED = ("scipy.linalg", "daebench.compiler.machine", "daebench.compiler.trace.program", "daebench.studies.grid.runs")
"""What every process needs, loaded once by the server that they are forked from."""

COMPUTES = "daebench.studies.grid.runs"
"""What a worker needs: one that gets what it cannot load leaves the cluster without a word to us."""

REACHED_SECONDS = 10.0
"""How long a scheduler may take to answer."""

LAST_SECONDS = 30.0
"""How long a process may take to end that is asked to: it may have something to write."""


@contextmanager
def local_processes(workers: int | None = None, loaded: Sequence[str] = LOADED) -> Iterator[Executor]:
    """Open a pool of processes on this machine, one thread each; they end with the block, whatever ends it, and with this process.

    Parameters
    ----------
    workers : int, optional
        Number of processes; by default the cores that this process may use.
    loaded : sequence of str
        Modules that the server loads which all processes are forked from; those of the first pool of this process are in force for all.

    Yields
    ------
    Executor
        To be given to :meth:`daebench.studies.grid.study.Study.table`.

    Examples
    --------
    >>> from daebench.studies.grid.schedulers import local_processes
    >>> with local_processes(1, loaded=()) as pool:
    ...     list(pool.map(abs, [-2, 1]))
    [2, 1]
    """
    workers = workers or cores()
    old = {name: os.environ.get(name) for name in THREADS}
    os.environ |= dict.fromkeys(THREADS, "1")
    before = set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(workers, mp_context=_context(loaded), initializer=_begin_process)
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


def _context(loaded: Sequence[str]) -> BaseContext:
    """Return how processes are begun: forked from a server that begins to load now what all of them need, where there is one."""
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    from multiprocessing.forkserver import ensure_running

    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(list(loaded))
    ensure_running()
    return context


COLLECTED = (20_000, 50, 20)
"""Thresholds of garbage collection: a compiler and SymPy make many objects, of which few become garbage."""


def _begin_process() -> None:
    """Leave Ctrl-C to the process that hands out runs, end with it even where it is killed, and collect garbage less often."""
    gc.set_threshold(*COLLECTED)
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
    workers: int | None = getattr(executor, "_max_workers", None) or getattr(executor, "num_workers", None)
    return workers or os.cpu_count() or 1


def has_workers(executor: Executor) -> bool:
    """Return whether somebody computes what an executor is given: a Dask cluster may lose its workers, one after the other."""
    client = getattr(executor, "_client", None)
    try:
        return client is None or bool(client.nthreads())
    except (OSError, TimeoutError):
        return False


@contextmanager
def dask_cluster(address: str, tls: Tls = NO_TLS) -> Iterator[Executor]:
    """Connect to the scheduler of a Dask cluster; its workers need this version of daebench, and runs that a lost one had go to others.

    A cluster is code execution: whoever reaches its scheduler runs code on the workers, and one that is not what it says runs code here.

    Parameters
    ----------
    address : str
        Address of the scheduler: "tcp://127.0.0.1:8786", where everybody who reaches it is trusted, or tls://host:port.
    tls : Tls
        Certificates for tls://host:port; if none are given, those of Dask's configuration.

    Yields
    ------
    Executor
        To be given to :meth:`daebench.studies.grid.study.Study.table`.

    Raises
    ------
    BadInput
        If Dask is not installed, there is no scheduler at the address, it has no workers, one of them has no daebench, or certificates
        are missing or cannot be used.
    """
    try:
        from distributed import Client
    except ImportError as error:
        raise BadInput("a scheduler needs Dask; install it by: pip install 'daebench[scale]'.", "dask-missing") from error
    known_by = security(address, tls)
    try:
        client = Client(address, timeout=REACHED_SECONDS, set_as_default=False, security=known_by)
    except (OSError, TimeoutError, ValueError) as error:
        raise BadInput(f"there is no Dask scheduler at {address}: {error}; start one by: dask scheduler.", "no-dask-scheduler") from error
    with _silent("distributed.client", "distributed.core", "asyncio"), closing(client):
        try:
            client.wait_for_workers(1, timeout=REACHED_SECONDS)
        except TimeoutError as error:
            raise BadInput(
                f"the Dask scheduler at {address} has no workers; start some by: dask worker {address}.", "cluster-without-workers"
            ) from error
        specs = client.run(find_spec, COMPUTES, on_error="return")
        if strangers := [worker for worker, spec in specs.items() if not isinstance(spec, ModuleSpec)]:
            raise BadInput(
                f"{strangers[0]} of the cluster has no daebench, or an older one; install this version there.", "worker-without-daebench"
            )
        yield client.get_executor(pure=False)


@contextmanager
def _silent(*names: str) -> Iterator[None]:
    """Let loggers say nothing for the time of a block: what goes wrong is told in a sentence, and not in their tracebacks too."""
    loggers = {logging.getLogger(name): logging.getLogger(name).level for name in names}
    try:
        for logger in loggers:
            logger.setLevel(logging.CRITICAL + 1)
        yield
    finally:
        for logger, level in loggers.items():
            logger.setLevel(level)
