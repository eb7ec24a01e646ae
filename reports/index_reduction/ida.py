"""IDA on every formulation of the same system: the tolerance that was asked for against the accuracy that was reached."""

import numpy as np
import pandas as pd

from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.pages.report import Progress
from daebench.pages.report.exact_motion import exact_motion
from daebench.reports.index_reduction.numbers import FAST, FORMULATIONS, PROBLEM, SLOW
from daebench.runs.make_ivp import constrained
from daebench.runs.request import Request

TOLERANCES = tuple(10.0**-k for k in range(4, 13))
T_END, POINTS = 10.0, 41
SECONDS_LIMIT = 10.0


def measure_ida(tell: Progress) -> pd.DataFrame:
    """Return one row per case, formulation and tolerance.

    Columns: case, formulation, tol, error (largest component of the position error over all outputs), g, Gv (largest residuals over
    them), steps, seconds (CPU), t_reached, failure (empty if there is none).
    """
    rows = []
    runs = [(case, formulation, tol) for case in (SLOW, FAST) for formulation in FORMULATIONS for tol in TOLERANCES]
    times = np.linspace(0.0, T_END, POINTS)
    ivps = {case: constrained(initial_value_problem(PROBLEM, case)) for case in (SLOW, FAST)}
    exact = {case: exact_motion(ivp.source, case, list(times))[0] for case, ivp in ivps.items()}
    for k, (case, formulation, tol) in enumerate(runs):
        tell(k / len(runs), f"IDA, {formulation}, tolerance {tol:.0e}")
        request = Request(value=tol, t_end=T_END, points=POINTS, watch=("manifold",), seconds_limit=SECONDS_LIMIT)
        run = parse(f"ida:{formulation}").solve(ivps[case], request)
        rows.append(
            {
                "case": case,
                "formulation": formulation,
                "tol": tol,
                "error": float("nan") if run.failure else float(np.max(np.abs(run.q - exact[case]))),
                "g": run.maxima["g"],
                "Gv": run.maxima["Gv"],
                "steps": run.steps,
                "seconds": run.seconds,
                "t_reached": float(run.t[-1]),
                "failure": run.failure or "",
            }
        )
    return pd.DataFrame(rows)
