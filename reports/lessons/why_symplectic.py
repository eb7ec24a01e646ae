"""The symplectic area of a parallelogram of tangent vectors under the steps of a method."""

from typing import Any

import numpy as np

from daebench.diagnostics.symplecticity import areas, tangent_path
from daebench.draw.methods import name_of, stroke_of
from daebench.methods.fixed_step.script import script, script_of_functions
from daebench.methods.names import parse
from daebench.pages.lesson.page import Content
from daebench.pages.report import Progress, number
from daebench.reports._two_motions import BEGUN, PENDULUM, SPEED, TORUS
from daebench.reports.lessons._why_symplectic_fair import MIDDLE, ON_TORUS, fair

HEROES = (
    ("rattle", "RATTLE", "the constraint itself"),
    ("midpoint", "midpoint rule", "reduced equations"),
    ("se", "symplectic Euler", "reduced equations"),
)
BEADS = (("rattle", "RATTLE", "the constraint itself"), ("gauss2", "Gauss 2", "reduced equations"))
CARRIED = ("rattle", "midpoint", "rk4", "se", "se+proj", "implicit_euler")
LABELS = {"se": "symplectic Euler", "se+proj": "symplectic Euler, projected", "midpoint": "midpoint rule"}
NAMES = {
    "rattle": "RATTLE",
    "lobatto3": "Lobatto 3",
    "canonical:gauss2": "Gauss 2, angles and momenta",
    "local:gauss2": "Gauss 2, angles and rates",
    "gauss2": "Gauss 2, reduced",
    "rk4": "RK4, reduced",
}
"""Names of the curves on the torus."""


def content(tell: Progress) -> Content:
    """Return the content of the page; sentences on the long runs are tested here, the page computes the other numbers itself."""
    ivp, bead, facts = PENDULUM.ivp(), TORUS.ivp(), fair()
    scripts = {name: script(parse(name), ivp, PENDULUM.h, watch=("energy",)) for name in CARRIED}
    scripts |= {f"{name} tangents": script(parse(name), ivp, PENDULUM.h, directions=2) for name in CARRIED}
    scripts |= {f"torus {name}": script(parse(name), bead, TORUS.h, watch=("energy",)) for name in ON_TORUS}
    names = {name: LABELS.get(name, name_of(name)) for name in CARRIED}
    radius, tube = (float(bead.parameters[name]) for name in ("radius", "tube"))
    data = {
        "p0": list(map(float, ivp.p0)),
        "q0": list(map(float, ivp.q0)),
        "problem": list(map(float, ivp.par)),
        "speed": SPEED,
        "carried": list(CARRIED),
        "names": names,
        "colours": colours(),
        "end": PENDULUM.t_end,
        "torus": {"names": NAMES, "beads": [name for name, *_ in BEADS], "h": TORUS.h, "end": TORUS.t_end, "radius": radius, "tube": tube},
    }
    words = {"heroes": HEROES, "beads": BEADS, "carried": list(names.items()), "colours": colours()}
    long = {"facts": facts, "number": number, "early": BEGUN, "middle": MIDDLE}
    title = "Why index reduction breaks symplecticity"
    return Content(title, scripts=scripts, functions=script_of_functions(ivp, ["H", "lam"]), data=data, text=words | long)


def colours() -> dict[str, str]:
    """Return the colours of the methods."""
    plain = {name: stroke_of(name).color for name in (*CARRIED, *ON_TORUS)}
    return plain | {"canonical:gauss2": "#7a3e9d", "local:gauss2": "#a8872d"}


def thumbnail(axis: Any) -> None:
    """Draw the symplectic area of a parallelogram under three methods, each with its name."""
    ivp, steps = PENDULUM.ivp(), round(10.0 / PENDULUM.h)
    across = np.cross(ivp.q0, ivp.p0)  # for unit mass and length both vectors are tangent, and their area is 1
    across /= np.linalg.norm(across)
    sides = np.stack([np.concatenate([-(ivp.p0 @ across) * ivp.q0, across]), np.concatenate([across, np.zeros(3)])], axis=1)
    for name, label, dashes, side in (
        ("se", "symplectic\nEuler", "-", "center"),
        ("rattle", "RATTLE", "-", "top"),
        ("rk4", "RK4", "--", "bottom"),
    ):
        _, carried, _ = tangent_path(parse(name).path(ivp, PENDULUM.h, steps), ivp.p0, ivp.q0, sides)
        t, area, color = PENDULUM.h * np.arange(len(carried)), areas(carried).sum(axis=1), stroke_of(name).color
        axis.plot(t, area, color=color, linewidth=1.6, linestyle=dashes)
        axis.text(1.03 * t[-1], area[-1], label, color=color, fontsize=7.0, va=side)
    axis.margins(y=0.15)
    axis.set_xlabel("time  [s]", loc="right")
    axis.set_title("symplectic area of a parallelogram", loc="left")
