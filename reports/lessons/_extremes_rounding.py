"""Round-off: what a sum of many small steps loses, and compensated summation gives back."""

from functools import cache

import numpy as np
import pandas as pd
from markupsafe import Markup

from daebench.draw.svg.axis import around
from daebench.draw.svg.panels import draw_panels
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.pages.lesson.control import NO_YES, Control, Values
from daebench.pages.lesson.experiment import Experiment, Shown
from daebench.pages.report import count, number
from daebench.reports.lessons._panels import against_time, seconds
from daebench.runs.ivp import Array
from daebench.runs.request import Request

SHOWN = 400
STEPS = (1000, 10_000, 50_000, 100_000, 200_000)
NAMES = {False: "plain sums", True: "compensated sums"}


@cache
def run(compensated: bool, h: float, steps: int) -> tuple[Array, Array]:
    """Return times and the error of the angular momentum about the vertical, which RATTLE keeps but for rounding."""
    ivp = initial_value_problem("spherical_pendulum", "fig1.1")
    request = Request(value=h, steps=steps, every=max(1, steps // SHOWN), watch=())
    found = parse("rattle", compensated=compensated).solve(ivp, request)
    L3 = found.q[:, 0] * found.p[:, 1] - found.q[:, 1] * found.p[:, 0]
    return found.t, L3 - L3[0]


def show(values: Values) -> Shown:
    """Return the error of the angular momentum, with plain sums and, if it is asked for, compensated ones."""
    shown = {NAMES[each]: run(each, values["h"], values["steps"]) for each in NO_YES if not each or values["compensated"]}
    errors = {name: error for name, (_, error) in shown.items()}
    t = shown[NAMES[False]][0]
    axis = around("L\N{SUBSCRIPT THREE} \N{MINUS SIGN} its start [J s]", *errors.values(), [0.0])
    panels = [
        against_time(t, errors, "", "error of the angular momentum", axis),
        against_time(t, errors, "", "the same, modulus", around("|error| [J s]", [1e-19, 1e-13], log=True)),
    ]
    largest = Markup(", ").join(Markup("{} <b>{}</b>").format(name, number(np.max(np.abs(error)))) for name, error in errors.items())
    says = Markup("After {} steps, the largest error of the angular momentum: {}.").format(count(values["steps"]), largest)
    return Shown(
        draw_panels(panels, alt="Error of the angular momentum against time, with plain and with compensated sums.", height=250), says
    )


def table(values: Values) -> pd.DataFrame:
    """Return the numbers behind the picture."""
    (t, plain), (_, compensated) = (run(each, values["h"], values["steps"]) for each in NO_YES)
    return pd.DataFrame({"t": t, "plain": plain, "compensated": compensated})


ROUNDING = Experiment(
    name="round-off",
    title="A long sum",
    controls=(
        Control("compensated", "show compensated sums too", NO_YES, False, NO_YES),
        Control("steps", "steps", STEPS, 100_000, (10_000, 100_000, 200_000), lambda n: f"{n:,}".replace(",", " ")),
        Control("h", "step size h", (0.001, 0.01, 0.1), 0.01, (), seconds),
    ),
    show=show,
    table=table,
)
