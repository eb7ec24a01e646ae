"""Everything that the report on tolerances measures, in parallel on up to two cores; no judgement here, and no text."""

from dataclasses import dataclass

import pandas as pd

from daebench.pages.report import Progress
from daebench.pages.report.two_processes import Job, computed
from daebench.reports.tolerances import projection
from daebench.reports.tolerances.drift import RUNS, T_LONG, drift_run, laws
from daebench.reports.tolerances.runs import FAST, IVPS, STARTS, exact_of, member

LONG_PART = 0.85
"""Fraction of the work that is not timed."""


@dataclass(frozen=True)
class Numbers:
    """What was measured.

    Parameters
    ----------
    runs : DataFrame
        One row per run to t = 10, see :func:`daebench.reports.tolerances.runs.row`, by problem, start, formulation, treatment and
        tolerance.
    drift : DataFrame
        The long runs, one after the other: formulation, tol, t, g, energy, error.
    laws : DataFrame
        Fitted powers of time: formulation, tol, quantity, exponent, error, factor, windows.
    projected : DataFrame
        CVODE with projected steps and other methods, see :func:`daebench.reports.tolerances.projection.compared`.
    example : DataFrame
        SUNDIALS' example of a projected pendulum, see :func:`daebench.reports.tolerances.projection.example`.
    """

    runs: pd.DataFrame
    drift: pd.DataFrame
    laws: pd.DataFrame
    projected: pd.DataFrame
    example: pd.DataFrame


def measure(tell: Progress) -> Numbers:
    """Return the numbers; ``tell`` receives the fraction done and a description of the finished work.

    The most expensive problems come first, so that both cores finish at about the same time. Timed runs come last, one at a time; what
    they run is compiled before.
    """
    members: list[Job] = [(member, (name, start)) for name in reversed(IVPS) for start in range(STARTS)]
    long: list[Job] = [(drift_run, run) for run in RUNS]
    kernels: list[Job] = [(projection.compiled, (name,)) for name in reversed(IVPS)]
    exact_of(FAST, T_LONG)  # a missing reference is found before anything is computed
    results = dict(computed([*kernels, *members, *long], lambda part, what: tell(LONG_PART * part, what), "measured"))
    in_order = sorted(members, key=lambda job: list(IVPS).index(job[1][0]))
    runs = pd.DataFrame([row for job in in_order for row in results[job][0]])
    drift = [results[job] for job in long]
    fitted = [row for run in drift for row in laws(run, exact_of(FAST, T_LONG).floor)]
    timed = []
    for k, name in enumerate(IVPS):
        tell(LONG_PART + (1 - LONG_PART) * k / len(IVPS), f"CVODE with projected steps, {IVPS[name]}")
        references = [results[member, (name, start)][1] for start in range(projection.STARTS)]
        paces = projection.paces(name)
        timed += [row for start, reference in enumerate(references) for row in projection.compared(name, start, reference, paces)]
    tell(1.0, "CVODE with projected steps, the example of SUNDIALS")
    frames = runs, pd.concat(drift, ignore_index=True), pd.DataFrame(fitted), pd.DataFrame(timed), pd.DataFrame(projection.example())
    return Numbers(*frames)
