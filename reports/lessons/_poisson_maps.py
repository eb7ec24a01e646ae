"""Experiments of the lesson on Poisson maps, and the numbers of its text."""

from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from daebench.draw.figures import BLACK, BLUE, GREEN, VERMILION, Stroke
from daebench.draw.svg.axis import Axis, around
from daebench.draw.svg.marks import Area, Curve, Dots
from daebench.draw.svg.panels import Panel, draw_panels
from daebench.pages.lesson.control import Control, Values
from daebench.pages.lesson.experiment import Experiment, Preparation, Shown
from daebench.pages.report import number
from daebench.pages.report.claims import require
from daebench.reports.lessons._panels import seconds, seen, view
from daebench.reports.lessons._poisson_maps_runs import BY_HAND, Carried, carried, orbit, spun
from daebench.runs.ivp import Array

SCHEMES = {
    BY_HAND: "explicit Euler",
    "rk4": "Runge and Kutta (rk4)",
    "midpoint": "midpoint rule",
    "symplectic_euler_adjoint": "symplectic Euler",
    "strang": "splitting (strang)",
}
STARTS = {"4,2": "(4, 2), HLW Fig. 4.1", "6,2": "(6, 2), HLW Fig. 4.1", "2,2": "(2, 2)"}
BODIES = {
    "strang@123": "splitting into three rotations",
    "strang@top": "splitting, symmetric top",
    "midpoint": "midpoint rule",
    "rk4": "Runge and Kutta (rk4)",
}
SPINS = {"axis3": "about axis 3", "axis1": "about axis 1", "middle": "near the middle axis"}
RUN, EXACT, BEGIN, END = Stroke(BLUE, "-", ""), Stroke(BLACK, (0, (4, 3)), ""), Stroke(GREEN, "-", ""), Stroke(VERMILION, "-", "")
H, T_END, KEPT = 0.05, 10.0, 1e-9


def show_orbits(values: Values) -> Shown:
    """Return orbit, cat, energy error and Poisson volume of a run of predator and prey."""
    run = carried(**values)
    exact = orbit(values["start"])
    time = Axis("t [s]", 0.0, max(float(run.t[-1]), 1e-6))
    volume = np.clip(run.volume, 0.0, 4.0)
    window = (np.vstack([exact, *run.cats[:1]]), np.log(np.vstack([exact, *run.cats[:1]])))
    panels = [
        plane(
            run, exact, around("predators u", window[0][:, 0], [0.0], margin=0.15), around("prey v", window[0][:, 1], [0.0], margin=0.15)
        ),
        logarithms(run, np.log(exact), around("ln u", window[1][:, 0], margin=0.1), around("ln v", window[1][:, 1], margin=0.1)),
        Panel(time, around("H \N{MINUS SIGN} H\N{SUBSCRIPT ZERO}", run.energy, [0.0]), [Curve(run.t, run.energy, RUN)], "energy error"),
        Panel(
            time,
            around("volume / volume at the start", volume, [0.95, 1.05]),
            [Curve(run.t, run.volume, RUN)],
            "Poisson volume along the orbit",
        ),
    ]
    alt = "Orbit of predators and prey with a moving cat, the same in logarithms, energy error and Poisson volume against time."
    return Shown(draw_panels(panels, alt=alt, height=270), orbits_said(run))


def plane(run: Carried, exact: Array, x: Axis, y: Axis) -> Panel:
    """Return the orbit and the cats in the plane of both populations."""
    marks = [Curve(exact[:, 0], exact[:, 1], EXACT, "exact orbit", width=1.0), Curve(run.y[:, 0], run.y[:, 1], RUN, "run", width=0.8)]
    return Panel(x, y, [*marks, *cats(run.cats)], "orbit, and a moving cat")


def logarithms(run: Carried, exact: Array, x: Axis, y: Axis) -> Panel:
    """Return the cats in coordinates in which their Poisson volume is plain area."""
    return Panel(
        x,
        y,
        [Curve(exact[:, 0], exact[:, 1], EXACT, width=1.0), *cats([np.log(outline) for outline in run.cats])],
        "in logarithms: volume is area",
    )


