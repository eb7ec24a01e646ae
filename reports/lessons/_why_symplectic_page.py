"""The live page of the lesson on index reduction: the kernels that it runs, and the numbers of its text."""

from daebench.draw.methods import name_of, stroke_of
from daebench.methods.fixed_step.script import script, script_of_functions
from daebench.methods.names import parse
from daebench.pages.lesson.live_page import Content
from daebench.pages.report import number
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


def content() -> Content:
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
    return Content(scripts=scripts, functions=script_of_functions(ivp, ["H", "lam"]), data=data, text=words | long)


def colours() -> dict[str, str]:
    """Return the colours of the methods."""
    plain = {name: stroke_of(name).color for name in (*CARRIED, *ON_TORUS)}
    return plain | {"canonical:gauss2": "#7a3e9d", "local:gauss2": "#a8872d"}
