"""One row per method: the class of B that it claims, the measured conservation, and the cost of a step."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from daebench.diagnostics.energy import energy_drift
from daebench.pages.report import NONE, count, number, with_error
from daebench.pages.report.claims import require
from daebench.pages.report.tables import Of, Table, code, tiny
from daebench.reports.poisson.body import VISIBLE
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
CASIMIR_SYSTEMS = {"lotka_volterra_3d": "species", "free_rigid_body": "body"}


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


def check_methods(frame: pd.DataFrame) -> SimpleNamespace:
    """Test claims against measurements, method by method."""
    for row in frame.to_dict("records"):
        name = row["method"]
        good = row["defect"] <= ROUND_OFF if row["claimed"] else row["defect"] > VISIBLE
        require(good, f"{name} is {'' if row['claimed'] else 'not '}a Poisson map", row["defect"])
        if row["claimed"]:
            require(row["kind"] in ("bounded", "kept"), f"the energy of {name} is bounded", row["kind"])
        else:
            require(row["kind"] != "bounded", f"the energy of {name} is not bounded", row["kind"])
    lost = frame.set_index("method").loc["rk4"]
    require(
        min(lost["casimir_lotka_volterra_3d"], lost["casimir_free_rigid_body"]) > VISIBLE, "rk4 keeps no Casimir function", lost.to_dict()
    )
    worst = float(frame["defect"][frame["claimed"]].max())
    return SimpleNamespace(poisson=frame["claimed"].sum(), defect=worst, ns=frame.set_index("method")["ns"].to_dict())


def table(frame: pd.DataFrame) -> Table:
    """Return the closing table."""
    structures = {"split": "parts with known flows", "constant": "constant", "bilinear": "one bilinear block", "": "none"}
    return Table(
        frame,
        {
            "method": code,
            "order": count,
            "class": (
                Of(lambda structure, form: "canonical coordinates" if form else structures[structure], "class", "form"),
                "Poisson integrator for<small>structure of B, H</small>",
            ),
            "claimed": (lambda holds: "yes" if holds else "no", "Poisson<small>map</small>"),
            "defect": (tiny, "defect<small>of 3 steps</small>"),
            "casimirs": (Of(conserving_on), "Casimirs<small>kept</small>"),
            "energy": (number, "energy<small>largest error</small>"),
            "drift": (Of(drift, "slope", "slope_error", "kind"), "energy drift<small>per unit of time</small>"),
            "ns": (number, "ns<small>per step</small>"),
        },
    )


def drift(slope: float, error: float, kind: str) -> Markup:
    """Return the drift of the energy as HTML."""
    return Markup("bounded") if kind == "bounded" else with_error(slope, error)


def conserving_on(row: Mapping[Any, Any]) -> str:
    """Return on which systems a method keeps the Casimir function, of those on which it can be run."""
    errors = {name: row[f"casimir_{problem}"] for problem, name in CASIMIR_SYSTEMS.items() if np.isfinite(row[f"casimir_{problem}"])}
    good = [name for name, error in errors.items() if error <= ROUND_OFF]
    return NONE if not errors else "all" if len(good) == len(errors) else ", ".join(good) or "none"