def cats(outlines: list[Array]) -> list[Area]:
    """Return the cat at the start and at later times."""
    named = ["the cat at the start", *["carried along"] * (len(outlines) - 1)]
    return [Area(outline[:, 0], outline[:, 1], BEGIN if k == 0 else END, named[k]) for k, outline in enumerate(outlines)]


def orbits_said(run: Carried) -> Markup:
    """Return sentences on the result of a run."""
    fate = "kept to round-off" if np.max(np.abs(run.volume - 1)) < KEPT else "not kept"
    says = Markup("After {:g} s the Poisson volume along the orbit is <b>{}</b> of that at the start: {}. Energy error {}.").format(
        run.t[-1], number(run.volume[-1], 4), fate, number(run.energy[-1])
    )
    if np.isfinite(run.share) and len(run.t) > 1:
        says += Markup(" The cat has {} of its volume.").format(number(run.share, 4))
    return says + (Markup(" It {}").format(run.failure[run.failure.index("stopped") :]) if run.failure else Markup(""))


def table_orbits(values: Values) -> pd.DataFrame:
    """Return the numbers behind the picture, one row per state."""
    run = carried(**values)
    return pd.DataFrame({"t": run.t, "u": run.y[:, 0], "v": run.y[:, 1], "energy_error": run.energy, "volume": run.volume})


def show_body(values: Values) -> Shown:
    """Return states of the rigid body on, or off, its sphere, and the errors of Casimir function and energy."""
    run = spun(**values)
    at = seen(run.y)
    dots = [
        Dots(at[shown, 0], at[shown, 1], Stroke(color, "-", ""), radius=1.3)
        for shown, color in ((at[:, 2] < 0, "#9aa7b4"), (at[:, 2] >= 0, BLUE))
    ]
    time = Axis("t [s]", 0.0, float(run.t[-1]))
    low = 1e-17
    errors = [np.maximum(np.abs(error), low) for error in (run.casimir, run.energy)]
    axis = around("error", [1e-17, 1.0], log=True)
    curves = [
        Curve(run.t, error, stroke, name, width=1.0)
        for error, stroke, name in zip(errors, (RUN, END), ("Casimir function C", "energy H"), strict=True)
    ]
    says = Markup(
        "Largest error of the Casimir function <i>C</i> = |<i>y</i>|<sup>2</sup>/2: <b>{}</b>; of the energy: {}. "
        "At the end |<i>y</i>| = {:.4f}."
    ).format(number(np.max(np.abs(run.casimir))), number(np.max(np.abs(run.energy))), float(np.linalg.norm(run.y[-1])))
    alt = "States of the rigid body on the sphere of constant angular momentum, and errors of Casimir function and energy against time."
    return Shown(
        draw_panels(
            [view([*dots], "angular momentum, seen from the body"), Panel(time, axis, curves, "what is kept")], alt=alt, height=300
        ),
        says,
    )


def table_body(values: Values) -> pd.DataFrame:
    """Return the numbers behind the picture, one row per state."""
    run = spun(**values)
    return pd.DataFrame(
        {"t": run.t, "y1": run.y[:, 0], "y2": run.y[:, 1], "y3": run.y[:, 2], "energy_error": run.energy, "C_error": run.casimir}
    )


