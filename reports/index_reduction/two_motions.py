"""Two long motions that show the cost of index reduction: on a torus, and on a pendulum, whose motion in reverse is its mirror image."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from types import SimpleNamespace

import numpy as np
import pandas as pd

from daebench.diagnostics.energy import energy_drift
from daebench.diagnostics.energy_verdict import energy_error
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.pages.report.claims import require
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.make_ivp import constrained
from daebench.runs.request import Request

EARLY = 30.0
"""Initial part of the runs that shows the first level of an error, s."""

BEGUN = 5.0
"""Part of the runs over which the accuracy at the beginning is compared, s."""

LEVEL, LOST = 1.05, 5.0
"""An error that stays level is at most this many times its first level; one that grows is at least so many times."""

FLOOR = 1e-9
"""An error below it may grow by rounding alone: angles that go round for 1e4 s have lost four digits."""


@dataclass(frozen=True)
class Motion:
    """A motion: its problem, its step and its length."""

    problem: str
    case: str
    """Problem and case of the catalogue."""
    h: float
    t_end: float
    """Step size and end, s."""
    q0: tuple[float, ...] | None = None
    p0: tuple[float, ...] | None = None
    """Initial positions and momenta, in place of those of the case."""

    def ivp(self) -> ConstrainedIvp:
        """Return the initial value problem."""
        return constrained(initial_value_problem(self.problem, self.case, q0=self.q0, p0=self.p0))


SPEED = 0.3
"""Speed with which the pendulum is pushed sideways, one radian from hanging, m/s."""

TORUS = Motion("torus", "through_hole", 0.1, 1e4)
PENDULUM = Motion("spherical_pendulum", "fig1.1", 0.05, 5e3, q0=(float(np.sin(1.0)), 0.0, float(-np.cos(1.0))), p0=(0.0, SPEED, 0.0))


@dataclass(frozen=True)
class Run:
    """One run, step by step."""

    t: Array
    """Times; shape (n,)."""
    q: Array
    """Positions; shape (n, 3)."""
    energy_error: Array
    """H - H0; infinite where it overflows; shape (n,)."""
    g: float
    """Largest |g| along the run."""
    failure: str | None
    """Why the run stopped before the end."""

    @property
    def largest(self) -> Array:
        """Largest modulus of the energy error so far, shape(n,)."""
        return np.asarray(np.maximum.accumulate(np.abs(self.energy_error)))

    @property
    def most(self) -> float:
        """Largest energy error of the run."""
        return float(self.largest[-1])

    def by(self, t: float) -> float:
        """Return the largest energy error up to a time."""
        return float(self.largest[np.searchsorted(self.t, t + 1e-9) - 1])

    @property
    def growth(self) -> float:
        """Largest error of the run in units of its first level; infinite for a run that stops."""
        return float("inf") if self.failure else self.most / max(self.by(EARLY), FLOOR / LEVEL)

    def passes(self, level: float) -> float:
        """Return the first time at which the energy error is larger than a level."""
        return float(self.t[np.argmax(self.largest > level)])


@cache
def measured(motion: Motion, name: str) -> Run:
    """Return the run of a method."""
    ivp = motion.ivp()
    run = parse(name).solve(ivp, Request(value=motion.h, t_end=motion.t_end, every=1, watch=("manifold",)))
    with np.errstate(over="ignore", invalid="ignore"):
        error = np.nan_to_num(energy_error(ivp, run), nan=np.inf)
    return Run(run.t, run.q, error, float(run.maxima["g"]), run.failure)


def require_level(run: Run, of: str) -> None:
    """Require that the energy error of a run stays at its first level to its end."""
    require(run.growth <= LEVEL, f"the energy error of {of} stays level", f"{run.growth:.3g} times its first level: {run.failure}")


def require_lost(run: Run, of: str) -> None:
    """Require that the energy error of a run grows to its end, which it reaches."""
    require(LOST <= run.growth < np.inf, f"the energy error of {of} grows", f"{run.growth:.3g} times its first level: {run.failure}")


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
        gone=pendulum["rk4"].t[-1],
        gone_torus=torus["rk4"].t[-1],
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
