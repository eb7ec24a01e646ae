"""Work of a report done in two processes, or in this one where others cannot be had."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, as_completed
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from typing import Any

from daebench.pages.report.deferred import meanwhile
from daebench.pages.report.page import Progress
from daebench.runs.machine import cores
from daebench.studies.grid.schedulers import LOADED, local_processes

Job = tuple[Callable[..., Any], tuple[Any, ...]]
"""A function of a module, and its arguments."""

NEEDED = (*LOADED, "pandas", "scipy.integrate", "sympy")
"""What the processes of a report need, in all of which kernels are compiled."""

two_processes = partial(local_processes, 2, NEEDED)


def computed(jobs: Sequence[Job], tell: Progress, who: str) -> Iterator[tuple[Job, Any]]:
    """Give each job and its result, as they are done."""
    left = list(jobs)
    if cores() > 1:
        try:
            for job, result in _from_two(jobs):
                left.remove(job)
                tell(1 - len(left) / len(jobs), _doing(job, who))
                yield job, result
        # The system may end a process for want of memory; what it has not done can still be done here, one by one.
        except BrokenProcessPool:
            tell(1 - len(left) / len(jobs), "a process was lost: continuing in this one")
    while left:
        job = left.pop(0)
        yield job, job[0](*job[1])
        tell(1 - len(left) / len(jobs), _doing(job, who))


def _from_two(jobs: Sequence[Job]) -> Iterator[tuple[Job, Any]]:
    with two_processes() as pool:
        futures: dict[Future[Any], Job] = {pool.submit(work, *arguments): (work, arguments) for work, arguments in jobs}
        meanwhile([*futures])
        for future in as_completed(futures):
            yield futures[future], future.result()


def _doing(job: Job, who: str) -> str:
    return f"{who}, " + ", ".join(f"{argument:.0e}" if isinstance(argument, float) else str(argument) for argument in job[1])
