"""The live page of the lesson on SHAKE, RATTLE and Lobatto: the kernels that it runs."""

import numpy as np

from daebench.draw.methods import name_of, stroke_of
from daebench.methods.fixed_step.script import script, script_of_functions
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.pages.lesson.live_page import Content
from daebench.runs.make_ivp import constrained

PROBLEM, ANGLE, SPEED, H = "spherical_pendulum", 1.2, 0.5, 0.02
SCHEMES = ("shake", "rattle", "lobatto3", "lobatto4", "se")
FINEST = "rattle/kahan_li8"
"""The method whose run with a small step replaces the exact motion."""


def content() -> Content:
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
    return Content(scripts=scripts, functions=functions, data=data, text={"names": names, "colours": colours, "schemes": SCHEMES})
