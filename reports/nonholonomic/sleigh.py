"""A sleigh that stops turning though it keeps its energy: whether the turning dies out in the runs of each method."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd

from daebench.diagnostics.energy_verdict import energy_error, energy_scales, size
from daebench.pages.report import percent
from daebench.pages.report.claims import require
from daebench.pages.report.tables import Table, code, tiny
from daebench.reports.nonholonomic.motions import METHODS, SOLVERS, TOL, ivp_of, solved

H, T_END, T_LATE = 0.1, 1000.0, 50.0


def sleigh(method: str) -> dict[str, Any]:
    """Return the largest energy error of a run, and the largest angular velocity late in it, rad/s."""
    ivp = ivp_of("sleigh", "turning")
    run = solved(ivp, method, TOL if method in SOLVERS else H, T_END).complete()
    turning = np.abs(ivp.along("H_p", *run.vectors)[:, 2])[run.t >= T_LATE]
    error = float(size(np.max(np.abs(energy_error(ivp, run))), energy_scales(ivp, run)))
    return {"method": method, "energy": error, "turning": float(turning.max()), "last": float(turning[-1])}


def check_sleigh(frame: pd.DataFrame) -> SimpleNamespace:
    """Test that the turning dies out with every method but GNI."""
    late = frame.set_index("method")["turning"]
    others = late.drop("gni")
    require(others.max() < 1e-8, "the turning of the sleigh dies out with all methods but gni", others.to_dict())
    require(late["gni"] > 0.1, "the sleigh of gni turns late in the run", late["gni"])
    return SimpleNamespace(gni=late["gni"], others=others.max())


def table(frame: pd.DataFrame) -> Table:
    """Return energy errors and late angular velocities."""
    late = f"angular velocity<small>largest after t = {T_LATE:g}, rad/s</small>"
    columns = {
        "method": (code, "method"),
        "energy": (percent, "energy error<small>over mean kinetic energy</small>"),
        "turning": (tiny, late),
    }
    return Table(frame.set_index("method").reindex(METHODS).reset_index(), columns)
