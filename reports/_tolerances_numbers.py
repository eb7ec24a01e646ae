"""Everything that the report on tolerances measures, with both cores where there are two; no judgement here, and no text."""

import multiprocessing
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from typing import Any

import pandas as pd

from daebench.reports._tolerances_drift import RUNS, T_LONG, drift_run, laws
from daebench.reports._tolerances_runs import FAST, FORMULATIONS, SCENES, exact_of, series

Tell = Callable[[float, str], None]

Job = tuple[Callable[..., Any], tuple[Any, ...]]


@dataclass(frozen=True)
class Numbers:
    """What was measured.

    Parameters
    ----------
    runs : DataFrame
        One row a run to t = 10, see :func:`daebench.reports._tolerances_runs.row`, by problem, formulation, cure and tolerance.
    drift : DataFrame
        The long runs below one another: formulation, tol, t, g, energy, error.
    laws : DataFrame
        Fitted powers of time: formulation, tol, quantity, exponent, error, factor, windows.
    """

    runs: pd.DataFrame
    drift: pd.DataFrame
    laws: pd.DataFrame


def measure(tell: Tell) -> Numbers:
    """Return the numbers; ``tell`` is told the fraction done and what was done.

    The dearest problems come first, so that both cores end at about the same time.
    """
    tables: list[Job] = [(series, (name, formulation)) for name in reversed(SCENES) for formulation in FORMULATIONS]
    long: list[Job] = [(drift_run, run) for run in RUNS]
    exact_of(FAST, T_LONG)  # a reference that is missing is found out before anything is computed
    found = dict(computed([*tables, *long], tell))
    runs = pd.DataFrame([row for job in _in_order(tables) for row in found[job]])
    drift = [found[job] for job in long]
    fitted = [row for run in drift for row in laws(run, exact_of(FAST, T_LONG).floor)]
    return Numbers(runs, pd.concat(drift, ignore_index=True), pd.DataFrame(fitted))


def _in_order(tables: Sequence[Job]) -> list[Job]:
    return sorted(tables, key=lambda job: list(SCENES).index(job[1][0]))


def computed(jobs: Sequence[Job], tell: Tell, who: str = "IDA") -> Iterator[tuple[Job, Any]]:
    """Give each job and its result, as they are done, from two processes; from this one alone where others cannot be had.

    ``tell`` is told the fraction done and who has just done what.
    """
    left = list(jobs)
    if (os.cpu_count() or 1) > 1:
        try:
            for job, result in _from_two(jobs):
                left.remove(job)
                tell(1 - len(left) / len(jobs), _doing(job, who))
                yield job, result
        except BrokenProcessPool:
            pass
    while left:
        job = left.pop(0)
        yield job, job[0](*job[1])
        tell(1 - len(left) / len(jobs), _doing(job, who))


def _doing(job: Job, who: str) -> str:
    return f"{who}, " + ", ".join(f"{each:.0e}" if isinstance(each, float) else str(each) for each in job[1])


def _from_two(jobs: Sequence[Job]) -> Iterator[tuple[Job, Any]]:
    """Give jobs and results from two fresh processes, which end with this one's interest in them."""
    others = set(multiprocessing.active_children())
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        futures: Mapping[Future[Any], Job] = {pool.submit(work, *arguments): (work, arguments) for work, arguments in jobs}
        try:
            for future in as_completed(futures):
                yield futures[future], future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for process in set(multiprocessing.active_children()) - others:
                process.terminate()
            raise
