"""Initial value problems in which G loses rank: the time, from an equation of motion of one angle, and the behaviour of each method."""

import math
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from types import MappingProxyType, SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd

from daebench.diagnostics.energy_verdict import energy_error
from daebench.draw.figures import QUIET, grid_of_axes, legend_below, save
from daebench.draw.methods import name_of, stroke_of
from daebench.errors import DaebenchError
from daebench.methods.names import parse
from daebench.pages.report import NONE, number
from daebench.pages.report.claims import require
from daebench.pages.report.tables import Of, Table, code, part, text
from daebench.reports.problems.ivps import ivp_of
from daebench.reports.problems.results import at_most
from daebench.reports.problems.runs import largest
from daebench.runs.request import Request
from daebench.systems.lazily import scipy

GRAVITY = 9.81
METHODS = ("rattle", "lobatto3", "seproj", "rk4", "ida:index3", "scipy:DOP853")
MODES = ("stop", "continue")
H, TOL, OUTPUTS = 0.002, 1e-8, 241
IVPS = MappingProxyType({("four_bar", "iftomm"): 1.2, ("slider_crank", "lock_up"): 1.2})
"""The initial value problems, each with its end, s."""

SHOWN = MappingProxyType({"four_bar": (3, "height of the middle joint $B_1$ [m]"), "slider_crank": (2, "place of the slider $x_2$ [m]")})
"""Index of the drawn position, and its name."""


def loss(problem: str) -> float:
    """Return the time at which G loses rank, s, by integration of one angle with SciPy, without constraints."""
    rate, start, place = MOTIONS[problem]

    def reached(t: float, x: Any) -> float:
        return float(x[0] - place)

    reached.terminal = True  # type: ignore[attr-defined]
    run = scipy.integrate.solve_ivp(rate, (0.0, 5.0), start, method="DOP853", rtol=1e-12, atol=1e-12, events=reached)
    assert run.t_events is not None
    return float(run.t_events[0][0])


def uprights(t: float, x: Any) -> list[float]:
    """Return the rate of (theta, theta') of two linkages in parallel: a pendulum with a = 3 (3 N + 1) / (2 (4 N + 1)), N = 2."""
    return [x[1], -7 / 6 * GRAVITY * math.sin(x[0])]


def crank(t: float, x: Any) -> list[float]:
    """Return the rate of (phi, phi') of unit bars and masses with x2 = 2 cos phi: 2 T = I(phi) phi'^2 and U = gravity sin phi."""
    s, c = math.sin(x[0]), math.cos(x[0])
    inertia, slope = 2 / 3 + 6 * s * s, 12 * s * c
    return [x[1], (-GRAVITY * c - slope * x[1] ** 2 / 2) / inertia]


Motion = tuple[Callable[[float, Any], list[float]], tuple[float, float], float]
MOTIONS: dict[str, Motion] = {
    "four_bar": (uprights, (math.pi, -1.0), math.pi / 2),
    "slider_crank": (crank, (0.0, 0.0), -math.pi / 2),
}
"""Rate, start, and the angle at which all bars lie on one line."""


def behaviour(problem: str, case: str, name: str, mode: str) -> tuple[dict[str, Any], pd.DataFrame]:
    """Return the outcome of a method in an initial value problem with ``on_singular``, and the drawn position over time.

    Parameters
    ----------
    problem, case : str
        The initial value problem.
    name : str
        Name of the method.
    mode : str
        One of ``MODES``.

    Returns
    -------
    dict
        end, t (where the run ended), why; told, branch, turn and pivot of the first rank-loss event; energy error.
    DataFrame
        t and x of each output.
    """
    ivp, solver, end = ivp_of(problem, case), parse(name), IVPS[problem, case]
    about: dict[str, Any] = {"problem": problem, "case": case, "method": name, "mode": mode}
    request = Request(value=H, steps=round(end / H), watch=(), on_singular=mode)
    if solver.knob == "tol":
        request = Request(value=TOL, t_end=end, points=OUTPUTS, watch=(), on_singular=mode)
    try:
        run = solver.solve(ivp, request)
    except DaebenchError as error:
        return about | {"end": "stopped", "t": 0.0, "why": str(error), "branch": ""}, pd.DataFrame({"t": [], "x": []})
    about |= {"end": "reached" if run.failure is None else "stopped", "t": float(run.t[-1]), "why": run.failure or ""}
    first = run.passages[0] if run.passages else None
    about |= {"told": first.t if first else told_in(run.failure or ""), "branch": first.branch if first else ""}
    about |= {"turn": first.turn if first else math.nan, "pivot": first.pivot if first else math.nan, "passages": len(run.passages)}
    about |= {"energy": largest(energy_error(ivp, run))}
    drawn = np.unique(np.linspace(0, len(run.t) - 1, OUTPUTS).astype(int))
    path = {"problem": problem, "method": name, "mode": mode, "t": run.t[drawn], "x": run.q[drawn, SHOWN[problem][0]]}
    return about, pd.DataFrame(path)


