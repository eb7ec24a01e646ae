"""A long run of each method: whether energy and constraint residuals drift or are bounded."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from daebench.diagnostics.drift import BOUNDED, DRIFTS, FAILED
from daebench.diagnostics.drift import KEPT as ROUNDING
from daebench.diagnostics.energy_verdict import energy_error, energy_verdict
from daebench.diagnostics.manifold import distance, manifold_drift
from daebench.draw.figures import grid_of_axes, legend_below, save
from daebench.draw.methods import curve_of
from daebench.methods.names import parse
from daebench.pages.report import with_error
from daebench.pages.report.claims import require
from daebench.pages.report.tables import Of, code, tiny
from daebench.reports.methods.defects import EPS, LEAST
from daebench.reports.methods.families import SOFTENED, method
from daebench.reports.methods.matrix import keeping
from daebench.reports.methods.sweep import HIGH, LONGER, MOTIONS, TOL, TORUS, ivp_of
from daebench.runs.ivp import ConstrainedIvp
from daebench.runs.request import Request
from daebench.runs.trajectory import Trajectory

LONG = ("symplectic_euler", "rattle", "lobatto3", "energy_momentum", "midpoint", "midpoint+symproj", "radau2_ggl", "rk4", "rk4+proj")
"""Methods whose long run has curves, and whose order is also measured on the torus."""

T_LONG = 1000.0
LONG_POINTS = 20001
"""Outputs of a long run of IDA."""
WINDOWS = 100
"""Windows of time in each of which the largest value is drawn."""


ROUND_OFF = 1e-9
"""An energy error over a long run up to this is round-off."""


def long_run(name: str) -> tuple[pd.DataFrame, dict[str, Any]]:
    """Return a long run in windows (t, energy, distance, the largest in each) and a row with the verdicts on energy and residuals.

    It is on the torus, or on the pendulum for a method that refuses the torus. A run that stops early gives a row that says so, and the
    windows up to its end.
    """
    integrator = method(name, compiled=True)
    motion = next(motion for motion in reversed(MOTIONS) if integrator.refusal(ivp_of(motion)) is None)
    ivp, h = ivp_of(motion), motion.h * (LONGER if integrator.claims.order >= HIGH else 1)
    run = integrator.solve(ivp, Request(value=h, t_end=T_LONG, watch=(), count=False))
    energy, away = energy_error(ivp, run), distance(ivp, run.p, run.q)
    window = np.minimum((run.t / T_LONG * WINDOWS).astype(int), WINDOWS - 1)
    sampled = pd.DataFrame({"window": window, "t": run.t, "energy": np.abs(energy), "distance": away})
    shown = sampled.groupby("window", as_index=False).max().assign(method=name)
    about = {"method": name, "problem": motion.problem, "h": h}
    return shown[["method", "t", "energy", "distance"]], about | verdicts(ivp, run) | {"distance": np.max(away)}


def ida_long(name: str) -> dict[str, Any]:
    """Return the row of a long run of IDA on the torus."""
    ivp = ivp_of(TORUS)
    run = parse(name).solve(ivp, Request(value=TOL, t_end=T_LONG, points=LONG_POINTS, watch=()))
    assert isinstance(run, Trajectory)
    return {"method": name, "problem": TORUS.problem, "tol": TOL} | verdicts(ivp, run)


def verdicts(ivp: ConstrainedIvp, run: Trajectory) -> dict[str, Any]:
    """Return the verdicts on energy, g and G H_p along a run, under the keys of the matrix, and more of the energy."""
    drift, manifold = energy_verdict(ivp, run), manifold_drift(ivp, run)
    row = {"energy": np.max(np.abs(energy_error(ivp, run))), "failure": run.failure or ""}
    row |= {"kind": drift.brief, "slope": drift.slope, "slope_error": drift.slope_error, "growth": drift.exponent}
    said = {"H_long": drift.verdict, "g_long": manifold.g.verdict, "Gv_long": manifold.Gv.verdict}
    return row | (dict.fromkeys(said, FAILED) if run.failure else said)


ON_MANIFOLD = 1e-11
"""A distance from the manifold over a long run up to this is round-off."""


def check_long(drift: pd.DataFrame, table: pd.DataFrame) -> SimpleNamespace:
    """Test that symplectic methods bound the energy over the long run, and that methods on the manifold stay there.

    The energy is tested for all methods that aim at the constrained motion, the distance only for those whose curves are shown.
    """
    run = drift.set_index("method")
    aiming = [name for name in keeping(table, "symplectic") if name in run.index and method(name).form not in SOFTENED]
    for name in aiming:
        good = run["H_long"][name] in (BOUNDED, ROUNDING) and run["failure"][name] == ""
        require(good, f"the energy of {name} is bounded", run.loc[name, ["kind", "failure"]].to_dict())
    run = run.loc[[name for name in LONG if name in run.index]]
    symplectic = [name for name in aiming if name in run.index]
    for name in run.index:
        if name in keeping(table, "g", "Gv"):
            require(run["distance"][name] < ON_MANIFOLD, f"{name} stays on the manifold", f"a distance of {run['distance'][name]:.1e}")
    on = [name for name in run.index if name in keeping(table, "g", "Gv")]
    others = [name for name in run.index if name not in symplectic]
    restless = [name for name in on if run["H_long"][name] == DRIFTS]
    still = [name for name in run.index if name not in on and run["energy"][name] <= ROUND_OFF]
    require(restless and still, "a method on the manifold may lose the energy, and one off it keep it", restless + still)
    return SimpleNamespace(
        row=run,
        symplectic=symplectic,
        others=others,
        on=on,
        most=run["distance"][on].max(),
        all=len(aiming),
        drifting=drifting(drift[~drift["method"].isin(aiming)], table),
    )


def drifting(drift: pd.DataFrame, table: pd.DataFrame) -> SimpleNamespace:
    """Return how many methods of the table there are in these runs, in how many the energy drifts, and how many end early."""
    others = drift[drift["method"].isin(table["method"])]
    ended = int((others["failure"] != "").sum())
    said = others.loc[others["failure"] == "", "H_long"]
    return SimpleNamespace(others=len(others), drifts=(said == DRIFTS).sum(), ended=ended)


def draw_long(largest: pd.DataFrame, folder: Path) -> Path:
    """Draw the largest energy error and distance from the manifold in each window of the long run."""
    figure, axes = grid_of_axes(1, 2, 4.4, sharey=True)
    for ax, (column, title) in zip(axes[0], (("energy", "energy error (J)"), ("distance", "distance from the manifold")), strict=True):
        for k, (name, windows) in enumerate(largest.groupby("method", sort=False)):
            shown = windows[np.isfinite(windows[column]) & (windows[column] < 1e2)]
            ax.plot(shown["t"], shown[column].clip(lower=LEAST), markevery=(2 * k, 20), **curve_of(str(name)))
        ax.axhspan(LEAST, EPS, color="#eeeeee", zorder=0, linewidth=0)
        ax.set(yscale="log", title=title, xlabel="time $t$ (s)", ylim=(LEAST, 1e2))
    axes[0, 0].set_ylabel("largest in a hundredth of the run")
    legend_below(figure, axes[0, 0], 4)
    return save(figure, folder, "long", largest)


COLUMNS = {
    "method": code,
    "energy": (tiny, "energy error<small>largest</small>"),
    "became": (Of(lambda kind, failure: Markup("ends early" if failure else kind), "kind", "failure"), "<small>which is</small>"),
    "drift": (Of(with_error, "slope", "slope_error"), "slope<small>J/s</small>"),
    "distance": (tiny, "distance from<small>the manifold</small>"),
}
"""Energy and distance from the manifold over the long run."""
