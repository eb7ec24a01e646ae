"""Everything that the report on tolerances measures, with both cores where there are two; no judgement here, and no text."""

from dataclasses import dataclass

import pandas as pd

from daebench.pages.report import Progress
from daebench.pages.report.two_processes import Job, computed
from daebench.reports.tolerances.drift import RUNS, T_LONG, drift_run, laws
from daebench.reports.tolerances.runs import FAST, FORMULATIONS, IVPS, exact_of, series


@dataclass(frozen=True)
class Numbers:
    """What was measured.

    Parameters
    ----------
    runs : DataFrame
        One row a run to t = 10, see :func:`daebench.reports.tolerances.runs.row`, by problem, formulation, treatment and tolerance.
    drift : DataFrame
        The long runs below one another: formulation, tol, t, g, energy, error.
    laws : DataFrame
        Fitted powers of time: formulation, tol, quantity, exponent, error, factor, windows.
    """

    runs: pd.DataFrame
    drift: pd.DataFrame
    laws: pd.DataFrame


def measure(tell: Progress) -> Numbers:
    """Return the numbers; ``tell`` is told the fraction done and what was done.

    The dearest problems come first, so that both cores end at about the same time.
    """
    tables: list[Job] = [(series, (name, formulation)) for name in reversed(IVPS) for formulation in FORMULATIONS]
    long: list[Job] = [(drift_run, run) for run in RUNS]
    exact_of(FAST, T_LONG)  # a reference that is missing is found out before anything is computed
    results = dict(computed([*tables, *long], tell, "IDA"))
    in_order = sorted(tables, key=lambda job: list(IVPS).index(job[1][0]))
    runs = pd.DataFrame([row for job in in_order for row in results[job]])
    drift = [results[job] for job in long]
    fitted = [row for run in drift for row in laws(run, exact_of(FAST, T_LONG).floor)]
    return Numbers(runs, pd.concat(drift, ignore_index=True), pd.DataFrame(fitted))
