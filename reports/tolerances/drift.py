"""Drift laws: how |g|, the energy error and the position error of IDA grow with time, fitted as powers of it."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd

from daebench.diagnostics.integrals import energy_error
from daebench.methods.solvers.ida import DEFAULT_TREATMENTS
from daebench.reports.tolerances.runs import FAST, exact_of, ivp_of, solve
from daebench.runs.ivp import Array

T_LONG = 100.0
TOL = 1e-12
OTHER_TOLERANCES = (1e-8, 1e-10, 1e-14)
"""Further tolerances for index 1, in addition to ``TOL``."""

RUNS = (("index1", TOL), ("index2", TOL), ("ggl", TOL), ("index3", TOL), *(("index1", tol) for tol in OTHER_TOLERANCES))
QUANTITIES = ("g", "energy", "error")
HALF_OCTAVES = 11
"""Windows, half an octave of time long; the first begins after more than two swings."""

SATURATED = 0.1
"""An error from this on, in lengths of the rod, no longer grows by the law of small errors."""

CLEAR = 100.0
"""A value up to this many times its possible error is not used."""

FEWEST = 5
"""Smallest number of windows of a fit."""


@dataclass(frozen=True)
class Power:
    """A law c t^exponent fitted to windows.

    Parameters
    ----------
    exponent, error : float
        The exponent and its standard error; NaN if fewer than five windows are left.
    factor : float
        c.
    windows : int
        How many windows were used.
    """

    exponent: float
    error: float
    factor: float
    windows: int


def drift_run(formulation: str, tol: float) -> pd.DataFrame:
    """Return t, |g|, |energy error| and the largest position error on the fast pendulum; RunFailed where the run stops early."""
    ivp, reference = ivp_of(FAST), exact_of(FAST, T_LONG)
    run = solve(ivp, formulation, DEFAULT_TREATMENTS[formulation], tol, reference).complete()
    g = np.max(np.abs(ivp.along("g", run.q)), axis=1)
    error = np.max(np.abs(run.q - reference.q), axis=1)
    return pd.DataFrame(
        {"formulation": formulation, "tol": tol, "t": run.t, "g": g, "energy": np.abs(energy_error(ivp, run)), "error": error}
    )


def windows(t: Array, value: Array) -> tuple[Array, Array]:
    """Return the geometric middles of windows that are half an octave long, up to the last time, and the largest value in each."""
    edges = t[-1] * 2.0 ** (-np.arange(HALF_OCTAVES, -1, -1) / 2)
    inside = [(t > a) & (t <= b) for a, b in pairwise(edges)]
    return np.sqrt(edges[:-1] * edges[1:]), np.array([np.max(value[window]) for window in inside])


def fit_power(t: Array, value: Array, *, floor: float, ceiling: float = np.inf) -> Power:
    """Return the law of growth: the least-squares line through the windows' logarithms.

    A window is used if its value is above 100 times ``floor`` and no value so far has reached ``ceiling``.

    Parameters
    ----------
    t, value : ndarray, shape(n,)
        As ``windows`` returns them.
    floor : float
        Possible error of a value.
    ceiling : float
        Where the law ends.
    """
    used = (value > CLEAR * floor) & (np.maximum.accumulate(value) < ceiling)
    n = int(np.sum(used))
    if n < FEWEST:
        return Power(float("nan"), float("nan"), float("nan"), n)
    line, covariance = np.polyfit(np.log(t[used]), np.log(value[used]), 1, cov=True)
    return Power(float(line[0]), float(np.sqrt(covariance[0, 0])), float(np.exp(line[1])), n)


def laws(run: pd.DataFrame, floor: float) -> list[dict[str, Any]]:
    """Return one row per quantity: its law of growth along a run whose reference is known to ``floor``."""
    eps = float(np.finfo(float).eps)
    limits = {"g": (eps, np.inf), "energy": (eps, np.inf), "error": (floor, SATURATED)}
    rows = []
    for quantity, (least, most) in limits.items():
        law = fit_power(*windows(run["t"].to_numpy(), run[quantity].to_numpy()), floor=least, ceiling=most)
        rows.append({"formulation": run["formulation"].iloc[0], "tol": run["tol"].iloc[0], "quantity": quantity} | vars(law))
    return rows
