"""The symplectic area of a parallelogram of tangent vectors under the steps of a method."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np

from daebench.diagnostics.energy import energy_drift
from daebench.diagnostics.symplecticity import areas, tangent_path
from daebench.draw.methods import name_of, stroke_of
from daebench.methods.fixed_step.script import script, script_of_functions
from daebench.methods.names import parse
from daebench.pages.lesson.page import Content
from daebench.pages.report import Progress, number
from daebench.pages.report.claims import require
from daebench.reports.index_reduction.two_motions import BEGUN, PENDULUM, SPEED, TORUS, Run, measured, require_level, require_lost

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


MIDDLE = 2e3
"""Time at which the error on the torus is told as well, s."""

ON_TORUS = ("rattle", "lobatto3", "canonical:gauss2", "local:gauss2", "gauss2", "rk4")
ON_PENDULUM = ("rattle", "midpoint", "gauss2", "se", "rk4")

ROUNDED = 1e-12
"""Distance from the surface below which there is only round-off."""

PLANE = np.array([1.0, -1.0, 1.0])
"""The mirror that turns the pendulum's reversed start into the start."""


def fair() -> SimpleNamespace:
    """Return the numbers of both motions; the first sentence that does not hold raises ClaimRefuted."""
    hole = {name: measured(TORUS, name) for name in ON_TORUS}
    swing = {name: measured(PENDULUM, name) for name in ON_PENDULUM}
    check_torus(hole)
    check_pendulum(swing)
    rattle, gauss = hole["rattle"], hole["gauss2"]
    return SimpleNamespace(
        torus={name: run.most for name, run in hole.items()},
        better=rattle.by(BEGUN) / gauss.by(BEGUN),
        crossing=gauss.passes(rattle.most),
        middle=gauss.by(MIDDLE),
        gone=hole["rk4"].t[-1],
        pendulum={name: run.most for name, run in swing.items()},
    )


def check_torus(runs: Mapping[str, Run]) -> None:
    """Require the statements of the lesson on the torus."""
    for name in ("rattle", "lobatto3", "canonical:gauss2"):
        require_level(runs[name], f"{name} on the torus")
    for name in ("gauss2", "local:gauss2"):
        require_lost(runs[name], f"{name} on the torus")
    require(runs["gauss2"].most > runs["rattle"].most, "Gauss on (1.18) passes RATTLE", runs["gauss2"].most)
    require(runs["rattle"].by(BEGUN) > 100 * runs["gauss2"].by(BEGUN), "it begins far below RATTLE", runs["gauss2"].by(BEGUN))
    require(runs["gauss2"].g > 1e3 * ROUNDED > ROUNDED > runs["rattle"].g, "it leaves the torus, RATTLE does not", runs["gauss2"].g)
    law = energy_drift(runs["local:gauss2"].t, runs["local:gauss2"].energy_error).law
    require(law == "linear", "in angles and rates the error grows linearly", law)
    require(runs["rk4"].failure is not None, "RK4 does not reach the end on the torus", runs["rk4"].most)


def check_pendulum(runs: Mapping[str, Run]) -> None:
    """Require the statements of the lesson on the pendulum."""
    ivp = PENDULUM.ivp()
    p0, q0 = np.asarray(ivp.p0), np.asarray(ivp.q0)
    require(np.array_equal(-p0 * PLANE, p0) and np.array_equal(q0 * PLANE, q0), "reversed, the start is its own mirror image", (p0, q0))
    for name in ("rattle", "midpoint", "gauss2"):
        require_level(runs[name], f"{name} on the pendulum")
    require(abs(runs["midpoint"].most / runs["rattle"].most - 1) < 0.01, "midpoint has RATTLE's error", runs["midpoint"].most)
    require(runs["midpoint"].g > ROUNDED > runs["rattle"].g, "midpoint leaves the sphere, RATTLE does not", runs["midpoint"].g)
    for name in ("se", "rk4"):
        require(runs[name].failure is not None, f"{name} does not reach the end on the pendulum", runs[name].most)
