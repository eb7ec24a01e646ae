"""Casimir functions on three systems: errors of each method, and how they grow with time."""

from types import MappingProxyType

import numpy as np
import pandas as pd

from daebench.diagnostics.drift import LAWS
from daebench.reports.poisson.runs import defect, errors, ivp_of, kind, method, solve

METHODS = ("strang", "strang/suzuki4", "darboux:verlet", "midpoint", "rk4")
SYSTEMS = MappingProxyType(
    {
        "lotka_volterra_3d": ("blow_up", 0.005, 340),
        "free_rigid_body": ("hlw", 0.4, 2500),
        "heavy_top_lie_poisson": ("lagrange", 0.05, 4000),
    }
)
"""Each system with its case, step size and number of steps."""

TITLES = MappingProxyType(
    {"lotka_volterra_3d": "three species", "free_rigid_body": "free rigid body", "heavy_top_lie_poisson": "heavy top (Lagrange)"}
)
BLOW_UP = 1.7479
"""Time at which the three species go to infinity, HLW (2.14)."""

BEYOND = 400
"""Number of steps that would lead beyond it."""

SHOWN = 400
DEFECT_STEPS = MappingProxyType({"lotka_volterra_3d": 250, "free_rigid_body": 3, "heavy_top_lie_poisson": 3})
"""Steps over which the defect is measured: many for the species, which hardly move at first."""


def casimirs(problem: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return the table of a system, one row per method, and the errors over time, thinned out evenly in log t."""
    case, h, steps = SYSTEMS[problem]
    ivp = ivp_of(problem, case)
    rows, series = [], []
    for name in METHODS:
        if method(name).refusal(ivp) is not None:
            continue
        run = solve(ivp, name, h, steps).complete()
        deviations = errors(ivp, run)
        largest = np.max(np.abs([deviations[quantity] for quantity in ivp.casimirs]), axis=0)
        row = {"problem": problem, "method": name, "h": h, "t_end": run.t[-1], "defect": defect(ivp, name, h, DEFECT_STEPS[problem])}
        row |= {"energy": np.max(np.abs(deviations["energy"])), "energy_kind": kind(run.t, deviations["energy"])}
        row |= {"casimir": largest.max(), "casimir_kind": worst([kind(run.t, deviations[quantity]) for quantity in ivp.casimirs])}
        rows.append(row)
        indices = np.unique(np.geomspace(1, steps, SHOWN).astype(int))
        so_far = np.maximum.accumulate(largest)
        series.append(pd.DataFrame({"problem": problem, "method": name, "t": run.t[indices], "casimir": so_far[indices]}))
    return pd.DataFrame(rows), pd.concat(series, ignore_index=True)


def worst(kinds: list[str]) -> str:
    """Return the worst verdict on several errors."""
    return max(kinds, key=("kept", "bounded", "undetermined", "failed", *LAWS).index)


def break_off(name: str) -> dict[str, object]:
    """Return when and why a run on the three species that would lead beyond their blow-up breaks off."""
    ivp = ivp_of("lotka_volterra_3d", SYSTEMS["lotka_volterra_3d"][0])
    run = solve(ivp, name, SYSTEMS["lotka_volterra_3d"][1], BEYOND)
    return {"method": name, "t": float(run.t[-1]), "failure": run.failure or ""}
