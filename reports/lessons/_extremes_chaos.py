"""Chaos: two double pendulums that start almost alike."""

from functools import cache

import numpy as np
import pandas as pd
from markupsafe import Markup

from daebench.diagnostics.integrals import energy_error
from daebench.draw.svg.axis import Axis
from daebench.draw.svg.panels import draw_panels
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.pages.lesson.control import Control, Values
from daebench.pages.lesson.experiment import Experiment, Shown
from daebench.pages.report import at_most, number
from daebench.reports.lessons._panels import MINUS_START, against_time, seconds, small
from daebench.runs.ivp import Array
from daebench.runs.request import Request
from daebench.runs.trajectory import Trajectory

SCHEMES = {"rattle": "RATTLE", "lobatto3": "Lobatto, 3 stages"}
APART = tuple(float(f"1e-{k}") for k in range(14, 1, -2))
DELTA, H, T_END, PARTED = 1e-10, 0.005, 40.0, 0.1


@cache
def run(scheme: str, delta: float, h: float, t_end: float) -> tuple[Trajectory, Array]:
    """Return the run of a double pendulum released delta rad below the horizontal, and its energy error."""
    c, s = float(np.cos(delta)), float(np.sin(delta))
    ivp = initial_value_problem("double_pendulum", "horizontal", q0=(c, -s, 2 * c, -2 * s), p0=(0.0,) * 4)
    found = parse(scheme).solve(ivp, Request(value=h, t_end=t_end, every=max(1, round(t_end / h / 2000)), watch=()))
    return found, energy_error(ivp, found)


def apart(values: Values) -> tuple[Array, Array, Array]:
    """Return times, the distance of the lower points of both pendulums, and the energy error of the first."""
    (one, energy), (other, _) = (run(values["scheme"], delta, values["h"], values["t_end"]) for delta in (0.0, values["delta"]))
    n = min(len(one.t), len(other.t))
    return one.t[:n], np.linalg.norm(one.q[:n, 2:] - other.q[:n, 2:], axis=1), energy[:n]


def parted(t: Array, distance: Array) -> float:
    """Return when the distance first is as large as a tenth of an arm; NaN if it never is."""
    large = np.flatnonzero(distance > PARTED)
    return float(t[large[0]]) if len(large) else float("nan")


def show(values: Values) -> Shown:
    """Return the distance of both pendulums and the energy error of one of them."""
    t, distance, energy = apart(values)
    panels = [
        against_time(t, {"": distance}, "", "distance of the lower points", Axis("distance [m]", 1e-16, 1e1, log=True)),
        against_time(t, {"": energy}, MINUS_START, "energy error of one of them"),
    ]
    when = parted(t, distance)
    told = Markup("they are a tenth of an arm apart after <b>{:.1f} s</b>").format(when) if when == when else Markup("they have not parted")
    says = Markup("Released {} rad apart, {}. The energy error is {} J at most.").format(
        number(values["delta"], 1), told, at_most(np.max(np.abs(energy)))
    )
    return Shown(draw_panels(panels, alt="Distance of two double pendulums against time, and energy error of one.", height=250), says)


def table(values: Values) -> pd.DataFrame:
    """Return the numbers behind the picture."""
    return pd.DataFrame(dict(zip(("t", "distance", "energy_error"), apart(values), strict=True)))


CHAOS = Experiment(
    name="chaos",
    title="Two starts",
    controls=(
        Control("delta", "released so far apart [rad]", APART, DELTA, APART, small),
        Control("scheme", "method", tuple(SCHEMES), "rattle", tuple(SCHEMES), SCHEMES.__getitem__),
        Control("h", "step size h", (0.002, 0.005, 0.01), H, (), seconds),
        Control("t_end", "length of the run", (10.0, 20.0, 30.0, 40.0), T_END, (), seconds),
    ),
    show=show,
    table=table,
)
