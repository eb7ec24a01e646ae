"""The Ablowitz-Ladik lattice: its four integrals over time at one step size, and the cost of a step by the number of sites."""

import numpy as np
import pandas as pd

from daebench.reports.poisson.runs import errors, ivp_of, kind, method
from daebench.runs.request import Request

PROBLEM, CASE = "ablowitz_ladik", "hlw16"
METHODS = ("strang", "strang/suzuki4", "darboux:verlet", "midpoint", "rk4")
QUANTITIES = ("energy", "norm", "coupling", "momentum")
SITES, H, T_END, EVERY = 16, 2e-4, 20.0, 50
FINE = H / 8
"""Step size of a second run of ``strang``, with which its error is asymptotic."""

SIZES = (16, 256, 5_000, 100_000)
SITE_STEPS = 400_000
"""Product of steps and sites of a timed run."""

TIMED_RUNS = 3
SHOWN = 300


def invariants(name: str, h: float = H, t_end: float = T_END) -> tuple[dict[str, object], pd.DataFrame]:
    """Return the row of a method, and the errors so far of energy and integrals over time, thinned out evenly in log t."""
    ivp, every = ivp_of(PROBLEM, CASE), round(EVERY * H / h)
    run = method(name, compiled=True).solve(ivp, Request(value=h, t_end=t_end, every=every, watch=())).complete()
    deviations = errors(ivp, run)
    row: dict[str, object] = {"method": name, "h": h, "ns": 1e9 * run.seconds / run.steps}
    for quantity in QUANTITIES:
        row |= {quantity: np.max(np.abs(deviations[quantity])), f"{quantity}_kind": kind(run.t, deviations[quantity])}
    indices = np.unique(np.geomspace(1, len(run.t) - 1, SHOWN).astype(int))
    so_far = {quantity: np.maximum.accumulate(np.abs(deviations[quantity]))[indices] for quantity in QUANTITIES}
    return row, pd.DataFrame({"method": name, "h": h, "t": run.t[indices]} | so_far)


def sizes_of_integrals() -> dict[str, float]:
    """Return energy and integrals at the start, by name."""
    ivp = ivp_of(PROBLEM, CASE)
    values = [ivp.along("H", ivp.y0[None])[0], *ivp.along("integrals", ivp.y0[None])[0]]
    return dict(zip(("energy", *ivp.integrals), map(float, values), strict=True))


def speeds() -> dict[str, float]:
    """Return how fast the state moves at the start, and how fast the logarithms alone would turn it: every y_k at the rate 2/dx^2."""
    ivp = ivp_of(PROBLEM, CASE)
    moving = float(np.linalg.norm(ivp.value("field", ivp.y0)))
    return {"all": moving, "part": 2 * SITES**2 * float(np.linalg.norm(ivp.y0)), "rate": 2.0 * SITES**2}


def cost(sites: int) -> dict[str, object]:
    """Return the CPU time of a step of ``strang`` per site, best of several runs."""
    ivp = ivp_of(PROBLEM, CASE, {"sites": sites})
    request = Request(value=0.02 / sites**2, steps=max(4, SITE_STEPS // sites), every=0, watch=())
    runs = [method("strang", compiled=True).solve(ivp, request).complete() for _ in range(TIMED_RUNS)]
    return {"sites": sites, "ns_per_site": min(1e9 * run.seconds / run.steps / sites for run in runs)}
