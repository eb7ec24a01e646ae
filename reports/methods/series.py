"""Curves of some methods: the defects of two-form and reversal against the step size, and energy and manifold over a long run."""

import numpy as np
import pandas as pd

from daebench.diagnostics.energy import energy_drift
from daebench.diagnostics.integrals import energy_error
from daebench.diagnostics.manifold import distance
from daebench.diagnostics.order import fit_order
from daebench.diagnostics.reversibility import reversibility_defect
from daebench.diagnostics.symplecticity import symplecticity_defect, tangent_basis
from daebench.reports.methods.families import method
from daebench.reports.methods.sweep import PENDULUM, TORUS, ivp_of
from daebench.runs.request import Request

KEEPING = ("symplectic_euler", "shake", "rattle", "strang", "lobatto3")
"""Methods that claim to keep the two-form, of whose defects there is a curve."""

LOSING = ("implicit_euler", "seproj", "energy_momentum", "midpoint", "midpoint+symproj", "radau2_ggl", "rk4")
"""Methods that do not."""

DEFECT_H = tuple(0.02 / 2**k for k in range(7))
DEFECT_STEPS = 10

LONG = ("symplectic_euler", "rattle", "lobatto3", "energy_momentum", "midpoint", "midpoint+symproj", "radau2_ggl", "rk4", "rk4+proj")
"""Methods that are run for long, and whose order is measured on the torus too."""

H, T_LONG = 0.05, 1000.0
WINDOWS = 100
"""Windows of time in each of which the largest value is drawn."""

FLOOR = 1e-13
"""Defects up to this are round-off, or too near to it for a power of h."""


def defects(name: str) -> pd.DataFrame:
    """Return columns method, h, symplectic, symmetric: the defects of ten steps from the start of the pendulum."""
    ivp, fixed_step = ivp_of(PENDULUM), method(name)
    X = tangent_basis(ivp, ivp.p0, ivp.q0)
    rows = []
    for h in DEFECT_H:
        flow = fixed_step.flow(ivp, h, DEFECT_STEPS)
        both = {
            "symplectic": symplecticity_defect(flow, ivp.p0, ivp.q0, X),
            "symmetric": reversibility_defect(flow, ivp.p0, ivp.q0),
        }
        rows.append({"method": name, "h": h} | both)
    return pd.DataFrame(rows)


def powers(frame: pd.DataFrame) -> pd.DataFrame:
    """Return columns method, property, order, most, power, power_error: the fitted powers of h; NaN where all is round-off."""
    rows = []
    for name, method_defects in frame.groupby("method", sort=False):
        for property in ("symplectic", "symmetric"):
            value = method_defects[property].to_numpy()
            fit = fit_order(method_defects["h"], value, floor=FLOOR)
            about = {"method": name, "property": property, "order": method(str(name)).claims.order}
            rows.append(about | {"most": value.max(), "power": fit.slope, "power_error": fit.slope_error})
    return pd.DataFrame(rows)


def long_run(name: str) -> tuple[pd.DataFrame, dict[str, object]]:
    """Return a long run on the torus in windows (t, energy, distance, the largest in each) and a row that says what becomes of it.

    A run that stops early is a row that says so, with the windows up to there.
    """
    ivp = ivp_of(TORUS)
    run = method(name, compiled=True).solve(ivp, Request(value=H, t_end=T_LONG, watch=(), count=False))
    energy, away = energy_error(ivp, run), distance(ivp, run.p, run.q)
    window = np.minimum((run.t / T_LONG * WINDOWS).astype(int), WINDOWS - 1)
    sampled = pd.DataFrame({"window": window, "t": run.t, "energy": np.abs(energy), "distance": away})
    shown = sampled.groupby("window", as_index=False).max().assign(method=name)
    drift = energy_drift(run.t, energy)
    row = {"method": name, "energy": np.max(np.abs(energy)), "distance": np.max(away), "failure": run.failure or ""}
    row |= {"kind": drift.brief, "slope": drift.slope, "slope_error": drift.slope_error, "growth": drift.exponent}
    return shown[["method", "t", "energy", "distance"]], row
