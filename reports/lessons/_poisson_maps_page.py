"""The live page of the lesson on Poisson maps: the kernels that it runs."""

import numpy as np

from daebench.draw.methods import name_of, stroke_of
from daebench.methods.fixed_step.script import script, script_of_functions
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import POISSON, parse
from daebench.pages.lesson.live_page import Content

PREY, BODY, H, SPIN = "lotka_volterra", "free_rigid_body", 0.1, 1.1
CARRIED = ("strang", "symplectic_euler_adjoint", "midpoint", "rk4")
SPUN = ("strang@123", "midpoint", "rk4")
LABELS = {"strang@123": "splitting into three rotations", "strang": "splitting"}


def content() -> Content:
    """Return the content of the page, which computes the numbers of its sentences itself."""
    prey = initial_value_problem(PREY)
    body = initial_value_problem(BODY, "hlw", y0=[float(np.cos(SPIN)), 0.0, float(np.sin(SPIN))])
    carried = {name: parse(name, kind=POISSON, anyway=True) for name in CARRIED}
    scripts = {f"{PREY} {name}": script(method, prey, H) for name, method in carried.items()}
    scripts |= {f"{PREY} {name} tangents": script(method, prey, H, directions=2) for name, method in carried.items()}
    scripts |= {f"{BODY} {name}": script(parse(name, kind=POISSON, anyway=True), body, H) for name in SPUN}
    names = {name: LABELS.get(name, name_of(name)) for name in (*CARRIED, *SPUN)}
    colours = {name: stroke_of(name).color for name in names}
    data = {
        "prey": list(map(float, prey.par)),
        "body": list(map(float, body.par)),
        "y0": list(map(float, body.start[0])),
        "carried": list(CARRIED),
        "spun": list(SPUN),
        "names": names,
        "colours": colours,
    }
    functions = f"{{prey:{script_of_functions(prey, ['H'])},body:{script_of_functions(body, ['H'])}}}"
    return Content(
        scripts=scripts, functions=functions, data=data, text={"carried": CARRIED, "spun": SPUN, "names": names, "colours": colours}
    )
