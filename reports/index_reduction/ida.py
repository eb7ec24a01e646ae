"""IDA on every formulation of the same system: the tolerance that was asked for against the accuracy that was reached."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd

from daebench.draw.figures import QUIET, grid_of_axes, legend_below, save
from daebench.draw.methods import stroke_of
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.pages.report import Progress, count, number, power_of_ten
from daebench.pages.report.claims import require
from daebench.pages.report.exact_motion import exact_motion
from daebench.pages.report.tables import Table, part
from daebench.reports.index_reduction.schemes import FAST, FORMULATIONS, PROBLEM, SLOW
from daebench.runs.make_ivp import constrained
from daebench.runs.request import Request

TOLERANCES = tuple(10.0**-k for k in range(4, 13))
T_END, POINTS = 10.0, 41
SECONDS_LIMIT = 10.0


def measure_ida(tell: Progress) -> pd.DataFrame:
    """Return one row per case, formulation and tolerance.

    Columns: case, formulation, tol, error (largest component of the position error over all outputs), g, Gv (largest residuals over
    them), steps, seconds (CPU), t_reached, failure (empty if there is none).
    """
    rows = []
    runs = [(case, formulation, tol) for case in (SLOW, FAST) for formulation in FORMULATIONS for tol in TOLERANCES]
    times = np.linspace(0.0, T_END, POINTS)
    ivps = {case: constrained(initial_value_problem(PROBLEM, case)) for case in (SLOW, FAST)}
    exact = {case: exact_motion(ivp.source, case, list(times))[0] for case, ivp in ivps.items()}
    for k, (case, formulation, tol) in enumerate(runs):
        tell(k / len(runs), f"IDA, {formulation}, tolerance {tol:.0e}")
        request = Request(value=tol, t_end=T_END, points=POINTS, watch=("manifold",), seconds_limit=SECONDS_LIMIT)
        run = parse(f"ida:{formulation}").solve(ivps[case], request)
        rows.append(
            {
                "case": case,
                "formulation": formulation,
                "tol": tol,
                "error": float("nan") if run.failure else float(np.max(np.abs(run.q - exact[case]))),
                "g": run.maxima["g"],
                "Gv": run.maxima["Gv"],
                "steps": run.steps,
                "seconds": run.seconds,
                "t_reached": float(run.t[-1]),
                "failure": run.failure or "",
            }
        )
    return pd.DataFrame(rows)


def check_ida(ida: pd.DataFrame) -> SimpleNamespace:
    """Return the numbers about IDA: how far its accuracy falls short of the tolerance, and the most accurate formulation."""
    done = ida[ida["failure"] == ""]
    tightest = done[done["tol"] == min(TOLERANCES)]
    ratio = tightest["error"] / tightest["tol"]
    require(len(tightest) and ratio.min() > 10, "at the tightest tolerance every error is over ten times what was asked", ratio.min())
    facts = SimpleNamespace(
        runs=len(ida), failed=len(ida) - len(done), beyond=np.sum(done["error"] > done["tol"]), tightest=min(TOLERANCES)
    )
    facts.useless = done[(done["error"] > 1) & (done["case"] == FAST)]
    facts.useless_names = [label(name) for name in facts.useless["formulation"].unique()]
    for case, name in ((SLOW, "slow"), (FAST, "fast")):
        rows = tightest[tightest["case"] == case].sort_values("error")
        setattr(facts, name, SimpleNamespace(best=rows.iloc[0], worst=rows.iloc[-1]))
    off = tightest[tightest["case"] == FAST].set_index("formulation")
    require(off["g"]["index1"] > 100 * off["g"]["index3"], "index 1 drifts off g = 0 while index 3 holds it", off["g"].to_dict())
    require(off["error"]["index3"] > off["error"]["index1"], "index 3 is less accurate than index 1 nevertheless", off["error"].to_dict())
    facts.fast_g = off["g"]
    return facts


def draw_ida(ida: pd.DataFrame, folder: Path) -> Path:
    """Draw the error that IDA reached against the tolerance that was asked for."""
    figure, axes = grid_of_axes(1, 2, 3.9, x="tolerance asked for", y=r"position error reached  [$\ell$]", sharex=True, sharey=True)
    styles = {formulation: stroke_of(f"ida:{formulation}") for formulation in FORMULATIONS}
    for ax, case, title in zip(axes[0], (SLOW, FAST), ("slow swing (fig1.1)", "fast swing (fig1.2)"), strict=True):
        ends = np.array([ida["tol"].min(), ida["tol"].max()])
        ax.plot(ends, ends, color=QUIET, linewidth=1.0)
        ax.text(3e-10, 1.5e-10, "error = tolerance", color=QUIET, fontsize=8, rotation=28, rotation_mode="anchor", va="top")
        for formulation, stroke in styles.items():
            rows = part(ida, case=case, formulation=formulation)
            ax.plot(rows["tol"], rows["error"], label=label(formulation), **stroke.points())
        ax.set(xscale="log", yscale="log", title=title)
        ax.minorticks_off()
    legend_below(figure, axes[0, 0], 4)
    return save(figure, folder, "ida", ida)


def label(formulation: str) -> str:
    """Return the display name of a formulation."""
    return "GGL" if formulation == "ggl" else f"index {formulation[-1]}"


SHOWN_TOLERANCES = (1e-6, 1e-9, 1e-12)


def ida_table(ida: pd.DataFrame) -> Table:
    """Return a selection of IDA's runs."""
    shown = ida[[any(abs(tol / chosen - 1) < 1e-9 for chosen in SHOWN_TOLERANCES) for tol in ida["tol"]]]
    return Table(
        shown.assign(ms=1e3 * shown["seconds"]),
        {
            "case": ({SLOW: "slow", FAST: "fast"}.get, "swing"),
            "formulation": label,
            "tol": (power_of_ten, "tolerance"),
            "error": (number, "position error"),
            "g": (number, "|<i>g</i>|"),
            "Gv": (number, "|<i>G H<sub>p</sub></i>|"),
            "steps": count,
            "ms": (number, "CPU time<small>ms</small>"),
        },
        ida,
    )
