"""The Poisson defect against the step size, and Lemma 4.9: on a constraint manifold it vanishes together with the symplectic one."""

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from daebench.diagnostics.order import fit_order
from daebench.diagnostics.poisson import poisson_defect
from daebench.diagnostics.symplecticity import symplecticity_defect, tangent_basis
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.reports.poisson.runs import ROUND_OFF, defect, ivp_of
from daebench.runs.local_flow import enter, local_flow, structure_matrix
from daebench.runs.make_ivp import constrained

METHODS = ("strang", "verlet", "darboux:symplectic_euler", "midpoint", "rk4")
POINT = (3.0, 3.0)
"""Point at which the defect of a step is measured, not the start of an orbit: where u' = 0 the defect has another order."""

STEP_SIZES = tuple(0.1 / 2**k for k in range(6))

CONSTRAINED = ("rattle", "symplectic_euler", "seproj", "implicit_euler", "local:midpoint", "local:rk4")
"""Methods that stay on the manifold of the spherical pendulum, and thus are maps in local coordinates."""

PENDULUM, PENDULUM_CASE = "spherical_pendulum", "fig1.2"
PENDULUM_STEP_SIZES = tuple(0.02 / 2**k for k in range(6))
LEMMA_STEPS = 2


def defects(method: str) -> pd.DataFrame:
    """Return the defect of one step of a method on predator and prey, by h."""
    ivp = ivp_of("lotka_volterra", "4,2", y0=POINT)
    return pd.DataFrame({"method": method, "h": STEP_SIZES, "defect": [defect(ivp, method, h, 1) for h in STEP_SIZES]})


def lemma(method: str) -> pd.DataFrame:
    """Return both defects of two steps of a constrained method, by h: on tangent vectors, and of B(y) in local coordinates."""
    ivp = constrained(initial_value_problem(PENDULUM, PENDULUM_CASE))
    X, y, B = tangent_basis(ivp, ivp.p0, ivp.q0), np.concatenate(enter(ivp)(ivp.p0, ivp.q0)), structure_matrix(ivp)
    chosen: Any = parse(method)
    uncompiled = replace(chosen, compiled=False)
    rows = []
    for h in PENDULUM_STEP_SIZES:
        flow = uncompiled.flow(ivp, h, LEMMA_STEPS)
        symplectic, poisson = symplecticity_defect(flow, ivp.p0, ivp.q0, X), poisson_defect(local_flow(flow, ivp), y, B)
        rows.append({"method": method, "h": h, "symplectic": symplectic, "poisson": poisson, "B": np.max(np.abs(B(y)))})
    return pd.DataFrame(rows)


def slopes(frame: pd.DataFrame, column: str = "defect") -> pd.DataFrame:
    """Return one row per method: the largest defect, and the fitted power of h if it is not round-off."""
    rows = []
    for name, method_defects in frame.groupby("method", sort=False):
        value = method_defects[column].to_numpy()
        least = ROUND_OFF * (method_defects["B"].iloc[0] if "B" in method_defects else 1.0)
        fit = fit_order(method_defects["h"], value, floor=1e-13) if value.max() > least else None
        power = {"slope": fit.slope, "slope_error": fit.slope_error} if fit else {"slope": np.nan, "slope_error": np.nan}
        rows.append({"method": name, "most": value.max(), "least": value.min(), "round_off": fit is None} | power)
    return pd.DataFrame(rows)