def told_in(sentence: str) -> float:
    """Return the time that a message gives for the loss of rank, NaN if it gives none."""
    _, separator, rest = sentence.partition("G loses rank at about t = ")
    return float(rest.split()[0].rstrip(".,;")) if separator else math.nan


PASSING = ("rattle", "lobatto3")
"""Methods that, according to the text, pass a loss of rank on the same branch."""


def check_rank(rows: pd.DataFrame, losses: Mapping[str, float]) -> SimpleNamespace:
    """Test that every method that is set to stop does so before G loses rank and says so, and which branch RATTLE and Lobatto take."""
    for row in rows[rows["mode"] == "stop"].to_dict("records"):
        t, who = losses[row["problem"]], f"{row['method']} on {row['problem']}"
        require(row["end"] == "stopped", f"{who} stops where G loses rank", row["end"])
        require("G loses rank" in row["why"], f"{who} says that G loses rank", row["why"])
        require(row["t"] < t, f"{who} stops before that", (row["t"], t))
    for row in rows[(rows["mode"] == "continue") & rows["method"].isin(PASSING)].to_dict("records"):
        who = f"{row['method']} on {row['problem']}"
        require(row["end"] == "reached" and row["branch"] == "through", f"{who} goes on through", (row["end"], row["branch"]))
    stopped = rows[rows["mode"] == "stop"].assign(exact=lambda frame: frame["problem"].map(losses))
    error = (stopped["told"] - stopped["exact"]).abs()
    worst = at_most(stopped.assign(error=error), "error")
    fixed = error[stopped["method"].isin(PASSING)]
    went = rows[rows["mode"] == "continue"]
    return SimpleNamespace(
        losses=losses,
        passing=PASSING,
        told=fixed.max(),
        worst=worst,
        worst_error=error.max(),
        through=(went["branch"] == "through").sum(),
        went=len(went),
        elsewhere=went[(went["branch"] != "through") | (went["end"] != "reached")].to_dict("records"),
    )


STROKE = {name: stroke_of(name) for name in METHODS}


def draw_rank(paths: pd.DataFrame, losses: Mapping[str, float], folder: Path) -> Path:
    """Draw a position over time where G loses rank: one row per scene, stopped on the left, continued on the right."""
    figure, axes = grid_of_axes(len(IVPS), len(MODES), 5.6, x="time $t$  [s]", sharex=True, sharey="row")
    for axes_row, (problem, case) in zip(axes, IVPS, strict=True):
        axes_row[0].set_ylabel(SHOWN[problem][1])
        for ax, mode in zip(axes_row, MODES, strict=True):
            ax.axvline(losses[problem], color=QUIET, linewidth=0.9, linestyle=(0, (2, 2)))
            for k, (name, stroke) in enumerate(STROKE.items()):
                run = part(paths, problem=problem, method=name, mode=mode)
                ax.plot(run["t"], run["x"], label=name_of(name), markevery=(10 + 4 * k, 60), **stroke.points())
                ax.plot(run["t"].iloc[-1:], run["x"].iloc[-1:], linestyle="none", marker="|", markersize=11, color=stroke.color)
            ax.set_title(f"{problem} {case}, {mode}")
    legend_below(figure, axes[0, 0], 3, columnspacing=1.6)
    return save(figure, folder, "rank_loss", paths)


def rank_table(frame: pd.DataFrame) -> Table:
    """Return the behaviour of each method where G loses rank."""
    return Table(
        frame.assign(scene=(frame["problem"] + " " + frame["case"]).where(frame["problem"] != frame["problem"].shift(), "")),
        {
            "method": code,
            "scene": text,
            "mode": "on singular",
            "ended": (Of(lambda end, t: f"{'complete' if end == 'reached' else 'stops'} at {t:.4g}", "end", "t"), "run<small>t, s</small>"),
            "told": (partial(number, digits=5), "rank lost<small>reported, s</small>"),
            "branch": (lambda branch: branch or NONE if isinstance(branch, str) else NONE, "branch"),
            "turn": (number, "turn<small>degrees</small>"),
            "pivot": (number, "smallest<small>pivot</small>"),
            "energy": (number, "energy error<small>J</small>"),
        },
        {},
    )
