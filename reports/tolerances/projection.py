"""CVODE with and without projected steps, and RATTLE for the same time; and SUNDIALS' own example of a projected pendulum."""

from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd

from daebench.draw.figures import grid_of_axes, save
from daebench.draw.methods import stroke_of
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.pages.report import count, number, power_of_ten
from daebench.pages.report.claims import require
from daebench.pages.report.tables import Of, Table, once, part
from daebench.reports.tolerances.accuracy import ERROR, HIGH, LOW
from daebench.reports.tolerances.cost import legend_panel
from daebench.reports.tolerances.exact import Exact
from daebench.reports.tolerances.runs import FAST, IVPS, SMALL, beside, motion
from daebench.runs.ivp import ConstrainedIvp
from daebench.runs.make_ivp import constrained
from daebench.runs.request import Request
from daebench.runs.trajectory import Trajectory

PLAIN, PROJECTED = "cvode:bdf", "cvode:bdf:projected"
FIXED = ("rattle", "rattle/kahan_li8")
"""Methods that run for the CPU time of CVODE with projected steps."""

TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
STARTS = 8
"""Starts of each system."""

STEPS = 4000
"""Number of steps of the first timing of a fixed-step method."""

REPEATS = 3
"""Number of runs, of which the shortest time is taken."""

EXAMPLE = {"gravity": 13.750371636040745}
"""The example of SUNDIALS: a pendulum of period 2 that is released from the horizontal."""

EXAMPLE_END = 30.0
EXAMPLE_TOLERANCES = (1e-5, 1e-6, 1e-7, 1e-8, 1e-9)

PRINTED = {
    (1e-5, PROJECTED): (2.25e-3, 0.0, 1421),
    (1e-5, PLAIN): (8.98e-1, 6.19e-4, 1549),
    (1e-6, PROJECTED): (4.64e-4, 0.0, 2089),
    (1e-6, PLAIN): (5.74e-2, 7.05e-5, 2221),
    (1e-7, PROJECTED): (7.79e-5, 2.22e-16, 3013),
    (1e-7, PLAIN): (3.45e-2, 6.77e-4, 3236),
    (1e-8, PROJECTED): (1.37e-5, 0.0, 4295),
    (1e-8, PLAIN): (8.52e-3, 5.35e-5, 4600),
    (1e-9, PROJECTED): (1.79e-6, 1.11e-16, 6542),
    (1e-9, PLAIN): (1.70e-3, 5.67e-6, 6661),
}
"""Output of cvPendulum_dns of SUNDIALS 7.5.0 by tolerance and method: the larger error of x and y, | x^2 + y^2 - 1 |, steps."""

Row = dict[str, Any]


def compiled(name: str) -> None:
    """Have the kernels of the timed runs on a problem compiled, by runs of no consequence."""
    ivp, reference = motion(name, 0)
    t_end, points = float(reference.t[1]), 2
    for method in (PLAIN, PROJECTED):
        parse(method).solve(ivp, Request(value=max(TOLERANCES), t_end=t_end, points=points, watch=()))
    for method in FIXED:
        parse(method).solve(ivp, Request(value=t_end, steps=1, every=1, watch=()))


def paces(name: str) -> dict[str, float]:
    """Return the time that a step of each fixed-step method takes from the start of the case, s; from others it was within 7 % of that."""
    ivp, reference = motion(name, 0)
    return {method: pace(ivp, method, reference) for method in FIXED}


def compared(name: str, start: int, reference: Exact, paces: Mapping[str, float]) -> list[Row]:
    """Return one row per tolerance and method, from one start: error, seconds and steps; it is timed, so nothing else should run."""
    ivp = beside(name, start)
    rows: list[Row] = []
    for tol in TOLERANCES:
        request = Request(value=tol, t_end=float(reference.t[-1]), points=len(reference.t), watch=())
        solved = {method: fastest(ivp, method, request) for method in (PLAIN, PROJECTED)}
        budget = solved[PROJECTED].seconds
        solved |= {method: in_time(ivp, method, reference, budget / paces[method]) for method in FIXED}
        of = {"scene": name, "start": start, "tol": tol}
        rows += [of | {"method": method} | outcome(name, run, reference) for method, run in solved.items()]
    return rows


def fastest(ivp: ConstrainedIvp, method: str, request: Request) -> Trajectory:
    """Return the fastest of a few identical runs."""
    runs: list[Trajectory] = [parse(method).solve(ivp, request).complete() for _ in range(REPEATS)]
    return min(runs, key=lambda run: run.seconds)


