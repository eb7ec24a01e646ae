"""One method measured against its claims on two motions, as in ``daebench check``, with its orders, and the work of a step."""

from collections.abc import Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from daebench.compiler.facts import WORK
from daebench.draw.figures import grid_of_axes, save
from daebench.draw.methods import curve_of
from daebench.errors import RunFailed
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.pages.report import count, number
from daebench.pages.report.claims import require
from daebench.pages.report.tables import code, part, tiny
from daebench.reports.methods.families import SOFTENED, family, method
from daebench.runs.ivp import ConstrainedIvp
from daebench.runs.make_ivp import constrained
from daebench.runs.request import Request
from daebench.runs.trajectory import Trajectory
from daebench.studies.claims.check import order_finding
from daebench.studies.claims.constrained import ConstrainedBench


class Motion(NamedTuple):
    """A motion, and the step size of its defects and residuals, s."""

    problem: str
    case: str
    h: float


PENDULUM = Motion("spherical_pendulum", "fig1.2b", 0.02)
TORUS = Motion("torus", "through_hole", 0.05)
MOTIONS = (PENDULUM, TORUS)
"""A quadratic constraint with a kinetic flow in closed form, to which all methods apply; and a non-quadratic one without such a flow."""

STEPS = 200
"""Steps along which constraints and energy are monitored; defects are those of the first ``DEFECT_STEPS`` of them."""

TIMED_STEPS = 2000
"""Steps that are timed, on the pendulum."""

HIGH, LONGER = 6, 4
"""Methods of at least this order take steps this many times as long: otherwise rounding hides their defects."""

HALVINGS = 8
"""Largest number of halvings of the step size for a run that does not complete."""

TOL, IDA_T_END, IDA_POINTS = 1e-8, 4.0, 201


class Swept(NamedTuple):
    """Results of one job: findings, points and fits of orders, and work, each a list of rows."""

    claims: list[dict[str, Any]]
    points: list[dict[str, Any]]
    orders: list[dict[str, Any]]
    work: list[dict[str, Any]]


def ivp_of(motion: Motion) -> ConstrainedIvp:
    """Return the initial value problem of a motion."""
    return constrained(initial_value_problem(motion.problem, motion.case))


def sweep(name: str) -> Swept:
    """Return the findings of a method on both motions, its orders on the pendulum, and the work of a step there.

    A method that refuses a motion has a row that says why, with the property "refused".
    """
    swept = Swept([], [], [], [])
    for motion in MOTIONS:
        ivp = ivp_of(motion)
        about = {"problem": motion.problem, "method": name}
        if (why := method(name).refusal(ivp)) is not None:
            swept.claims.append(about | {"property": "refused", "note": why})
            continue
        h = lasting_step(motion, name)
        run = monitored(ivp, method(name), h).complete()
        swept.claims.extend(about | {"h": h} | asdict(finding) for finding in ConstrainedBench(ivp, method(name), run).findings())
        if motion == PENDULUM:
            orders(motion, name, swept)
            swept.work.append(about | {"h": h} | {kind: run.work[kind] / run.steps for kind in WORK})
    return swept


def monitored(ivp: ConstrainedIvp, fixed_step: FixedStep, h: float) -> Trajectory:
    """Return the run along which constraints and energy are monitored, uncompiled; it may have stopped."""
    return fixed_step.solve(ivp, Request(value=h, steps=STEPS, every=1, watch=ivp.state.monitors))


def timed(ivp: ConstrainedIvp, name: str, h: float) -> Trajectory:
    """Return the timed run: compiled, with nothing monitored, stored or counted; it may have stopped."""
    return method(name, compiled=True).solve(ivp, Request(value=h, steps=TIMED_STEPS, every=0, watch=(), count=False))


def lasting_step(motion: Motion, name: str) -> float:
    """Return the step size of a motion, or the first half, quarter, ... of it with which a run completes; on the pendulum, the timed run.

    Methods of high order have a longer step.
    """
    ivp = ivp_of(motion)
    longest = motion.h * (LONGER if method(name).claims.order >= HIGH else 1)
    for k in range(HALVINGS + 1):
        h = longest * 0.5**k
        run = timed(ivp, name, h) if motion == PENDULUM else monitored(ivp, method(name), h)
        if run.failure is None:
            return h
    raise RunFailed(
        f"{name} does not complete a run on {motion.problem} with any step size from {longest:g} to {h:g} s: {run.failure}",
        "no-lasting-step",
    )


def orders(motion: Motion, name: str, swept: Swept) -> Swept:
    """Add the order of a method on a motion: the finding, the points, and a fit for each component."""
    finding, series = order_finding(ivp_of(motion), method(name, compiled=True))
    about = {"problem": motion.problem}
    swept.claims.append(about | {"method": name} | asdict(finding))
    swept.points.extend(about | row for study in series for row in study.rows())
    swept.orders.extend(about | study.row() for study in series)
    return swept


def torus_orders(name: str) -> Swept:
    """Return the order of a method on the torus."""
    return orders(TORUS, name, Swept([], [], [], []))


def ida(name: str) -> dict[str, Any]:
    """Return the largest |g|, |G H_p| and |H - H0| of IDA over its outputs on the pendulum, and its steps."""
    request = Request(value=TOL, t_end=IDA_T_END, points=IDA_POINTS, watch=("manifold", "energy"))
    run = parse(name).solve(ivp_of(PENDULUM), request).complete()
    return {"method": name, "tol": TOL, "g": run.maxima["g"], "Gv": run.maxima["Gv"], "energy": run.maxima["energy"], "steps": run.steps}


