"""Experiments of the lesson on SHAKE, RATTLE and Lobatto, and the numbers of its text."""

from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from daebench.diagnostics.order import OrderFit, fit_order
from daebench.diagnostics.symplecticity import symplecticity_defect, tangent_basis
from daebench.draw.figures import STROKES, Stroke
from daebench.draw.methods import name_of, stroke_of
from daebench.draw.svg.axis import Axis, around
from daebench.draw.svg.marks import Curve, Dots, Mark
from daebench.draw.svg.panels import Panel, draw_panels
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.names import parse
from daebench.pages.lesson.control import NO_YES, Control, Values
from daebench.pages.lesson.experiment import Experiment, Preparation, Shown
from daebench.pages.report import at_most
from daebench.pages.report.claims import require
from daebench.reports.lessons._panels import seconds
from daebench.reports.lessons._shake_to_lobatto_runs import CASES, hidden, ivp_of, solve, step_sizes
from daebench.runs.ivp import Array

SCHEMES = {
    "symplectic_euler": "symplectic Euler",
    "shake": "SHAKE",
    "rattle": "RATTLE",
    "lobatto3": "Lobatto, 3 stages",
    "rattle/suzuki4": "RATTLE composed (Suzuki)",
    "lobatto4": "Lobatto, 4 stages",
}
STARTS = {"slow": "slow, HLW Fig. 1.1", "fast": "fast, HLW Fig. 1.2"}
OF = {"q": "positions q", "p": "momenta p"}
LENGTHS, RUNGS, DEFAULT_RUNGS = (1.0, 2.0, 5.0), (3, 4, 5, 6, 7, 8, 9, 10), 7
FLOOR, FINE, ROUGH = 1e-14, 1e-6, 1e-2
H = 0.01
ROUNDED = 1e-12

KICKS = 2
"""Number of force evaluations by which the starts of SHAKE and RATTLE may differ."""


def sequences(values: Values) -> dict[str, pd.DataFrame]:
    """Return the errors of all schemes, by scheme."""
    return {name: step_sizes(name, values["start"], values["t_end"], values["rungs"]) for name in SCHEMES}


def slope(frame: pd.DataFrame, of: str) -> OrderFit:
    """Return the order that the errors of a scheme show."""
    return fit_order(frame["h"], frame[of], floor=FLOOR)


def show_orders(values: Values) -> Shown:
    """Return errors against the step size and against evaluations, and the fitted orders."""
    frames, of = sequences(values), values["of"]
    errors = [frame[of] for frame in frames.values()]
    error = around(f"error of {OF[of]} at the end", *errors, [1e-15], log=True)
    panels = []
    for column, label in (("h", "step size h [s]"), ("evaluations", "evaluations of the force")):
        axis = around(label, *(frame[column] for frame in frames.values()), log=True)
        pairs = zip(frames.items(), STROKES, strict=False)
        marks = [
            mark for (name, frame), stroke in pairs for mark in curve(frame[column].to_numpy(), frame[of].to_numpy(), stroke, SCHEMES[name])
        ]
        panels.append(Panel(axis, error, marks, f"error against {label.partition(' [')[0]}"))
    picture = draw_panels(
        panels, alt=f"Error of {OF[of]} against step size and against evaluations of the force, one line per scheme.", height=330
    )
    return Shown(picture, orders_said({name: slope(frame, of) for name, frame in frames.items()}, OF[of]))


def curve(x: Array, y: Array, stroke: Stroke, name: str) -> list[Mark]:
    """Return a curve with a dot at each point."""
    return [Curve(x, y, stroke, name), Dots(x, y, stroke, radius=2.6)]


def orders_said(fits: dict[str, OrderFit], of: str) -> Markup:
    """Return the orders in a sentence."""
    words = {name: f"{fit.slope:.2f}" if fit.slope == fit.slope else "cannot be told" for name, fit in fits.items()}
    phrases = (Markup("{} <b>{}</b>").format(SCHEMES[name], word) for name, word in words.items())
    return Markup("Fitted order of the {}: {}.").format(of, Markup(", ").join(phrases))


