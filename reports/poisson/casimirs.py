"""Casimir functions on three systems: errors of each method, and how they grow with time."""

from functools import partial
from pathlib import Path
from types import MappingProxyType, SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd

from daebench.diagnostics.drift import LAWS
from daebench.draw.figures import grid_of_axes, legend_below, save
from daebench.draw.methods import name_of, stroke_of
from daebench.pages.report import number
from daebench.pages.report.claims import require
from daebench.pages.report.tables import Of, Table, code, once, text, tiny
from daebench.reports.poisson.defects import LEAST
from daebench.reports.poisson.runs import ROUND_OFF, VISIBLE, defect, errors, ivp_of, kind, method, solve

METHODS = ("strang", "strang/suzuki4", "darboux:verlet", "midpoint", "rk4")
SYSTEMS = MappingProxyType(
    {
        "lotka_volterra_3d": ("blow_up", 0.005, 340),
        "free_rigid_body": ("hlw", 0.4, 2500),
        "heavy_top_lie_poisson": ("lagrange", 0.05, 4000),
    }
)
"""Each system with its case, step size and number of steps."""

TITLES = MappingProxyType(
    {"lotka_volterra_3d": "three species", "free_rigid_body": "free rigid body", "heavy_top_lie_poisson": "heavy top (Lagrange)"}
)
BLOW_UP = 1.7479
"""Time at which the three species go to infinity, HLW (2.14)."""

BEYOND = 400
"""Number of steps that would lead beyond it."""

SHOWN = 400
DEFECT_STEPS = MappingProxyType({"lotka_volterra_3d": 250, "free_rigid_body": 3, "heavy_top_lie_poisson": 3})
"""Steps over which the defect is measured: many for the species, which hardly move at first."""


