"""IDA at index 3, 2, 1 and GGL: the error that a tolerance leads to, and the residuals of the constraints."""

from dataclasses import dataclass
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from daebench.draw.figures import BLACK, STROKES, VERMILION, Stroke
from daebench.draw.methods import stroke_of
from daebench.draw.svg.axis import Axis, around
from daebench.draw.svg.marks import Curve, Dots, Mark
from daebench.draw.svg.panels import Panel, draw_panels
from daebench.methods.solvers.ida import DEFAULT_TREATMENTS, Ida
from daebench.pages.lesson.film import Control, Shown, Values, defaults, film, style
from daebench.pages.lesson.page import Content
from daebench.pages.report import Progress, at_most, count, number
from daebench.pages.report.claims import require
from daebench.reports.tolerances.runs import FAST, IN_WORDS, end, exact_of, ivp_of
from daebench.runs.ivp import Array
from daebench.runs.request import Request, WorkLimit

FORMULATIONS = {"index3": "index 3", "index2": "index 2", "index1": "index 1", "ggl": "GGL"}
TOLERANCES = tuple(float(f"1e-{k}") for k in range(3, 11))
T_END, TOL = 5.0, 1e-6
WORK_LIMIT = WorkLimit(calls=20_000, slow_calls=5_000, slow_part=150)
"""Limits at which a run is given up, because the lesson waits for all runs."""

ASKED, HIDDEN = Stroke(BLACK, (0, (4, 3)), ""), Stroke(VERMILION, (0, (6, 2)), "")
FLOOR = 1e-17


@dataclass(frozen=True)
class Reached:
    """A run of IDA."""

    t: Array
    """Times of output, s; shape (n,)."""
    error: Array
    g: Array
    Gv: Array
    """Largest error of a component of q against the certified reference, and moduli of both constraints' residuals; shape (n,)."""
    worst: float
    """Largest error; NaN where the run ended early."""
    calls: int
    """Evaluations of the residual."""
    end: str
    """How it ended, see ``daebench.reports.tolerances.runs.end``."""


@cache
def reached(formulation: str, cured: bool, tol: float) -> Reached:
    """Return the run of a formulation with one tolerance, relative and absolute."""
    ivp, reference = ivp_of(FAST), exact_of(FAST, T_END)
    request = Request(value=tol, t_end=T_END, points=len(reference.t), watch=(), work_limit=WORK_LIMIT)
    run = Ida(formulation, DEFAULT_TREATMENTS[formulation] if cured else "none").solve(ivp, request)
    n = (
        int(np.sum(run.t <= reference.t[-1] + 1e-9))
        if not run.failure
        else int(np.sum(np.isin(np.round(run.t, 9), np.round(reference.t, 9))))
    )
    error = np.max(np.abs(run.q[:n] - reference.q[:n]), axis=1)
    return Reached(
        t=run.t[:n],
        error=error,
        g=np.abs(ivp.along("g", run.q[:n])).ravel(),
        Gv=np.abs(ivp.along("Gv", run.p[:n], run.q[:n])).ravel(),
        worst=float("nan") if run.failure else float(np.max(error)),
        calls=run.work["residual"],
        end=end(run.failure),
    )


def of(values: Values) -> Reached:
    """Return the run that the controls choose; its arguments are in the order of the first call, because they are the key of the cache."""
    return reached(values["formulation"], values["cured"], values["tol"])


def show(values: Values) -> Shown:
    """Return error against tolerance for all formulations, and error and drift of the chosen run."""
    cured, chosen = values["cured"], of(values)
    runs = {name: [reached(name, cured, tol) for tol in TOLERANCES] for name in FORMULATIONS}
    time = Axis("t [s]", 0.0, T_END)
    error = around("largest error of q [m]", [1e-10, 10.0], log=True)
    residuals = (np.maximum(chosen.g, FLOOR), np.maximum(chosen.Gv, FLOOR))
    lines = [
        Curve(chosen.t, residuals[0], STROKES[6], "|g|"),
        Curve(chosen.t, residuals[1], HIDDEN, "|G H\N{LATIN SUBSCRIPT SMALL LETTER P}|"),
    ]
    curve = Curve(chosen.t, np.maximum(chosen.error, FLOOR), STROKES[FORMULATIONS_ORDER[values["formulation"]]])
    panels = [
        Panel(Axis("tolerance asked for", 1e-11, 1e-2, log=True), error, asked(runs, values), "asked and reached"),
        Panel(Axis("evaluations of the residual", 1e2, 1e5, log=True), error, cost(runs), "cost"),
        Panel(time, Axis("error of q [m]", 1e-16, 1e2, log=True), [curve], "error of the chosen run"),
        Panel(time, Axis("residual", 1e-17, 1e1, log=True), lines, "its constraints"),
    ]
    alt = "Error against tolerance and against evaluations, one line per formulation; error and constraints of one run."
    return Shown(draw_panels(panels, alt=alt, height=270), says(values, chosen))


FORMULATIONS_ORDER = {name: k for k, name in enumerate(FORMULATIONS)}


def asked(runs: dict[str, list[Reached]], values: Values) -> list[Mark]:
    """Return the lines of all formulations, with the chosen run in a ring, and the diagonal."""
    marks: list[Mark] = [Curve([1e-11, 1e-2], [1e-11, 1e-2], ASKED, "reached = asked", width=0.9)]
    for (name, formulation_runs), stroke in zip(runs.items(), STROKES, strict=False):
        worst = [run.worst for run in formulation_runs]
        marks += [Curve(TOLERANCES, worst, stroke, FORMULATIONS[name]), Dots(TOLERANCES, worst, stroke)]
    chosen = of(values)
    return [*marks, Dots([values["tol"]], [chosen.worst], Stroke(BLACK, "-", ""), radius=6.5, hollow=True)]


