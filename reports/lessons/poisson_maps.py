"""Predators and prey, and which methods keep the Poisson volume of a cat and a closed orbit; and a rigid body on its sphere."""

from typing import Any

import numpy as np

from daebench.draw.figures import BLACK, GREEN, VERMILION
from daebench.draw.methods import name_of, stroke_of
from daebench.methods.fixed_step.script import script, script_of_functions
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import POISSON, parse
from daebench.pages.lesson.page import Content
from daebench.pages.report import Progress
from daebench.reports.poisson.orbits import level_curve

PREY, BODY, H, SPIN = "lotka_volterra", "free_rigid_body", 0.1, 1.1
CARRIED = ("strang", "symplectic_euler_adjoint", "midpoint", "rk4", "explicit_euler")
SPUN = ("strang@123", "midpoint", "rk4")
LABELS = {"strang@123": "splitting into three rotations", "strang": "splitting"}


def content(tell: Progress) -> Content:
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
    title = "Poisson maps"
    return Content(
        title, scripts=scripts, functions=functions, data=data, text={"carried": CARRIED, "spun": SPUN, "names": names, "colours": colours}
    )


def thumbnail(axis: Any) -> None:
    """Draw a cat that a Poisson map carries round an orbit: where it begins, and where it comes to."""
    ears = [(0.95, 0.55), (0.85, 1.25), (0.35, 0.93), (-0.35, 0.93), (-0.85, 1.25), (-0.95, 0.55)]
    chin = np.radians(np.linspace(150, 390, 25))
    outline = np.array([*ears, *zip(np.cos(chin), np.sin(chin), strict=True)])
    prey: Any = initial_value_problem(PREY, "4,2")
    path = parse("strang", kind=POISSON).path(prey, 0.05, 50)
    walked = np.array([np.real(path(np.asarray(start, dtype=complex))[0]) for start in prey.start[0] * np.exp(0.12 * outline)])
    axis.plot(*np.asarray(level_curve(prey)[["u", "v"]]).T, color=BLACK, linewidth=0.8, linestyle=(0, (4, 3)))
    for k in (0, 12, 25, 37, 50):
        axis.fill(*walked[:, k].T, color=VERMILION if k else GREEN, linewidth=0)
    ticks = {"xticks": [0.1, 1, 4], "xticklabels": ["0.1", "1", "4"], "yticks": [0.5, 2, 5], "yticklabels": ["0.5", "2", "5"]}
    axis.set(xscale="log", yscale="log", **ticks)
    axis.minorticks_off()
    axis.set_xlabel("predators", loc="right")
    axis.set_ylabel("prey", loc="top")
    axis.set_title("a cat keeps its Poisson volume", loc="left")