def casimirs(problem: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return the table of a system, one row per method, and the errors over time, thinned out evenly in log t."""
    case, h, steps = SYSTEMS[problem]
    ivp = ivp_of(problem, case)
    rows, series = [], []
    for name in METHODS:
        if method(name).refusal(ivp) is not None:
            continue
        run = solve(ivp, name, h, steps).complete()
        deviations = errors(ivp, run)
        largest = np.max(np.abs([deviations[quantity] for quantity in ivp.casimirs]), axis=0)
        row = {"problem": problem, "method": name, "h": h, "t_end": run.t[-1], "defect": defect(ivp, name, h, DEFECT_STEPS[problem])}
        row |= {"energy": np.max(np.abs(deviations["energy"])), "energy_kind": kind(run.t, deviations["energy"])}
        row |= {"casimir": largest.max(), "casimir_kind": worst([kind(run.t, deviations[quantity]) for quantity in ivp.casimirs])}
        rows.append(row)
        indices = np.unique(np.geomspace(1, steps, SHOWN).astype(int))
        so_far = np.maximum.accumulate(largest)
        series.append(pd.DataFrame({"problem": problem, "method": name, "t": run.t[indices], "casimir": so_far[indices]}))
    return pd.DataFrame(rows), pd.concat(series, ignore_index=True)


def worst(kinds: list[str]) -> str:
    """Return the worst verdict on several errors."""
    return max(kinds, key=("kept", "bounded", "undetermined", "failed", *LAWS).index)


def break_off(name: str) -> dict[str, object]:
    """Return when and why a run on the three species that would lead beyond their blow-up breaks off."""
    ivp = ivp_of("lotka_volterra_3d", SYSTEMS["lotka_volterra_3d"][0])
    run = solve(ivp, name, SYSTEMS["lotka_volterra_3d"][1], BEYOND)
    return {"method": name, "t": float(run.t[-1]), "failure": run.failure or ""}


EPS = 2.3e-16
"""Spacing of numbers at 1."""


POISSON_METHODS = ("strang", "strang/suzuki4", "darboux:verlet")


def check_casimirs(frame: pd.DataFrame, break_off: pd.DataFrame) -> SimpleNamespace:
    """Test that Poisson integrators keep all Casimir functions, midpoint the quadratic ones, and rk4 none."""
    rows = {(row["problem"], row["method"]): row for row in frame.to_dict("records")}
    casimir_errors = []
    for (problem, name), row in rows.items():
        if name in POISSON_METHODS:
            good = row["casimir"] <= ROUND_OFF and row["defect"] <= ROUND_OFF
            require(good, f"{name} keeps the Casimir functions of {problem}", (row["casimir"], row["defect"]))
            casimir_errors.append(row["casimir"])
        else:
            require(row["defect"] > 100 * ROUND_OFF, f"{name} is not a Poisson map on {problem}", row["defect"])
    for problem in ("free_rigid_body", "heavy_top_lie_poisson"):
        row, other = rows[problem, "midpoint"], rows[problem, "rk4"]
        require(row["casimir"] <= ROUND_OFF, f"midpoint keeps the quadratic Casimir functions of {problem}", row["casimir"])
        require(row["defect"] > VISIBLE, f"midpoint is nevertheless not a Poisson map on {problem}", row["defect"])
        require(other["casimir_kind"] == "linear", f"rk4 loses Casimir functions of {problem} linearly", other["casimir_kind"])
    species = {name: rows["lotka_volterra_3d", name] for name in ("midpoint", "rk4")}
    for name, row in species.items():
        require(row["casimir"] > VISIBLE, f"{name} loses the Casimir function of the three species", row["casimir"])
    require((break_off["failure"] != "").all(), "every method breaks off", break_off["failure"].tolist())
    off = float((break_off["t"] - BLOW_UP).abs().max())
    require(off < 0.02, "it does so within 0.02 of the blow-up", off)
    return SimpleNamespace(kept=max(casimir_errors), species=species, rows=rows, first=break_off["t"].min(), last=break_off["t"].max())


def draw_casimirs(series: pd.DataFrame, folder: Path) -> Path:
    """Draw the largest error so far of the Casimir functions against time, one panel per system."""
    figure, axes = grid_of_axes(1, 3, 3.5, sharey=True)
    for ax, problem in zip(axes[0], SYSTEMS, strict=True):
        for name, history in series[series["problem"] == problem].groupby("method", sort=False):
            plot_so_far(ax, history["t"], history["casimir"], str(name))
        ax.set(xscale="log", yscale="log", title=TITLES[problem], xlabel="time $t$", ylim=(LEAST / 2, 1e-1))
    axes[0, 0].set_ylabel("largest Casimir error so far")
    legend_below(figure, axes[0, 0], 5, columnspacing=1.3)
    return save(figure, folder, "casimirs", series)


def plot_so_far(ax: Any, t: "pd.Series[float]", value: "pd.Series[float]", name: str) -> None:
    """Draw one curve over time, with a few markers."""
    begin = len(ax.lines)
    ax.plot(t, np.maximum(value, LEAST), label=name_of(name), markevery=(4 * begin, 40), **stroke_of(name).points())
    ax.axhspan(LEAST / 2, EPS, color="#eeeeee", zorder=0, linewidth=0)


def table(frame: pd.DataFrame, break_off: pd.DataFrame) -> Table:
    """Return the errors of Casimir functions and energy, system by system, and when runs on the three species break off."""
    off = frame["method"].map(break_off.set_index("method")["t"]).where(frame["problem"] == "lotka_volterra_3d")
    return Table(
        frame.assign(system=once(frame["problem"].map(TITLES)), off=off),
        {
            "system": text,
            "method": code,
            "defect": (tiny, "Poisson<small>defect</small>"),
            "casimir": (tiny, "Casimir functions<small>largest error</small>"),
            "casimir_kind": "<small>which is</small>",
            "energy": (tiny, "energy<small>largest error</small>"),
            "energy_kind": "<small>which is</small>",
            "off": (Of(partial(number, digits=4), "off"), "breaks off<small>at t</small>"),
        },
        frame,
    )
