"""The live page of the lesson on index reduction: the kernels that it runs, and the numbers of its text."""

import numpy as np

from daebench.draw.methods import name_of, stroke_of
from daebench.methods.fixed_step.script import script, script_of_functions
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.pages.lesson.live_page import Content
from daebench.runs.ivp import ConstrainedIvp
from daebench.runs.make_ivp import constrained

PROBLEM, ANGLE, SPEED, H = "spherical_pendulum", 1.0, 0.3, 0.05
HEROES = (
    ("rattle", "RATTLE", "the constraint itself"),
    ("se", "symplectic Euler", "reduced equations"),
    ("rk4", "RK4", "reduced equations"),
)
CARRIED = ("rattle", "rk4", "se", "se+proj", "implicit_euler")
LABELS = {"se": "symplectic Euler", "se+proj": "symplectic Euler, projected"}


def start() -> ConstrainedIvp:
    """Return the pendulum, one radian from hanging, pushed sideways."""
    q0 = (float(np.sin(ANGLE)), 0.0, float(-np.cos(ANGLE)))
    return constrained(initial_value_problem(PROBLEM, "fig1.1", q0=q0, p0=(0.0, SPEED, 0.0)))


def content() -> Content:
    """Return the content of the page, which computes the numbers of its sentences itself."""
    ivp = start()
    scripts = {name: script(parse(name), ivp, H, watch=("energy",)) for name in CARRIED}
    scripts |= {f"{name} tangents": script(parse(name), ivp, H, directions=2) for name in CARRIED}
    names = {name: LABELS.get(name, name_of(name)) for name in CARRIED}
    data = {
        "p0": list(map(float, ivp.p0)),
        "q0": list(map(float, ivp.q0)),
        "problem": list(map(float, ivp.par)),
        "speed": SPEED,
        "carried": list(CARRIED),
        "names": names,
        "colours": colours(),
    }
    return Content(
        scripts=scripts,
        functions=script_of_functions(ivp, ["H", "lam"]),
        data=data,
        text={"heroes": HEROES, "carried": list(names.items()), "colours": colours()},
    )


def colours() -> dict[str, str]:
    """Return the colours of the methods."""
    return {name: stroke_of(name).color for name in CARRIED}
