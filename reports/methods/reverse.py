"""Energy of a method that is symmetric and not symplectic: bounded on motions that are their own reverse, and not on others."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd

from daebench.diagnostics.integrals import energy_error
from daebench.pages.report.claims import require
from daebench.reports.methods.families import method
from daebench.reports.methods.series import T_LONG
from daebench.reports.methods.sweep import TORUS, Motion, ivp_of
from daebench.runs.ivp import Array
from daebench.runs.request import Request

THROUGH, TO_AND_FRO = TORUS.case, "trough"
"""A motion round the tube in one sense, which is none reversed, and one up and down the tube, which is the same motion reversed."""

SYMMETRIC, ONE_SIDED = "midpoint+symproj", "midpoint+proj"
"""A method that is symmetric, and one that is not; neither is symplectic."""

RUNS = ((SYMMETRIC, THROUGH), (SYMMETRIC, TO_AND_FRO), (ONE_SIDED, TO_AND_FRO))

WINDOWS = 8
"""Windows of time whose mean energy errors are compared."""

STILL, MOVING = 0.05, 0.2
"""Means of windows are level where they differ by less than this part of the largest error, and drift where they do by more than that."""


def reversed_run(name: str, case: str) -> dict[str, Any]:
    """Return a row of a long run on the torus: method, case, the largest energy error, by how much its means over windows differ, turns.

    Turns are those of the angle round the tube: how far it gets in one sense and in the other, in revolutions.
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
    """Test that the symmetric method drifts on the one motion alone, and the other method on the other motion too."""
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
