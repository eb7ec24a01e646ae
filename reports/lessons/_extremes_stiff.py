"""Stiffness: a strong spring in the place of the constraint, and steps that resolve its oscillation or do not."""

from functools import cache

import numpy as np
import pandas as pd
from markupsafe import Markup

from daebench.draw.svg.axis import Axis
from daebench.draw.svg.panels import draw_panels
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.pages.lesson.control import Control, Values
from daebench.pages.lesson.experiment import Experiment, Shown
from daebench.pages.report import at_most, number
from daebench.reports.lessons._panels import against_time, seconds, small
from daebench.runs.ivp import Array
from daebench.runs.request import Request
from daebench.runs.trajectory import Trajectory

SCHEMES = {"stiff:rk4": "Runge and Kutta (rk4)", "stiff:midpoint": "midpoint rule"}
EPS, H, T_END = (0.1, 0.03, 0.01, 0.003, 0.001, 0.0003, 0.0001), (0.001, 0.002, 0.005, 0.01), 3.0
REFERENCE = "lobatto3"


@cache
def run(scheme: str, eps: float, h: float) -> tuple[Trajectory, Array, Array]:
    """Return a run of the penalised system, its distance from the constrained motion, and |g|; what is not finite is left out."""
    ivp = initial_value_problem("spherical_pendulum", "fig1.2")
    request = Request(value=h, t_end=T_END, every=1, watch=())
    reference = parse(REFERENCE).solve(ivp, request)
    found = parse(scheme, {"eps": eps}).solve(ivp, request)
    n = min(len(found.t), len(reference.t))
    away = np.linalg.norm(found.q[:n] - reference.q[:n], axis=1)
    return found, away, np.abs(ivp.along("g", found.q[:n])).ravel()


def show(values: Values) -> Shown:
    """Return the distance from the constrained motion and the residual of the constraint."""
    found, away, g = run(**values)
    panels = [
        against_time(
            found.t,
            {"": away},
            "",
            "distance from the constrained motion",
            Axis("|q \N{MINUS SIGN} q constrained| [m]", 1e-9, 1e2, log=True),
        ),
        against_time(found.t, {"": g}, "", "residual of the constraint", Axis("|g|", 1e-9, 1e2, log=True)),
    ]
    turns = values["h"] / (np.pi * values["eps"])
    says = Markup(
        "The spring oscillates in {} s: a step is <b>{}</b> of that. |<i>g</i>| is {} at most; the distance at the end is {} m."
    ).format(number(np.pi * values["eps"]), number(turns), at_most(g.max()), number(away[-1]))
    if found.failure:
        says += Markup(" The run stopped at <i>t</i> = {:.3g} s.").format(found.t[-1])
    return Shown(
        draw_panels(panels, alt="Distance from the constrained motion and residual of the constraint against time.", height=250), says
    )


def table(values: Values) -> pd.DataFrame:
    """Return the numbers behind the picture."""
    found, away, g = run(**values)
    return pd.DataFrame({"t": found.t[: len(away)], "distance": away, "g": g})


STIFF = Experiment(
    name="stiffness",
    title="A spring in the place of the constraint",
    controls=(
        Control("eps", "\N{GREEK SMALL LETTER EPSILON}, the softness of the spring", EPS, 0.01, EPS, small),
        Control("scheme", "method", tuple(SCHEMES), "stiff:rk4", tuple(SCHEMES), SCHEMES.__getitem__),
        Control("h", "step size h", H, 0.005, (0.002, 0.005), seconds),
    ),
    show=show,
    table=table,
)