def nanoseconds(name: str, h: float, repeats: int) -> float:
    """Return the CPU time of a step on the pendulum, ns: the minimum over several runs."""
    ivp = ivp_of(PENDULUM)
    runs = [timed(ivp, name, h).complete() for _ in range(repeats)]
    return min(1e9 * float(run.seconds) / run.steps for run in runs)


def check_orders(fits: pd.DataFrame, table: pd.DataFrame) -> SimpleNamespace:
    """Return how far measured orders differ from claimed ones, and the methods whose order could not be measured."""
    measured_orders = table[table["order"].notna()]
    off = (measured_orders["order"] - measured_orders["claimed"]).abs()
    worst = measured_orders.iloc[int(off.argmax())]
    require(off.max() < 0.5, "each measured order rounds to the one that is claimed", f"{worst['method']}: {off.max():.2f}")
    untold = list(table.loc[table["order"].isna(), "method"])
    softened = [name for name in table["method"] if method(name).form in SOFTENED]
    require(untold == softened, "all methods except those of the stiff and the soft form show an order", untold)
    torus = part(fits, problem=TORUS.problem, component=("q", "p"))
    return SimpleNamespace(
        count=len(measured_orders),
        off=off.max(),
        worst=worst,
        highest=measured_orders["claimed"].max(),
        untold=untold,
        torus=sorted(set(torus["method"]), key=list(torus["method"]).index),
        error=measured_orders["order_error"].max(),
    )


def check_work(frame: pd.DataFrame) -> SimpleNamespace:
    """Test that every method has a time, and return the extremes."""
    ns = frame.set_index("method")["ns"]
    require(np.isfinite(ns).all() and (ns > 0).all(), "each method has a time", ns[~np.isfinite(ns)].to_dict())
    without = list(frame.loc[frame["newton"] == 0, "method"])
    return SimpleNamespace(
        row=frame.set_index("method"), cheapest=ns.idxmin(), least=ns.min(), dearest=ns.idxmax(), most=ns.max(), without=without
    )


PANELS = (
    ("schemes for (1.9), symplectic", ("symplectic",)),
    ("compositions", ("composed",)),
    ("DAE schemes, not symplectic", ("other", "dae")),
    ("index-reduced ODE (1.18)", ("ode",)),
    ("projections and other forms", ("projected", "form")),
)
"""Panels of the figure of orders, and the families in each."""


SAME = {
    *("lie_adjoint", "symplectic_euler_adjoint", "lobatto2", "shake", "rattle_gauss_seidel", "rattle_ilves", "midpoint+proj"),
    *("rk4+symproj", "radau2_index2"),
}
"""Methods whose errors lie on the curve of another one."""


def draw_orders(points: pd.DataFrame, folder: Path) -> Path:
    """Draw errors of the position against h, one panel for a few families each, and one for some methods on the torus."""
    shown = points[points["component"] == "q"]
    figure, axes = grid_of_axes(3, 2, 10.8, y="largest error of $q$ (m)", sharey=True)
    pendulum = shown[shown["problem"] == PENDULUM.problem]
    for ax, (title, families) in zip(axes.flat, PANELS, strict=False):
        panel_methods = [name for name in pendulum["method"].unique() if family(name) in families and name not in SAME]
        draw_panel(ax, pendulum, panel_methods, title)
    torus = shown[shown["problem"] == TORUS.problem]
    draw_panel(axes[2, 1], torus, list(torus["method"].unique()), "some of them, on the torus")
    return save(figure, folder, "orders", shown)


def draw_panel(ax: Any, points: pd.DataFrame, methods: Sequence[str], title: str) -> None:
    """Draw the errors that a fit used as joined markers, and all others as grey points."""
    for name in methods:
        rows = points[points["method"] == name].dropna(subset=["error"])
        used = rows[rows["used"]]
        ax.plot(rows["h"], rows["error"].clip(upper=10), linestyle="none", marker=".", color="#bbbbbb", markersize=2.5, zorder=1)
        ax.plot(used["h"], used["error"], **curve_of(name) | {"markersize": 3.2, "label": name})
    ax.set(xscale="log", yscale="log", title=title, ylim=(1e-15, 20))
    ax.set_xlabel("step size $h$ (s)", labelpad=1)
    if methods:
        ax.legend(fontsize=6.8, loc="upper center", bbox_to_anchor=(0.44, -0.17), ncols=2, handlelength=2.0, columnspacing=0.8)


EVALUATIONS = ("H_p", "H_q", "g", "G", "second")
"""The functions whose evaluations are counted, all with the same weight."""


three = partial(number, digits=3)

WORK_COLUMNS = {
    "method": code,
    "h": (three, "<i>h</i>"),
    "newton": (three, "Newton<small>iterations</small>"),
    "H_p": (three, "<i>H<sub>p</sub></i>"),
    "H_q": (three, "<i>H<sub>q</sub></i>"),
    "g": (three, "<i>g</i>"),
    "G": (three, "<i>G</i>"),
    "second": (three, "second<small>derivatives</small>"),
    "solve": (three, "linear<small>solves</small>"),
    "ns": (three, "time<small>ns</small>"),
}
"""The work of a step and its time."""

IDA_COLUMNS = {
    "method": code,
    "g": (tiny, "|<i>g</i>|"),
    "Gv": (tiny, "|<i>G H<sub>p</sub></i>|"),
    "energy": (tiny, "energy error"),
    "steps": count,
}
"""The residuals of IDA, formulation by formulation."""