def cost(runs: dict[str, list[Reached]]) -> list[Mark]:
    """Return error against evaluations, one line per formulation."""
    marks: list[Mark] = []
    for formulation_runs, stroke in zip(runs.values(), STROKES, strict=False):
        calls, worst = [run.calls for run in formulation_runs], [run.worst for run in formulation_runs]
        marks += [Curve(calls, worst, stroke), Dots(calls, worst, stroke)]
    return marks


def says(values: Values, run: Reached) -> Markup:
    """Return sentences on the result of one run."""
    name = FORMULATIONS[values["formulation"]]
    if run.end != "reached":
        why = Markup("<b>{}</b>, tolerance {}: the run ended early; its last output is at <i>t</i> = {:.3g} s; {}.")
        return why.format(name, number(values["tol"], 1), float(run.t[-1]), IN_WORDS[run.end])
    sentence = Markup("<b>{}</b>: tolerance {}, error {}, <b>{}</b> times the tolerance, with {} evaluations of the residual. ").format(
        name, number(values["tol"], 1), number(run.worst), number(run.worst / values["tol"]), count(run.calls)
    )
    return sentence + Markup("|<i>g</i>| is at most {}, |<i>G H<sub>p</sub></i>| {}.").format(at_most(run.g.max()), at_most(run.Gv.max()))


def table(values: Values) -> pd.DataFrame:
    """Return the results of all runs, with the treatment or without it."""
    rows = [(name, tol, reached(name, values["cured"], tol)) for name in FORMULATIONS for tol in TOLERANCES]
    columns = ("worst", "calls", "end")
    return pd.DataFrame(
        [{"formulation": name, "tol": tol} | {column: getattr(run, column) for column in columns} for name, tol, run in rows]
    )


CONTROLS = (
    Control("formulation", "formulation", FORMULATIONS, "index1"),
    Control("cured", "multipliers left out of the error test", {False: "no", True: "yes"}, True),
    Control("tol", "tolerance", {tol: f"{tol:.0e}".replace("e-0", "e-") for tol in TOLERANCES}, TOL),
)


def content(tell: Progress) -> Content:
    """Return the content of the page: a picture for each run, all of which are made first."""
    runs = [(name, cured, tol) for name in FORMULATIONS for cured in (False, True) for tol in TOLERANCES]
    for k, (name, cured, tol) in enumerate(runs):
        tell(0.8 * k / len(runs), f"IDA, {FORMULATIONS[name]}, tolerance {tol:.0e}")
        reached(name, cured, tol)
    drawn = film("asked-reached", "Asked and reached", CONTROLS, show, lambda fraction, doing: tell(0.8 + 0.2 * fraction, doing))
    words = {"film": drawn, "facts": facts(), "number": number, "at_most": at_most}
    return Content("What tolerance buys", text=words, tables={"asked-reached": table(defaults(CONTROLS))}, style=style())


def thumbnail(axis: Any) -> None:
    """Draw the largest residual of the constraint against the tolerance for each formulation."""
    for name, label in FORMULATIONS.items():
        most = [max(float(np.max(reached(name, True, tol).g)), FLOOR) for tol in TOLERANCES]
        axis.plot(TOLERANCES, most, color=stroke_of(f"ida:{name}").color, linewidth=1.6, label=label)
    axis.set(xscale="log", yscale="log")
    axis.minorticks_off()
    axis.set_xlabel("tolerance asked for", loc="right")
    axis.set_title("IDA: largest residual of the constraint", loc="left")
    axis.legend(fontsize=6.5, loc="best", handlelength=1.2, ncols=2, columnspacing=0.8)


def facts() -> SimpleNamespace:
    """Return the numbers of the text; the first sentence that does not hold raises ClaimRefuted."""
    cured = {name: reached(name, True, TOL) for name in FORMULATIONS}
    plain = {name: [reached(name, False, tol).end for tol in TOLERANCES] for name in FORMULATIONS}
    came = {name: sum(ending == "reached" for ending in ends) for name, ends in plain.items()}
    more = {name: run.worst / TOL for name, run in cured.items()}
    require(all(run.end == "reached" for run in cured.values()), "with the treatment all formulations reach the end", cured)
    require(came["index3"] == 0, "without a treatment index 3 never reaches the end", came)
    loose = {name: reached(name, False, TOLERANCES[0]).worst for name in ("index1", "index2")}
    require(
        loose["index1"] > 0.5 > 5 * loose["index2"], "at the loosest tolerance index 1 is useless without it, and index 2 is not", loose
    )
    require(max(came.values()) < len(TOLERANCES), "without a treatment no formulation reaches the end at all tolerances", came)
    require(min(more.values()) > 10, "every error is well above the tolerance", more)
    fall = [[getattr(reached("index1", True, tol), name).max() for tol in TOLERANCES] for name in ("g", "error")]
    require(all(np.diff(values).max() < 0 for values in fall), "drift of index 1 decreases with the tolerance, as its error does", fall)
    small = [cured[name].worst / float(cured[name].g.max()) for name in ("index3", "ggl")]
    require(min(small) > 100, "residuals of the constraint are far smaller than the error where g is in the system", small)
    drift = {name: float(run.g.max()) for name, run in cured.items()}
    require(
        drift["index1"] > 5 * max(drift[name] for name in drift if name != "index1"), "index 1 has the largest constraint residual", drift
    )
    require(cured["index2"].g.max() > 10 * cured["ggl"].g.max(), "index 2 lets the positions drift, and GGL does not", cured["ggl"].g.max())
    return SimpleNamespace(cured=cured, came=came, more=more, tol=TOL, t_end=T_END, n=len(TOLERANCES))
