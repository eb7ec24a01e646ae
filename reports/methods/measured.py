"""Everything that the report on methods measures: numbers in parallel first, times one by one afterwards; no judgement, and no text."""

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from daebench.pages.report import Progress
from daebench.pages.report.two_processes import Job, computed
from daebench.reports.methods.defects import KEEPING, LOSING, defects
from daebench.reports.methods.families import names, solvers
from daebench.reports.methods.long_runs import LONG, ida_long, long_run
from daebench.reports.methods.reverse import RUNS, reversed_run
from daebench.reports.methods.sweep import Swept, ida, nanoseconds, sweep, torus_orders

TOGETHER = 0.9
"""Fraction of the work that is done when only times are still to be measured."""


REPEATS = 25
"""Number of runs; the minimum of their times counts."""


@dataclass(frozen=True)
class Numbers:
    """The measurements of the report."""

    claims: pd.DataFrame
    """One row per problem, method and property: h and the fields of :class:`daebench.studies.claims.bench.Finding`; the property is
    "refused" where a method does not apply to a problem.
    """
    points: pd.DataFrame
    orders: pd.DataFrame
    """One row per problem, method, component and step size, and one per fit, as in :class:`daebench.studies.orders.study.Orders`."""
    work: pd.DataFrame
    """One row per method: h, evaluations per step by kind, and ns, the CPU time of a step."""
    defects: pd.DataFrame
    """Columns method, h, symplectic, symmetric."""
    energy: pd.DataFrame
    """Columns method, t, energy, distance: the largest in a window of time that ends at about t, of the methods ``LONG`` in ``series.py``.
    """
    drift: pd.DataFrame
    """One row per long run, IDA's last: method, problem, h or tol, distance, and the result of ``verdicts`` of ``series.py``."""
    ida: pd.DataFrame
    """Columns method, tol, g, Gv, energy, steps."""
    reverse: pd.DataFrame
    """One row per run of :mod:`daebench.reports.methods.reverse`: method, case, energy, change, up, down."""


def jobs(methods: Sequence[str]) -> list[Job]:
    """Return the measurements of these methods except times; the most expensive methods come first."""
    queue: list[Job] = [(sweep, (name,)) for name in reversed(methods)]
    queue += [(torus_orders, (name,)) for name in LONG if name in methods] + [(long_run, (name,)) for name in methods]
    queue += [(ida_long, (name,)) for name in solvers()]
    queue += [(reversed_run, pair) for pair in RUNS]
    return queue + [(defects, (name,)) for name in (*KEEPING, *LOSING) if name in methods] + [(ida, (name,)) for name in solvers()]


def measure(tell: Progress) -> Numbers:
    """Return the numbers; ``tell`` receives the fraction done and a description of the finished work."""
    methods = names()
    results = dict(computed(jobs(methods), lambda done, doing: tell(TOGETHER * done, doing), "measured"))
    swept: list[Swept] = [results[work, (name,)] for work in (sweep, torus_orders) for name in methods if (work, (name,)) in results]
    runs = {name: results[long_run, (name,)] for name in methods}
    rows = [row for _, row in runs.values()] + [results[ida_long, (name,)] for name in solvers()]
    return Numbers(
        claims=pd.DataFrame([row for outcome in swept for row in outcome.claims]),
        points=pd.DataFrame([row for outcome in swept for row in outcome.points]),
        orders=pd.DataFrame([row for outcome in swept for row in outcome.orders]),
        work=_timed(pd.DataFrame([row for outcome in swept for row in outcome.work]), tell),
        defects=pd.concat([results[defects, (name,)] for name in (*KEEPING, *LOSING) if name in methods], ignore_index=True),
        energy=pd.concat([runs[name][0] for name in LONG if name in runs], ignore_index=True),
        drift=pd.DataFrame(rows),
        ida=pd.DataFrame([results[ida, (name,)] for name in solvers()]),
        reverse=pd.DataFrame([results[reversed_run, pair] for pair in RUNS]),
    )


def _timed(work: pd.DataFrame, tell: Progress) -> pd.DataFrame:
    """Return the table of work with times, which are measured one after the other without other work."""
    times = []
    for k, row in enumerate(work.to_dict("records")):
        tell(TOGETHER + (1 - TOGETHER) * k / len(work), f"time of {row['method']}")
        times.append(nanoseconds(row["method"], row["h"], REPEATS))
    return work.assign(ns=times)