def pace(ivp: ConstrainedIvp, method: str, reference: Exact) -> float:
    """Return the time that a step takes, s."""
    t_end = float(reference.t[-1])
    run = fastest(ivp, method, Request(value=t_end / STEPS, steps=STEPS, every=STEPS, watch=()))
    return run.seconds / STEPS


def in_time(ivp: ConstrainedIvp, method: str, reference: Exact, steps: float) -> Trajectory:
    """Return a run of about the given number of steps that has states at the times of the reference."""
    outputs = len(reference.t) - 1
    between = max(1, round(steps / outputs))
    return fastest(ivp, method, Request(value=float(reference.t[1]) / between, steps=between * outputs, every=between, watch=()))


def outcome(name: str, run: Trajectory, reference: Exact) -> Row:
    """Return the error and the cost of a run; on the spherical pendulum also the errors of speed and angular velocity."""
    row = {"error": float(np.max(np.abs(run.q - reference.q))), "seconds": run.seconds, "steps": run.steps, "floor": reference.floor}
    if name != FAST:
        return row | {"speed": float("nan"), "turning": float("nan")}
    speed, true_speed = (np.linalg.norm(p[-1]) for p in (run.p, reference.p))
    turning, true_turning = (speed_of_turning(q[-1], p[-1]) for q, p in ((run.q, run.p), (reference.q, reference.p)))
    return row | {"speed": float(speed / true_speed - 1), "turning": float(turning / true_turning - 1)}


def speed_of_turning(q: Any, v: Any) -> float:
    """Return the angular velocity of a position about the origin, |q x v| / |q|^2."""
    return float(np.linalg.norm(np.cross(q, v)) / (q @ q))


def example() -> list[Row]:
    """Return one row per tolerance and method on the pendulum of SUNDIALS' example: the output of SUNDIALS, and the result of (1.18)."""
    ivp = constrained(initial_value_problem("planar_pendulum", "horizontal", parameters=EXAMPLE, q0=(1.0, 0.0), p0=(0.0, 0.0)))
    rows = []
    for tol in EXAMPLE_TOLERANCES:
        for method in (PROJECTED, PLAIN):
            run = parse(method).solve(ivp, Request(value=tol, t_end=EXAMPLE_END, points=2, watch=())).complete()
            error, g = float(np.max(np.abs(run.q[-1] - ivp.q0))), float(abs(run.q[-1] @ run.q[-1] - 1))
            printed = dict(zip(("printed_error", "printed_g", "printed_steps"), PRINTED[tol, method], strict=True))
            rows.append({"tol": tol, "method": method} | printed | {"error": error, "g": g, "steps": run.steps})
    return rows


HELPED = "double_pendulum-horizontal"
"""The system on which projection helps most."""


TURNS_WITH = 0.5
"""Bound on the error of the angular velocity without projection, as a fraction of the error of the speed."""


NEAR = 0.3
"""Relative difference of errors that count as equal."""


def check_projected(rows: pd.DataFrame) -> SimpleNamespace:
    """Test where projection helps and where it harms, why, and how accurate fixed steps are for the same time."""
    table = rows.pivot(index=["scene", "start", "tol"], columns="method", values="error")
    medians = table.groupby(["scene", "tol"]).median()
    ratio = (table[PROJECTED] / table[PLAIN]).groupby(["scene", "tol"]).median()
    gain = ratio[medians[PLAIN] < SMALL].unstack().reindex(list(IVPS))
    require((gain.loc[HELPED].dropna() < 1).all(), "projection helps on the double pendulum", gain.loc[HELPED].to_dict())
    worse = gain.loc[FAST].dropna()
    require((worse > 1).all(), "projection harms on the fast spherical pendulum", worse.to_dict())
    composed = table[FIXED[1]] / table[PROJECTED]
    require(
        composed.median() < 1e-3, "composed to order 8, RATTLE is over a thousand times more accurate for the same time", composed.median()
    )
    better = float(np.mean(composed < 1))
    require(better > 0.95, "nearly always so", better)
    plain = (table[FIXED[0]] / table[PROJECTED]).groupby("tol").median()
    require(
        plain.iloc[-1] < 1 < plain.iloc[0], "RATTLE itself is better at the loosest tolerance, and worse at the tightest", plain.to_dict()
    )
    return SimpleNamespace(
        gain=gain,
        helped=gain.loc[HELPED].dropna(),
        worse=worse,
        cause=check_cause(rows[rows["scene"] == FAST]),
        composed=composed.median(),
        better=better,
        plain=plain,
        starts=rows["start"].nunique(),
    )


