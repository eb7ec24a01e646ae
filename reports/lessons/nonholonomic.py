"""A pendulum sets the ratio of two oscillators: which methods keep their energy, and how symmetry decides it."""

from typing import Any

import numpy as np

from daebench.diagnostics.energy_verdict import energy_error
from daebench.draw.figures import BLUE, VERMILION
from daebench.draw.methods import name_of, stroke_of
from daebench.methods.fixed_step.script import script, script_of_functions
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.pages.lesson.page import Content
from daebench.pages.report import Progress
from daebench.runs.make_ivp import constrained
from daebench.runs.request import Request

PROBLEM, CASE, H = "variable_transmission", "uneven", 0.2
METHODS = ("dla", "spark_lobatto3", "gni", "rk4+proj")


def content(tell: Progress) -> Content:
    """Return the content of the page, which computes the numbers of its sentences itself."""
    ivp = constrained(initial_value_problem(PROBLEM, CASE))
    scripts = {name: script(parse(name), ivp, H) for name in METHODS}
    names, colours = ({name: of(name) for name in METHODS} for of in (name_of, lambda name: stroke_of(name).color))
    data: dict[str, Any] = {"p0": list(map(float, ivp.p0)), "q0": list(map(float, ivp.q0)), "problem": list(map(float, ivp.par))}
    data |= {"place": {name: k for k, name in enumerate(ivp.parameters)}, "chosen": METHODS, "names": names, "colours": colours}
    title = "What makes nonholonomic integrators work"
    return Content(title, scripts=scripts, functions=script_of_functions(ivp, ["H"]), data=data, text={"methods": METHODS, "names": names})


def thumbnail(axis: Any) -> None:
    """Draw the energy error of the Lagrange-d'Alembert scheme on an even and on an uneven transmission, each with its name."""
    for case, color, side in (("even", BLUE, "bottom"), ("uneven", VERMILION, "bottom")):
        ivp = constrained(initial_value_problem(PROBLEM, case))
        run = parse("dla").solve(ivp, Request(value=H, t_end=6e3, every=50, watch=()))
        axis.plot(run.t, np.asarray(energy_error(ivp, run)), color=color, linewidth=1.2)
        axis.text(run.t[-1], energy_error(ivp, run)[-50:].max() + 0.05, f"{case} pendulum", color=color, ha="right", va=side)
    axis.set(xlabel="time", ylim=(-1.15, 0.3))
    axis.set_title("energy error of one scheme", loc="left")
