"""What index reduction costs, on a motion that is not its own reverse and on one that is: the same methods on a torus and on a pendulum."""

from collections.abc import Mapping
from types import SimpleNamespace

import numpy as np
import pandas as pd

from daebench.diagnostics.energy import energy_drift
from daebench.pages.report.claims import require
from daebench.reports._two_motions import BEGUN, EARLY, PENDULUM, TORUS, Motion, Run, measured, require_level, require_lost
from daebench.runs.ivp import Array

METHODS = ("rattle", "lobatto3", "canonical:gauss2", "local:gauss2", "gauss2", "rk4")
SYMMETRIC = METHODS[:-1]

WINDOWS = 240
"""Windows of time, equally wide on a logarithmic axis."""


Both = dict[str, dict[str, Run]]


def measure_motions() -> Both:
    """Return the runs of all methods on the torus and on the pendulum."""
    return {motion.problem: {name: measured(motion, name) for name in METHODS} for motion in (TORUS, PENDULUM)}


def check_motions(runs: Mapping[str, Mapping[str, Run]]) -> SimpleNamespace:
    """Return the numbers of the picture; the first claim of the picture that does not hold raises ClaimRefuted."""
    torus, pendulum = runs[TORUS.problem], runs[PENDULUM.problem]
    for name in ("rattle", "lobatto3", "canonical:gauss2"):
        require_level(torus[name], f"{name} on the torus")
    fit = energy_drift(torus["rattle"].t, torus["rattle"].energy_error)
    require(fit.verdict == "bounded", "the energy of RATTLE on the torus is bounded", fit.brief)
    for name in ("gauss2", "local:gauss2"):
        require_lost(torus[name], f"{name} on the torus")
    for name in SYMMETRIC:
        require_level(pendulum[name], f"{name} on the pendulum")
    require(pendulum["rk4"].failure is not None, "RK4 on the pendulum does not reach the end", "a complete run")
    reduced, rattle = torus["gauss2"], torus["rattle"]
    better = rattle.by(BEGUN) / reduced.by(BEGUN)
    require(better > 100, "Gauss begins more than 100 times as accurate as RATTLE", better)
    crossing = reduced.passes(rattle.most)
    require(EARLY < crossing < TORUS.t_end / 4, "on (1.18) it crosses the line of RATTLE early in the run", crossing)
    return SimpleNamespace(
        flat=rattle.most,
        better=better,
        crossing=crossing,
        end=reduced.most,
        canonical=torus["canonical:gauss2"].most,
        pendulum_reduced=pendulum["gauss2"].most,
        pendulum_rattle=pendulum["rattle"].most,
        gone=float(pendulum["rk4"].t[-1]),
        gone_torus=float(torus["rk4"].t[-1]),
    )


def envelope(run: Run, motion: Motion) -> tuple[Array, Array]:
    """Return the ends of windows of time, and the largest modulus of the energy error up to each; shape(k,) both."""
    steps = len(run.t) - 1
    ends = np.unique(np.round(np.geomspace(1, motion.t_end / motion.h, WINDOWS)).astype(int))
    ends = np.unique(np.append(ends[ends < steps], steps))
    return run.t[ends], run.largest[ends]


def motions_table(runs: Mapping[str, Mapping[str, Run]]) -> pd.DataFrame:
    """Return the largest energy errors so far, one row per motion, method and window."""
    frames = []
    for motion in (TORUS, PENDULUM):
        for name, run in runs[motion.problem].items():
            t, error = envelope(run, motion)
            frames.append(pd.DataFrame({"problem": motion.problem, "method": name, "h": motion.h, "t": t, "energy_error": error}))
    return pd.concat(frames, ignore_index=True)
