"""From SHAKE to RATTLE to Lobatto: the constraints that a scheme satisfies, its multipliers, its order and its cost."""

from typing import Any

import numpy as np

from daebench.draw.methods import name_of, stroke_of
from daebench.methods.fixed_step.script import script, script_of_functions
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.pages.lesson.page import Content
from daebench.pages.report import Progress
from daebench.pages.report.exact_motion import exact_motion
from daebench.runs.make_ivp import constrained
from daebench.runs.request import Request

PROBLEM, ANGLE, SPEED, H = "spherical_pendulum", 1.2, 0.5, 0.02
SCHEMES = ("shake", "rattle", "lobatto3", "lobatto4", "se")
FINEST = "rattle/kahan_li8"
"""The method whose run with a small step replaces the exact motion."""


def content(tell: Progress) -> Content:
    """Return the content of the page, which computes the numbers of its sentences itself."""
    q0 = (float(np.sin(ANGLE)), 0.0, float(-np.cos(ANGLE)))
    ivp = constrained(initial_value_problem(PROBLEM, "fig1.2", q0=q0, p0=(0.0, SPEED, 0.0)))
    scripts = {name: script(parse(name), ivp, H) for name in (*SCHEMES, FINEST)}
    names = {name: name_of(name) for name in SCHEMES} | {"se": "symplectic Euler, reduced equations"}
    colours = {name: stroke_of(name).color for name in SCHEMES}
    data = {
        "p0": list(map(float, ivp.p0)),
        "q0": list(map(float, ivp.q0)),
        "problem": list(map(float, ivp.par)),
        "schemes": list(SCHEMES),
        "finest": FINEST,
        "names": names,
        "colours": colours,
    }
    functions = script_of_functions(ivp, ["H", "Gv"])
    title = "From SHAKE to RATTLE to Lobatto"
    return Content(title, scripts=scripts, functions=functions, data=data, text={"names": names, "colours": colours, "schemes": SCHEMES})


def thumbnail(axis: Any) -> None:
    """Draw the error after one second against the step size for orders one, two, four and six, each with the name of its method."""
    ivp = constrained(initial_value_problem(PROBLEM, "fig1.2"))
    exact = exact_motion(ivp.source, "fig1.2", [1.0])[0][0]
    h = [0.025 / 2**k for k in range(8)]
    for name in ("symplectic_euler", "rattle", "lobatto3", "lobatto4"):
        runs = [parse(name).solve(ivp, Request(value=step, t_end=1.0, every=0, watch=())) for step in h]
        errors, color = [np.linalg.norm(run.q[-1] - exact) for run in runs], stroke_of(name).color
        axis.plot(h, errors, color=color, linewidth=1.6)
        axis.text(0.9 * h[-1], errors[-1], name_of(name), color=color, fontsize=6.5, va="center", ha="right")
    axis.set(xscale="log", yscale="log", xlim=(4e-5, 4e-2))
    axis.minorticks_off()
    axis.set_xlabel("step size  [s]", loc="right")
    axis.set_title("error of positions  [m]", loc="left")