def check_cause(rows: pd.DataFrame) -> SimpleNamespace:
    """Test that speed and radius shrink alike without projection, and that only the speed shrinks with it; return the numbers at 1e-6."""
    off = rows.assign(speed=rows["speed"].abs(), turning=rows["turning"].abs()).groupby(["method", "tol"])[["speed", "turning"]].median()
    plain, projected = off.loc[PLAIN], off.loc[PROJECTED]
    share = (plain["turning"] / plain["speed"])[plain["speed"] < 1e-3]
    require((share < TURNS_WITH).all(), "without projection the angular velocity is much more accurate than the speed", share.to_dict())
    same = projected["turning"] / projected["speed"]
    require(np.allclose(same, 1, atol=1e-3), "with projection the angular velocity has the error of the speed", same.to_dict())
    return SimpleNamespace(tol=1e-6, plain=plain.loc[1e-6], projected=projected.loc[1e-6], share=share)


def check_example(rows: pd.DataFrame) -> SimpleNamespace:
    """Test that projected steps agree with the output of SUNDIALS except for the right side; return both."""
    projected, plain = (rows[rows["method"] == method].set_index("tol") for method in (PROJECTED, PLAIN))
    ratio = projected["error"] / projected["printed_error"]
    tight = ratio[ratio.index < 1e-5]
    require(np.all(np.abs(tight - 1) < NEAR), "projected, both right sides give the same error", ratio.to_dict())
    unlike = (plain["printed_error"] / plain["error"]).sort_values()
    require(unlike.iloc[-1] > 100, "without projection they differ by over a hundred times", unlike.to_dict())
    require((unlike[unlike.index < 1e-5] > 1).all(), "without projection (1.18) is more accurate from 1e-6 on", unlike.to_dict())
    require(plain["g"][1e-5] > SMALL, "at 1e-5 (1.18) leaves the circle", plain["g"].to_dict())
    return SimpleNamespace(off=np.abs(tight - 1).max(), unlike=unlike.iloc[-1], at=unlike.index[-1], g=plain["g"][1e-5])


METHOD_STROKE = {name: stroke_of(name) for name in (PLAIN, PROJECTED, *FIXED)}


METHOD_NAMES = {PLAIN: "CVODE, (1.18)", PROJECTED: "CVODE, projected", FIXED[0]: "RATTLE, as long", FIXED[1]: "RATTLE/Kahan-Li 8, as long"}


def draw_projected(rows: pd.DataFrame, folder: Path) -> Path:
    """Draw the error against CPU time: CVODE with and without projected steps, and RATTLE for the time of the former."""
    figure, axes = grid_of_axes(2, 3, 5.4, x="time of the run  [ms]", y=ERROR, sharex=True, sharey=True)
    frames = []
    for ax, (ivp, title) in zip(axes.flat, IVPS.items(), strict=False):
        for method, stroke in METHOD_STROKE.items():
            groups = part(rows, scene=ivp, method=method).groupby("tol")
            errors = groups["error"].quantile(np.array([LOW, 0.5, HIGH])).unstack().set_axis(["low", "error", "high"], axis=1)
            frame = errors.assign(seconds=groups["seconds"].median(), scene=ivp, method=method).reset_index()
            ax.fill_between(1e3 * frame["seconds"], frame["low"], frame["high"], color=stroke.color, alpha=0.22, linewidth=0)
            ax.plot(1e3 * frame["seconds"], frame["error"], label=METHOD_NAMES[method], **stroke.points())
            frames.append(frame)
        ax.set(xscale="log", yscale="log", title=title)
        ax.set_yticks([1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 1e0])
        ax.minorticks_off()
    legend_panel(axes, "time of the run  [ms]")
    return save(figure, folder, "projected", pd.concat(frames, ignore_index=True))


def example_table(frame: pd.DataFrame) -> Table:
    """Return SUNDIALS' example of a projected pendulum: the output of SUNDIALS, and the result of HLW (1.18)."""
    g = "||<i>q</i>|²&thinsp;&minus;&thinsp;1|<small>{}</small>"
    return Table(
        frame.assign(tol=once(frame["tol"])),
        {
            "tol": (Of(lambda tol: power_of_ten(tol) if tol else "", "tol"), "tolerance"),
            "method": (lambda method: "projected" if method == PROJECTED else "not", "steps"),
            "printed_error": (number, "error<small>SUNDIALS, m</small>"),
            "error": (number, "error<small>(1.18), m</small>"),
            "printed_g": (number, g.format("SUNDIALS")),
            "g": (number, g.format("(1.18)")),
            "printed_steps": (count, "number<small>SUNDIALS</small>"),
            "steps": (count, "number<small>(1.18)</small>"),
        },
        frame,
    )
