"""HLW Fig. 4.1: predator and prey with h = 0.25, the exact orbits beneath, and the form of symplectic Euler that leaves the domain."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from daebench.diagnostics.energy import energy_drift
from daebench.diagnostics.section import closure, section
from daebench.reports.poisson.runs import errors, ivp_of, solve
from daebench.runs.ivp import Array, PoissonIvp
from daebench.runs.trajectory import PoissonTrajectory

CASES = ("4,2", "6,2")
METHODS = ("symplectic_euler_adjoint", "verlet", "midpoint")
"""The three panels of HLW Fig. 4.1."""

PRINTED = "symplectic_euler"
"""The method as Example 4.7 prints it."""

H, STEPS = 0.25, 1000
AROUND = 361
FOLLOWED = 5
"""Closure is measured on a run this many times as long: crossings return to their place only after tens of revolutions."""


@dataclass(frozen=True)
class Orbits:
    """Fig. 4.1 in numbers.

    Parameters
    ----------
    points : DataFrame
        case, method, t, u, v, energy: all states of the runs, with the energy error.
    exact : DataFrame
        case, u, v: the level curves of H.
    table : DataFrame
        One row per case and method: whether and where the run ended, the error of the energy, how well the orbit closes.
    """

    points: pd.DataFrame
    exact: pd.DataFrame
    table: pd.DataFrame


def orbits(steps: int = STEPS) -> Orbits:
    """Return the runs of Fig. 4.1 and of the printed form."""
    points, exact, rows = [], [], []
    for case in CASES:
        ivp = ivp_of("lotka_volterra", case)
        exact.append(level_curve(ivp).assign(case=case))
        for name in (PRINTED, *METHODS):
            run = solve(ivp, name, H, steps)
            energy = errors(ivp, run)["energy"]
            points.append(pd.DataFrame({"case": case, "method": name, "t": run.t, "u": run.y[:, 0], "v": run.y[:, 1], "energy": energy}))
            drift = energy_drift(run.t, energy)
            numbers = {"most": np.max(np.abs(energy)), "kind": drift.brief, "slope": drift.slope, "left": left(ivp, run.y)}
            numbers |= {"steps": run.steps, "t": run.t[-1], "failure": run.failure or ""} | (
                closed(ivp, solve(ivp, name, H, FOLLOWED * steps)) if not run.failure else {}
            )
            last = run.y[-1]
            u_next, v_next = printed_step(last, H, ivp.parameters) if name == PRINTED and run.failure else (np.nan, np.nan)
            rows.append({"case": case, "method": name, "u": last[0], "v": last[1], "u_next": u_next, "v_next": v_next} | numbers)
    return Orbits(pd.concat(points, ignore_index=True), pd.concat(exact, ignore_index=True), pd.DataFrame(rows))


def printed_step(y: Array, h: float, parameters: Mapping[str, float]) -> tuple[float, float]:
    """Return the next state of symplectic Euler of HLW Ex. 4.7, solved by hand: its implicit equation is linear in u1.

    ::

        u1 = u + h u1 (v - b)      v1 = v - h v (u1 - a)
    """
    u1 = y[0] / (1 - h * (y[1] - parameters["b"]))
    return float(u1), float(y[1] - h * y[1] * (u1 - parameters["a"]))


def level_curve(ivp: PoissonIvp) -> pd.DataFrame:
    """Return the exact orbit: the curve on which H has its value at the start.

    In logarithms H is convex about the equilibrium, so each ray from the equilibrium meets the curve once.
    """
    from scipy.optimize import brentq

    centre = np.log([ivp.parameters["a"], ivp.parameters["b"]])
    level = float(ivp.value("H", ivp.y0))
    points = []
    for angle in np.linspace(0, 2 * np.pi, AROUND):
        ray = np.array([np.cos(angle), np.sin(angle)])
        points.append(np.exp(centre + brentq(partial(above, ivp, centre, ray, level), 1e-3, 50.0, xtol=1e-13) * ray))
    return pd.DataFrame(points, columns=["u", "v"])


def above(ivp: PoissonIvp, centre: Array, ray: Array, level: float, r: float) -> float:
    """Return H minus a level at the distance r along a ray, in logarithms."""
    return float(ivp.value("H", np.exp(centre + r * ray)) - level)


def closed(ivp: PoissonIvp, run: PoissonTrajectory) -> dict[str, Any]:
    """Return how well the orbit of a run closes, from its crossings of the line v = b beyond the equilibrium."""
    orbit_closure = closure(section(ivp, run, center=(ivp.parameters["a"], ivp.parameters["b"]), direction=(1, 0)))
    wander = orbit_closure.drift.slope * float(run.t[-1])
    return {
        "revolutions": orbit_closure.revolutions,
        "period": orbit_closure.period,
        "spread": orbit_closure.spread,
        "wander": wander,
        "orbit": orbit_closure.drift.brief,
    }


def left(ivp: PoissonIvp, y: Array) -> float:
    """Return the remaining fraction of the energy above the equilibrium: its mean over the last tenth of a run, relative to the start."""
    level = ivp.along("H", y)
    lowest = float(ivp.value("H", [ivp.parameters["a"], ivp.parameters["b"]]))
    return float((np.mean(level[-max(1, len(level) // 10) :]) - lowest) / (level[0] - lowest))
