"""Executors of the runs of a study: this process, processes of this machine, or a Dask cluster."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from daebench.errors import BadInput
from daebench.records.store import opened
from daebench.runs.machine import cores
from daebench.studies.grid.schedulers import NO_TLS, OPTIONS, Tls, dask_cluster, local_processes

if TYPE_CHECKING:
    from concurrent.futures import Executor

STORE = "studies.db"
"""Name of the file of stored runs in a folder of output."""


@dataclass(frozen=True, kw_only=True)
class Executors:
    """Executor of runs, according to the options of a command.

    Parameters
    ----------
    timed : bool
        Whether runs are timed; timed runs are made in this process, one at a time, unless they may run side by side.
    workers : int, optional
        Number of processes on this machine; the number of cores if left out.
    scheduler : str, optional
        Address of a Dask scheduler, in their place.
    tls : Tls
        Certificates for that address.
    side_by_side : bool
        Whether timed runs may run beside others.

    Raises
    ------
    BadInput
        If the options contradict each other.
    """

    timed: bool
    workers: int | None = None
    scheduler: str | None = None
    tls: Tls = NO_TLS
    side_by_side: bool = False

    def __post_init__(self) -> None:
        if self.workers is not None and self.workers < 1:
            raise BadInput(f"--workers {self.workers} must be at least 1.", "workers-not-positive")
        if self.workers is not None and self.scheduler is not None:
            raise BadInput(
                "--workers are processes on this machine, and --scheduler has its own workers; leave out one of them.",
                "workers-beside-scheduler",
            )
        if self.tls and self.scheduler is None:
            raise BadInput(f"{', '.join(OPTIONS)} need --scheduler tls://host:port, which is not given.", "tls-without-scheduler")
        if self._alone and (self.scheduler is not None or (self.workers or 1) > 1):
            raise BadInput(
                "timed runs are made one at a time; give --repeat 0 for no times, or --side-by-side for less accurate ones.",
                "timed-in-parallel",
            )

    @property
    def _alone(self) -> bool:
        return self.timed and not self.side_by_side

    @property
    def beside(self) -> bool:
        """Whether runs are timed while others run beside them, here or on a cluster."""
        return self.timed and self.processes != 1

    @property
    def processes(self) -> int | None:
        """Number of processes on this machine; None if a cluster computes."""
        if self.scheduler is not None:
            return None
        return 1 if self._alone else self.workers or cores()

    @contextmanager
    def opened(self) -> "Iterator[Executor | None]":
        """Open the executor for the time of a block; None is this process, run after run."""
        if self.scheduler is not None:
            with dask_cluster(self.scheduler, self.tls) as executor:
                yield executor
        elif self.processes == 1:
            yield None
        else:
            with local_processes(self.processes) as executor:
                yield executor


def executors_of(given: Mapping[str, Any], *, timed: bool, workers: int | None) -> Executors:
    """Return the executor that the options of a command ask for."""
    tls = Tls(given["tls_ca_file"], given["tls_cert"], given["tls_key"])
    side_by_side = given.get("side_by_side", False)
    return Executors(timed=timed, workers=workers, scheduler=given["scheduler"], tls=tls, side_by_side=side_by_side)


@contextmanager
def storing(given: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    """Open the store of runs, the named file or that in the folder of output, and what computes them; yield nothing if none is named."""
    path = given["store"] or (given["out"] and given["out"] / STORE)
    workers, scheduler = given["workers"], given["scheduler"]
    if not path and (workers is not None or scheduler is not None):
        raise BadInput("--workers and --scheduler need stored runs; name a file by --store, or a folder by --out.", "executor-needs-store")
    executors = executors_of(given, timed=False, workers=1 if scheduler is None and workers is None else workers)
    if not path:
        yield {}
        return
    with opened(path) as store, executors.opened() as executor:
        yield {"store": store, "executor": executor}
