"""What lasts: defects of two-form and reversal against the step size for some methods, and a long run of each method."""

from typing import Any

import numpy as np
import pandas as pd

from daebench.diagnostics.drift import FAILED
from daebench.diagnostics.energy_verdict import energy_verdict
from daebench.diagnostics.integrals import energy_error
from daebench.diagnostics.manifold import distance, manifold_drift
from daebench.diagnostics.order import fit_order
from daebench.diagnostics.reversibility import reversibility_defect
from daebench.diagnostics.symplecticity import symplecticity_defect, tangent_basis
from daebench.methods.names import parse
from daebench.reports.methods.families import method
from daebench.reports.methods.sweep import HIGH, LONGER, MOTIONS, PENDULUM, TOL, TORUS, ivp_of
from daebench.runs.ivp import ConstrainedIvp
from daebench.runs.request import Request
from daebench.runs.trajectory import Trajectory

KEEPING = ("symplectic_euler", "shake", "rattle", "strang", "lobatto3")
"""Methods that claim to keep the two-form, and whose defects are drawn."""

LOSING = ("implicit_euler", "seproj", "energy_momentum", "midpoint", "midpoint+symproj", "radau2_ggl", "rk4")
"""Methods that do not."""

DEFECT_H = tuple(0.02 / 2**k for k in range(7))
DEFECT_STEPS = 10

LONG = ("symplectic_euler", "rattle", "lobatto3", "energy_momentum", "midpoint", "midpoint+symproj", "radau2_ggl", "rk4", "rk4+proj")
"""Methods whose long run has curves, and whose order is also measured on the torus."""

T_LONG = 1000.0
LONG_POINTS = 20001
"""Outputs of a long run of IDA."""
WINDOWS = 100
"""Windows of time in each of which the largest value is drawn."""

FLOOR = 1e-13
"""Defects up to this are round-off, or too close to it for a power of h."""


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


def long_run(name: str) -> tuple[pd.DataFrame, dict[str, Any]]:
    """Return a long run in windows (t, energy, distance, the largest in each) and a row with the verdicts on energy and residuals.

    It is on the torus, or on the pendulum for a method that refuses the torus. A run that stops early gives a row that says so, and the
    windows up to its end.
    """
    own = method(name, compiled=True)
    motion = next(motion for motion in reversed(MOTIONS) if own.refusal(ivp_of(motion)) is None)
    ivp, h = ivp_of(motion), motion.h * (LONGER if own.claims.order >= HIGH else 1)
    run = own.solve(ivp, Request(value=h, t_end=T_LONG, watch=(), count=False))
    energy, away = energy_error(ivp, run), distance(ivp, run.p, run.q)
    window = np.minimum((run.t / T_LONG * WINDOWS).astype(int), WINDOWS - 1)
    sampled = pd.DataFrame({"window": window, "t": run.t, "energy": np.abs(energy), "distance": away})
    shown = sampled.groupby("window", as_index=False).max().assign(method=name)
    about = {"method": name, "problem": motion.problem, "h": h}
    return shown[["method", "t", "energy", "distance"]], about | verdicts(ivp, run) | {"distance": np.max(away)}


def ida_long(name: str) -> dict[str, Any]:
    """Return the row of a long run of IDA on the torus."""
    ivp = ivp_of(TORUS)
    run = parse(name).solve(ivp, Request(value=TOL, t_end=T_LONG, points=LONG_POINTS, watch=()))
    assert isinstance(run, Trajectory)
    return {"method": name, "problem": TORUS.problem, "tol": TOL} | verdicts(ivp, run)


def verdicts(ivp: ConstrainedIvp, run: Trajectory) -> dict[str, Any]:
    """Return the verdicts on energy, g and G H_p along a run, under the keys of the matrix, and more of the energy."""
    drift, manifold = energy_verdict(ivp, run), manifold_drift(ivp, run)
    row = {"energy": np.max(np.abs(energy_error(ivp, run))), "failure": run.failure or ""}
    row |= {"kind": drift.brief, "slope": drift.slope, "slope_error": drift.slope_error, "growth": drift.exponent}
    said = {"H_long": drift.verdict, "g_long": manifold.g.verdict, "Gv_long": manifold.Gv.verdict}
    return row | (dict.fromkeys(said, FAILED) if run.failure else said)
