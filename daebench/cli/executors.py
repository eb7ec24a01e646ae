"""Executors of the runs of a study: this process, processes of this machine, or a Dask cluster."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from daebench.errors import BadInput
from daebench.studies.grid.tls import NO_TLS, OPTIONS, Tls

if TYPE_CHECKING:
    from concurrent.futures import Executor


@dataclass(frozen=True, kw_only=True)
class Executors:
    """Where runs are computed, as the options of a command say.

    Parameters
    ----------
    timed : bool
        Whether runs are timed; then they are made in this process, one at a time, unless they may run side by side.
    workers : int, optional
        Processes of this machine; as many as it has cores if left out.
    scheduler : str, optional
        Address of a Dask scheduler, in their place.
    tls : Tls
        Certificates for that address.
    side_by_side : bool
        Whether runs that are timed may run beside others.

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
            raise BadInput(f"--workers {self.workers} must be at least 1.")
        if self.workers is not None and self.scheduler is not None:
            raise BadInput("--workers are processes of this machine, and --scheduler has workers of its own; leave out one of them.")
        if self.tls and self.scheduler is None:
            raise BadInput(f"{', '.join(OPTIONS)} are for --scheduler tls://host:port, which is not given.")
        if self._alone and (self.scheduler is not None or (self.workers or 1) > 1):
            raise BadInput("runs that are timed are made one at a time; take --repeat 0 for no times, or --side-by-side for worse ones.")

    @property
    def _alone(self) -> bool:
        return self.timed and not self.side_by_side

    @property
    def beside(self) -> bool:
        """Whether runs are timed while others run beside them, here or on a cluster."""
        return self.timed and self.processes != 1

    @property
    def processes(self) -> int | None:
        """How many processes of this machine compute; None where those of a cluster do."""
        if self.scheduler is not None:
            return None
        from daebench.runs.machine import cores

        return 1 if self._alone else self.workers or cores()

    @contextmanager
    def opened(self) -> "Iterator[Executor | None]":
        """Open what computes for the time of a block; None is this process, run after run."""
        from daebench.studies.grid.schedulers import dask_cluster, local_processes

        if self.scheduler is not None:
            with dask_cluster(self.scheduler, self.tls) as executor:
                yield executor
        elif self.processes == 1:
            yield None
        else:
            with local_processes(self.processes) as executor:
                yield executor
