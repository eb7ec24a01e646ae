"""Energy of a symmetric, non-symplectic method: bounded on motions that are their own reverse, and not on others."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd

from daebench.diagnostics.energy_verdict import energy_error
from daebench.pages.report.claims import require
from daebench.reports.methods.families import method
from daebench.reports.methods.long_runs import T_LONG
from daebench.reports.methods.sweep import TORUS, Motion, ivp_of
from daebench.runs.ivp import Array
from daebench.runs.request import Request

THROUGH, TO_AND_FRO = TORUS.case, "trough"
"""A motion round the tube in one sense, which differs from its reverse, and one up and down the tube, which equals its reverse."""

SYMMETRIC, ONE_SIDED = "midpoint+symproj", "midpoint+proj"
"""A symmetric and a non-symmetric method; neither is symplectic."""

RUNS = ((SYMMETRIC, THROUGH), (SYMMETRIC, TO_AND_FRO), (ONE_SIDED, TO_AND_FRO))

WINDOWS = 8
"""Windows of time whose mean energy errors are compared."""

STILL, MOVING = 0.05, 0.2
"""Fractions of the largest error: means of windows that differ by less than the first are level, by more than the second they drift."""


def reversed_run(name: str, case: str) -> dict[str, Any]:
    """Return a row of a long run on the torus: method, case, largest energy error, difference of its means over windows, turns.

    Turns are of the angle round the tube: its largest excursion in either sense, in revolutions.
    """
    ivp = ivp_of(Motion(TORUS.problem, case, TORUS.h))
    run = method(name, compiled=True).solve(ivp, Request(value=TORUS.h, t_end=T_LONG, watch=(), count=False)).complete()
    error = energy_error(ivp, run)
    means = [float(np.mean(part)) for part in np.array_split(error, WINDOWS)]
    turns = turned(run.q, ivp.parameters["radius"])
    return {"method": name, "case": case, "energy": np.max(np.abs(error)), "change": np.ptp(means), "up": turns.max(), "down": -turns.min()}


def turned(q: Array, radius: float) -> Array:
    """Return the angle round the tube since the start, in revolutions."""
    angle = np.unwrap(np.arctan2(q[:, 2], np.hypot(q[:, 0], q[:, 1]) - radius))
    return np.asarray((angle - angle[0]) / (2 * np.pi))


def reverse(frame: pd.DataFrame) -> SimpleNamespace:
    """Test that the symmetric method drifts on the first motion only, and the other method on the second motion as well."""
    row = {
        (str(record["method"]), str(record["case"])): SimpleNamespace(**{str(name): value for name, value in record.items()})
        for record in frame.to_dict("records")
    }
    through, back, one_sided = (row[key] for key in RUNS)
    require(through.up > 1 > max(back.up, back.down, through.down), "the motion through the hole goes round, the other one to and fro", row)
    part = through.change / through.energy
    require(part > MOVING, f"the energy of {SYMMETRIC} drifts on the motion through the hole", f"{part:.2g} of its largest error")
    part = back.change / back.energy
    require(part < STILL, f"the energy of {SYMMETRIC} is level on the motion to and fro", f"{part:.2g} of its largest error")
    part = one_sided.change / one_sided.energy
    require(part > MOVING, f"the energy of {ONE_SIDED} drifts there too", f"{part:.2g} of its largest error")
    return SimpleNamespace(through=through, back=back, one_sided=one_sided)
