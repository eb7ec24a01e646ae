"""One row per method: the class of B that it claims, the measured conservation, and the cost of a step."""

from collections.abc import Mapping

import numpy as np

from daebench.diagnostics.energy import energy_drift
from daebench.reports.poisson.casimirs import SYSTEMS
from daebench.reports.poisson.runs import ROUND_OFF, defect, errors, ivp_of, method, solve
from daebench.runs.request import Request

METHODS = (
    "symplectic_euler_adjoint",
    "verlet",
    "strang",
    "strang/suzuki4",
    "darboux:symplectic_euler",
    "darboux:verlet",
    "midpoint",
    "rk4",
)
H, STEPS = 0.1, 2000
DEFECT_STEPS = 3
TIMED_STEPS, TIMED_RUNS = 200_000, 5
CASIMIR_SYSTEMS = ("lotka_volterra_3d", "free_rigid_body")


def summary(name: str) -> dict[str, object]:
    """Return the row of a method on predator and prey, with its Casimir errors on two systems that have Casimir functions."""
    ivp = ivp_of("lotka_volterra", "4,2")
    run = solve(ivp, name, H, STEPS).complete()
    energy = errors(ivp, run)["energy"]
    drift, chosen = energy_drift(run.t, energy), method(name)
    structure = chosen.member.poisson
    row: dict[str, object] = {"method": name, "order": chosen.order, "class": structure}
    row |= {"form": chosen.form, "claimed": chosen.is_poisson(ivp), "defect": defect(ivp, name, H, DEFECT_STEPS)}
    row |= {"energy": np.max(np.abs(energy)), "kind": drift.brief, "slope": drift.slope, "slope_error": drift.slope_error}
    return row | {f"casimir_{problem}": casimir(problem, name) for problem in CASIMIR_SYSTEMS} | {"ns": nanoseconds(name)}


def casimir(problem: str, name: str) -> float:
    """Return the largest error of the Casimir function of a system; NaN if the method cannot be run on it."""
    case, h, steps = SYSTEMS[problem]
    ivp = ivp_of(problem, case)
    if method(name).refusal(ivp) is not None:
        return float("nan")
    deviations = errors(ivp, solve(ivp, name, h, steps).complete())
    return float(max(np.max(np.abs(deviations[quantity])) for quantity in ivp.casimirs))


def nanoseconds(name: str) -> float:
    """Return the CPU time of a compiled step on predator and prey, best of several runs."""
    request = Request(value=0.01, steps=TIMED_STEPS, every=0, watch=(), count=False)
    ivp = ivp_of("lotka_volterra", "4,2")
    runs = [method(name, compiled=True).solve(ivp, request).complete() for _ in range(TIMED_RUNS)]
    return float(min(1e9 * run.seconds / run.steps for run in runs))


def kept(errors: Mapping[str, float]) -> str:
    """Return the systems on which a method keeps the Casimir function, of those on which it can be run; "" if there are none.

    Parameters
    ----------
    errors : mapping of str to float
        Largest error by system, NaN where the method cannot be run.

    Returns
    -------
    str
        "all", "none", or names of systems.
    """
    run = {problem: error for problem, error in errors.items() if np.isfinite(error)}
    good = [problem for problem, error in run.items() if error <= ROUND_OFF]
    if not run:
        return ""
    return "all" if len(good) == len(run) else ", ".join(good) or "none"
