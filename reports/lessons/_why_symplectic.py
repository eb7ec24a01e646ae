"""Experiment of the lesson on index reduction, and the numbers of its text."""

from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from daebench.diagnostics.symplecticity import symplecticity_defect, tangent_basis
from daebench.draw.methods import stroke_of
from daebench.pages.lesson.control import NO_YES, Control, Values
from daebench.pages.lesson.experiment import Experiment, Preparation, Shown
from daebench.pages.report import at_most, number
from daebench.pages.report.claims import require
from daebench.reports._two_motions import PENDULUM, TORUS, measured
from daebench.reports.lessons._panels import seconds
from daebench.reports.lessons._why_symplectic_fair import ON_PENDULUM, ON_TORUS, fair
from daebench.reports.lessons._why_symplectic_picture import picture
from daebench.reports.lessons._why_symplectic_run import Carried, carried, ivp_of, method_of

SCHEMES = {
    "se": "symplectic Euler, index reduced (se)",
    "rk4": "Runge and Kutta, index reduced (rk4)",
    "midpoint": "midpoint rule, index reduced",
    "symplectic_euler": "symplectic Euler, constrained",
    "rattle": "RATTLE",
    "lobatto3": "Lobatto IIIA-IIIB, 3 stages",
    "implicit_euler": "implicit Euler, constrained",
}
FILM = ("se", "rk4", "midpoint", "symplectic_euler", "rattle", "implicit_euler")
STARTS = {"slow": "slow, HLW Fig. 1.1", "wide": "wide", "fast": "fast, HLW Fig. 1.2"}
H, T_END, FEW = 0.05, 10.0, 10


def show(values: Values) -> Shown:
    """Return the picture of a run and its measurements."""
    run = carried(**values)
    return Shown(picture(run), says(run, asked=values["project"]))


def says(run: Carried, *, asked: bool) -> Markup:
    """Return sentences on the area, the energy and the constraints of a run."""
    fate = "unchanged to round-off" if run.kept else "not kept"
    parts = [
        Markup("<b>{}</b>: the area <i>dq</i> ∧ <i>dp</i> goes from {:.4f} to <b>{}</b>, {} (largest change {}).").format(
            run.method, run.area[0], number(run.area[-1], 5), fate, number(run.change)
        ),
        Markup("Energy error at most {}, |<i>g</i>| at most {}, |<i>G H<sub>p</sub></i>| at most {}.").format(
            *(at_most(np.max(np.abs(error))) for error in (run.energy, run.g, run.Gv))
        ),
    ]
    if asked and not run.projected:
        parts.append(Markup("Its steps end on the manifold without projection: there is nothing to project."))
    if run.failure:
        parts.append(Markup("It stopped{}").format(run.failure.partition("stopped")[2]))
    return Markup(" ").join(parts)


def table(values: Values) -> pd.DataFrame:
    """Return the numbers behind the picture, one row a state."""
    run = carried(**values)
    columns = {"t": run.t} | {f"q{i + 1}": run.q[:, i] for i in range(3)} | {f"p{i + 1}": run.p[:, i] for i in range(3)}
    columns |= {"energy_error": run.energy, "g": run.g, "Gv": run.Gv, "area": run.area}
    return pd.DataFrame(columns | {f"area{i + 1}": run.planes[:, i] for i in range(3)})


PARALLELOGRAM = Experiment(
    name="parallelogram",
    title="A parallelogram carried along",
    controls=(
        Control("scheme", "method", tuple(SCHEMES), "se", FILM, SCHEMES.__getitem__),
        Control("project", "project each step", NO_YES, False, NO_YES),
        Control("h", "step size h", (0.01, 0.02, 0.03, 0.05, 0.07, 0.1, 0.15, 0.2), H, (0.02, 0.05, 0.1), seconds),
        Control("t_end", "length of the run", (0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 30.0), T_END, (), seconds),
        Control("start", "start", tuple(STARTS), "wide", (), STARTS.__getitem__),
    ),
    show=show,
    table=table,
)
EXPERIMENTS = (PARALLELOGRAM,)


def thumbnail(axis: Any) -> None:
    """Draw the symplectic area under three methods, each with its name."""
    for name, label, dashes, side in (
        ("se", "symplectic\nEuler", "-", "center"),
        ("rattle", "RATTLE", "-", "top"),
        ("rk4", "RK4", "--", "bottom"),
    ):
        run, color = carried(name, False, "wide", H, T_END), stroke_of(name).color
        axis.plot(run.t, run.area, color=color, linewidth=1.6, linestyle=dashes)
        axis.text(1.03 * T_END, run.area[-1], label, color=color, fontsize=7.0, va=side)
    axis.margins(y=0.15)
    axis.set_xlabel("time  [s]", loc="right")
    axis.set_title("symplectic area of a parallelogram", loc="left")


def preparations() -> list[Preparation]:
    """Return the kernels that have to be compiled before the controls respond."""
    pairs = [(scheme, project) for scheme in SCHEMES for project in NO_YES if method_of(scheme, project)[1] or not project]
    compiled: list[Preparation] = [(f"compiling {method_of(*pair)[0].name}", partial(carried, *pair, "wide", H, H)) for pair in pairs]
    long = [(motion, name) for motion, names in ((TORUS, ON_TORUS), (PENDULUM, ON_PENDULUM)) for name in names]
    return compiled + [(f"long run of {name} on {motion.problem}", partial(measured, motion, name)) for motion, name in long]


def facts() -> SimpleNamespace:
    """Return the numbers of the text; the first sentence that does not hold raises ClaimRefuted."""
    ivp = ivp_of("wide")
    X = tangent_basis(ivp, ivp.p0, ivp.q0)

    def defect(scheme: str, steps: int) -> float:
        return symplecticity_defect(method_of(scheme, False)[0].flow(ivp, H, steps), ivp.p0, ivp.q0, X)

    runs = {name: carried(name, project, "wide", H, T_END) for name, project in (("se", False), ("rk4", False), ("rattle", False))}
    projected = carried("se", True, "wide", H, T_END)
    numbers = SimpleNamespace(
        one=defect("se", 1), several=defect("se", FEW), few=FEW, h=H, t_end=T_END, runs=runs, projected=projected, fair=fair()
    )
    require(numbers.one < 1e-13, "one step of se from the manifold is symplectic", numbers.one)
    require(numbers.several > 1e-3, "several steps of se are not", numbers.several)
    require(runs["rattle"].kept, "RATTLE keeps the area", runs["rattle"].change)
    require(not runs["se"].kept and not runs["rk4"].kept and not projected.kept, "se, rk4 and projected se do not", projected.change)
    require(np.max(projected.g) < 1e-12, "projected se stays on the manifold", np.max(projected.g))
    require(runs["rk4"].change < 0.1 * runs["se"].change, "rk4 changes the area far less than se", runs["rk4"].change)
    return numbers
