"""Three ways to hold the rod: one pendulum and one step size for RATTLE, symplectic Euler and RK4 on (1.18), followed to t = 5000."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pandas as pd

from daebench.diagnostics.energy import energy_drift
from daebench.diagnostics.integrals import energy_error
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.pages.report.claims import require
from daebench.reports.index_reduction.numbers import PROBLEM
from daebench.runs.ivp import Array
from daebench.runs.make_ivp import constrained
from daebench.runs.request import Request

METHODS = ("rattle", "se", "rk4")
Q0, P0 = (float(np.sin(1.0)), 0.0, float(-np.cos(1.0))), (0.0, 0.3, 0.0)
H, T_END = 0.05, 5000.0
ROD = 0.81
"""Length of the rod of ``se`` up to which it is drawn; it is 1 at the start."""

EARLY = 2.0
"""Initial part of the runs over which RK4 and RATTLE are compared, units of time."""

WINDOWS = 240
"""Windows of time, equally wide on a logarithmic axis."""


@dataclass(frozen=True)
class Held:
    """One run, step by step.

    Parameters
    ----------
    t : ndarray, shape(n,)
        Times.
    q : ndarray, shape(n, 3)
        Positions.
    energy_error : ndarray, shape(n,)
        H - H0; infinite where it overflows.
    failure : str or None
        Why the run stopped before the end.
    """

    t: Array
    q: Array
    energy_error: Array
    failure: str | None

    @property
    def rod(self) -> Array:
        """Distances from the point of suspension, shape(n,)."""
        with np.errstate(over="ignore"):
            return np.asarray(np.linalg.norm(self.q, axis=1))


def measure_rods() -> dict[str, Held]:
    """Return the run of each method."""
    ivp = constrained(initial_value_problem(PROBLEM, q0=Q0, p0=P0))
    runs = {}
    for name in METHODS:
        run = FixedStep(name).solve(ivp, Request(value=H, t_end=T_END, every=1, watch=()))
        with np.errstate(over="ignore", invalid="ignore"):
            error = np.nan_to_num(energy_error(ivp, run), nan=np.inf)
        runs[name] = Held(run.t, run.q, error, run.failure)
    return runs


def check_rods(runs: Mapping[str, Held]) -> SimpleNamespace:
    """Return the numbers that the picture prints; the first claim of the picture that does not hold raises ClaimRefuted."""
    rattle, se, rk4 = (runs[name] for name in METHODS)
    flat = float(np.abs(rattle.energy_error).max())
    require(rattle.failure is None and rattle.t[-1] == T_END, "RATTLE reaches the end", rattle.failure)
    require(np.abs(rattle.rod - 1).max() < 1e-13, "RATTLE keeps the rod's length to round-off", np.abs(rattle.rod - 1).max())
    fit = energy_drift(rattle.t, rattle.energy_error)
    require(fit.verdict == "bounded", "the energy of RATTLE is bounded", fit.brief)
    better = largest_before(rattle, EARLY) / largest_before(rk4, EARLY)
    require(better > 100, "RK4 starts more than 100 times as accurate", better)
    crossing = float(rk4.t[np.argmax(np.abs(rk4.energy_error) > flat)])
    require(EARLY < crossing < T_END / 10, "RK4 crosses RATTLE's line early in the run", crossing)
    gone = float(rk4.t[-1])
    require(rk4.failure is not None and gone < T_END, "RK4 does not reach the end", gone)
    require(np.abs(rk4.energy_error).max() > 1e10, "the energy of RK4 ends at infinity", np.abs(rk4.energy_error).max())
    require(se.failure is not None and se.t[-1] < crossing, "se stops before RK4 crosses RATTLE's line", se.t[-1])
    require(se.rod.min() < ROD, f"the rod of se gets shorter than {ROD}", se.rod.min())
    short = int(np.argmax(se.rod < ROD))
    return SimpleNamespace(flat=flat, better=better, crossing=crossing, gone=gone, short=short, se_stops=float(se.t[-1]))


def largest_before(run: Held, t: float) -> float:
    """Return the largest modulus of the energy error up to a time."""
    return float(np.abs(run.energy_error[run.t <= t]).max())


def envelope(run: Held) -> tuple[Array, Array]:
    """Return the ends of windows of time, and the largest modulus of the energy error in each; shape(k,) both."""
    steps = len(run.t) - 1
    ends = np.unique(np.round(np.geomspace(1, T_END / H, WINDOWS)).astype(int))
    ends = np.unique(np.append(ends[ends < steps], steps))
    starts = np.concatenate([[0], ends[:-1]])
    return run.t[ends], np.maximum.reduceat(np.abs(run.energy_error[1:]), starts)


def rods_table(runs: Mapping[str, Held]) -> pd.DataFrame:
    """Return the largest energy errors in windows of time, one row per method and window."""
    frames = []
    for name, run in runs.items():
        t, error = envelope(run)
        frames.append(pd.DataFrame({"method": name, "h": H, "t": t, "energy_error": error}))
    return pd.concat(frames, ignore_index=True)