ORBITS = Experiment(
    name="orbits",
    title="Predator and prey, and a cat",
    controls=(
        Control("scheme", "method", tuple(SCHEMES), BY_HAND, tuple(SCHEMES), SCHEMES.__getitem__),
        Control("h", "step size h", (0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4), H, (0.05, 0.1, 0.25, 0.4), seconds),
        Control("t_end", "length of the run", (1.0, 2.0, 5.0, 10.0, 15.0, 20.0), T_END, (), seconds),
        Control("start", "start (u, v)", tuple(STARTS), "4,2", (), STARTS.__getitem__),
    ),
    show=show_orbits,
    table=table_orbits,
)
BODY = Experiment(
    name="body",
    title="The rigid body on its sphere",
    controls=(
        Control("scheme", "method", tuple(BODIES), "rk4", tuple(BODIES), BODIES.__getitem__),
        Control("h", "step size h", (0.1, 0.2, 0.5, 1.0, 1.5, 2.0), 1.0, (0.5, 1.0, 2.0), seconds),
        Control("start", "start", tuple(SPINS), "axis3", tuple(SPINS), SPINS.__getitem__),
        Control("steps", "steps", (100, 200, 400, 800, 1600), 400),
    ),
    show=show_body,
    table=table_body,
)
EXPERIMENTS = (ORBITS, BODY)


def thumbnail(axis: Any) -> None:
    """Draw a cat that a Poisson map carries round an orbit: where it begins, and where it comes to."""
    run = carried("strang", "4,2", H, T_END / 4)
    axis.plot(*orbit("4,2").T, color=EXACT.color, linewidth=0.8)
    for k, outline in enumerate(run.cats):
        axis.fill(*outline.T, color=END.color if k else BEGIN.color, linewidth=0)
    axis.set(
        xscale="log", yscale="log", xticks=[0.1, 1, 4], yticks=[0.5, 2, 5], xticklabels=["0.1", "1", "4"], yticklabels=["0.5", "2", "5"]
    )
    axis.minorticks_off()
    axis.set_xlabel("predators", loc="right")
    axis.set_ylabel("prey", loc="top")
    axis.set_title("a cat keeps its Poisson volume", loc="left")


def preparations() -> list[Preparation]:
    """Return the kernels that have to be compiled before the controls respond."""
    plane: list[Preparation] = [(f"compiling {name}", partial(carried, name, "4,2", H, H)) for name in SCHEMES]
    plane += [(f"orbit from {start}", partial(orbit, start)) for start in STARTS]
    return plane + [(f"compiling {name} for the body", partial(spun, name, "axis3", 1.0, 2)) for name in BODIES]


def facts() -> SimpleNamespace:
    """Return the numbers of the text; the first sentence that does not hold raises ClaimRefuted."""
    runs = {name: carried(name, "4,2", H, T_END) for name in SCHEMES}
    change = {name: float(np.max(np.abs(run.volume - 1))) for name, run in runs.items()}
    share = {name: run.share for name, run in runs.items()}
    body = {name: spun(name, "axis3", 1.0, 400) for name in BODIES}
    casimir = {name: float(np.max(np.abs(run.casimir))) for name, run in body.items()}
    energy = {name: float(np.max(np.abs(run.energy))) for name, run in body.items()}
    require(max(change["symplectic_euler_adjoint"], change["strang"]) < KEPT, "symplectic Euler and the splitting keep the volume", change)
    kept = max(abs(share[name] - 1) for name in ("symplectic_euler_adjoint", "strang"))
    require(kept < KEPT, "the cat keeps its volume with symplectic Euler and the splitting", share)
    require(min(change[BY_HAND], change["rk4"], change["midpoint"]) > 1e3 * KEPT, "the others do not", change)
    require(runs[BY_HAND].energy[-1] > 1, "explicit Euler spirals outwards", runs[BY_HAND].energy[-1])
    require(change["rk4"] < 0.1 * change["midpoint"], "rk4 changes the volume less than the midpoint rule", change)
    require(
        casimir["rk4"] > 1e-6 > 1e-12 > max(casimir["strang@123"], casimir["strang@top"], casimir["midpoint"]),
        "only rk4 leaves the sphere",
        casimir,
    )
    require(
        energy["midpoint"] < 1e-12 < energy["strang@123"], "the midpoint rule keeps the energy of the body, the splitting does not", energy
    )
    return SimpleNamespace(runs=runs, change=change, share=share, casimir=casimir, energy=energy, h=H, t_end=T_END)