def table_orders(values: Values) -> pd.DataFrame:
    """Return the errors behind the picture."""
    return pd.concat(sequences(values).values(), ignore_index=True)


def show_hidden(values: Values) -> Shown:
    """Return G H_p and the energy error of SHAKE, before or after the projection, and of RATTLE."""
    run = hidden(values["h"], values["t_end"])
    away, energy = (run.projected, run.energy_projected) if values["project"] else (run.shake, run.energy)
    time = Axis("t [s]", 0.0, float(run.t[-1]))
    both = ((away, STROKES[0], "SHAKE"), (run.rattle, STROKES[3], "RATTLE"))
    lines = [Curve(run.t, np.maximum(series, 1e-17), stroke, name) for series, stroke, name in both]
    residual = around("|G H\N{LATIN SUBSCRIPT SMALL LETTER P}|", [1e-17, 1e-2], log=True)
    level = around("H \N{MINUS SIGN} H\N{SUBSCRIPT ZERO} [J]", run.energy, run.energy_projected)
    panels = [
        Panel(time, residual, lines, "hidden constraint"),
        Panel(time, level, [Curve(run.t, energy, STROKES[0])], "energy error of SHAKE"),
    ]
    says = Markup(
        "Positions of SHAKE and RATTLE differ by at most {}. SHAKE's momenta are off the manifold by at most {}; after projection by {}, "
        "and then they differ from RATTLE's by {}."
    ).format(*(at_most(distance) for distance in (run.positions, run.shake.max(), run.projected.max(), run.momenta)))
    return Shown(
        draw_panels(panels, alt="Residual of the hidden constraint and energy error against time, of SHAKE and RATTLE.", height=270), says
    )


def table_hidden(values: Values) -> pd.DataFrame:
    """Return the numbers behind the picture."""
    run = hidden(values["h"], values["t_end"])
    names = ("t", "shake", "rattle", "projected", "energy", "energy_projected")
    return pd.DataFrame({name: getattr(run, name) for name in names})


ORDERS = Experiment(
    name="orders",
    title="Order and cost",
    controls=(
        Control("start", "start", tuple(STARTS), "fast", tuple(STARTS), STARTS.__getitem__),
        Control("of", "error of", tuple(OF), "q", tuple(OF), OF.__getitem__),
        Control("t_end", "length of the run", LENGTHS, 1.0, (), seconds),
        Control("rungs", "number of step sizes, each half of the previous one", RUNGS, DEFAULT_RUNGS, (3, 5, 7, 10)),
    ),
    show=show_orders,
    table=table_orders,
)
HIDDEN = Experiment(
    name="hidden",
    title="The hidden constraint",
    controls=(
        Control("project", "project SHAKE's momenta", NO_YES, False, NO_YES),
        Control("h", "step size h", (0.002, 0.005, 0.01, 0.02, 0.04), H, (0.005, 0.01, 0.02, 0.04), seconds),
        Control("t_end", "length of the run", (0.5, 1.0, 2.0, 5.0), 2.0, (), seconds),
    ),
    show=show_hidden,
    table=table_hidden,
)
EXPERIMENTS = (ORDERS, HIDDEN)


def thumbnail(axis: Any) -> None:
    """Draw the error against the step size for orders one, two, four and six, each with the name of its method."""
    for name in ("symplectic_euler", "rattle", "lobatto3", "lobatto4"):
        frame, color = step_sizes(name, "fast", 1.0, DEFAULT_RUNGS), stroke_of(name).color
        axis.plot(frame["h"], frame["q"], color=color, linewidth=1.6)
        last = frame.iloc[-1]
        axis.text(0.9 * last["h"], last["q"], name_of(name), color=color, fontsize=6.5, va="center", ha="right")
    axis.set(xscale="log", yscale="log", xlim=(4e-5, 4e-2))
    axis.minorticks_off()
    axis.set_xlabel("step size  [s]", loc="right")
    axis.set_title("error of positions  [m]", loc="left")


def preparations() -> list[Preparation]:
    """Return the kernels and runs that are needed before the controls respond."""
    compiled: list[Preparation] = [(f"compiling {name}", partial(solve, name, "slow", 0.1, 1)) for name in SCHEMES]
    every = [(start, t_end) for start in CASES for t_end in LENGTHS]

    def runs(start: str, t_end: float) -> None:
        for name in SCHEMES:
            step_sizes(name, start, t_end, RUNGS[-1])

    return compiled + [(f"runs of {t_end:g} s", partial(runs, start, t_end)) for start, t_end in every]


def claims() -> pd.DataFrame:
    """Return the properties of each scheme, and its cost on the slow start: one row per scheme."""
    rows = []
    for name, label in SCHEMES.items():
        method: FixedStep = parse(name)
        run = solve(name, "slow", 1.0, 10)
        scheme_claims = method.claims
        rows.append(
            {
                "name": name,
                "scheme": label,
                "order": scheme_claims.order,
                "g": scheme_claims.keeps_g,
                "Gv": scheme_claims.keeps_Gv,
                "force": run.work["H_q"] / run.steps,
            }
        )
    return pd.DataFrame(rows)


def facts() -> SimpleNamespace:
    """Return the numbers of the text; the first sentence that does not hold raises ClaimRefuted."""
    values = {"start": "fast", "t_end": 1.0, "rungs": RUNGS[-1]}
    frames, table, run = sequences(values), claims(), hidden(H, 5.0)
    orders = {name: slope(frame, "q").slope for name, frame in frames.items()}
    for row in table.to_dict("records"):
        require(abs(orders[row["name"]] - row["order"]) < 0.25, f"{row['scheme']} has order {row['order']}", orders[row["name"]])
    require(run.positions < 1e-9, "SHAKE and RATTLE have the same positions", run.positions)
    require(run.momenta < 1e-9, "SHAKE's momenta, projected, are RATTLE's", run.momenta)
    require(run.shake.max() > 1e6 * run.rattle.max(), "SHAKE's momenta are off the manifold", run.shake.max())
    kept = {name: two_form(name) for name in SCHEMES}
    require(max(kept.values()) < ROUNDED, "all schemes preserve the two-form on tangents of the manifold, SHAKE included", kept)
    fine, rough = ({name: cheapest(frame, error) for name, frame in frames.items()} for error in (FINE, ROUGH))
    require(fine["lobatto3"] < fine["shake"] < fine["rattle"], "a higher order is cheaper for a small error", fine)
    rattle_cost = fine["rattle"] / 2 + 1
    require(abs(rattle_cost - fine["shake"]) <= KICKS, "RATTLE with stored forces costs as much as SHAKE", (rattle_cost, fine["shake"]))
    require(np.isnan(fine["symplectic_euler"]), "symplectic Euler does not reach a small error with any step", fine)
    require(
        max(rough["shake"], rough["rattle"]) < min(rough["lobatto3"], rough["lobatto4"]), "order two is cheaper for a large error", rough
    )
    return SimpleNamespace(
        orders=orders, table=table, hidden=run, fine=fine, kept=rattle_cost, rough=rough, error=FINE, large=ROUGH, form=kept["shake"]
    )


def two_form(name: str) -> float:
    """Return by how much ten steps of a scheme from the fast start change the two-form of tangents of the manifold."""
    ivp = ivp_of("fast")
    return symplecticity_defect(parse(name).flow(ivp, H, 10), ivp.p0, ivp.q0, tangent_basis(ivp, ivp.p0, ivp.q0))


def cheapest(frame: pd.DataFrame, error: float) -> float:
    """Return the smallest number of force evaluations of the runs whose error of q is at most ``error``."""
    return float(frame[frame["q"] <= error]["evaluations"].min())
