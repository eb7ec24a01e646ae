"""The live page of the lesson on extremes: the kernels that it runs, and the bounds and words by which it judges runs."""

from typing import Any

import numpy as np

from daebench.diagnostics.branch import WRONG
from daebench.diagnostics.manifold import residual_scales
from daebench.draw.methods import name_of, stroke_of
from daebench.methods.fixed_step.script import Script, numbers, script, script_of_functions
from daebench.methods.fixed_step.stepping import REASONS
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.pages.lesson.control import defaults
from daebench.pages.lesson.experiment import Experiment
from daebench.pages.lesson.live_page import Content
from daebench.reports.lessons import _extremes as lesson
from daebench.reports.lessons._extremes_runs import PARTED, T_END
from daebench.reports.lessons._extremes_runs import SIDE as SIDE_OF_RELEASES
from daebench.runs.ivp import ConstrainedIvp
from daebench.runs.make_ivp import constrained
from daebench.schemes.kernels.rank import RANK_LOST
from daebench.studies.grid import outcomes
from daebench.studies.stability.outcome_map import COLOURS, SIZE_COLOURS, SIZES

MAPPED = ("rattle", "se", "se+proj", "rk4")
"""Methods that are mapped."""

LABELS = {"se": "symplectic Euler", "se+proj": "symplectic Euler, projected"}

HEADS = {
    "rattle": ("RATTLE", "constrained equations"),
    "se": ("symplectic Euler", "reduced equations"),
    "se+proj": ("symplectic Euler", "reduced, projected"),
    "rk4": ("RK4", "reduced equations"),
}
"""What stands under a map: the method, and the equations that it is applied to."""

SPEED, END = 0.3, 10.0
"""Speed at the start of the mapped runs, m/s, and their end, s."""

SIDE = 64
"""Step sizes, and values of gravity, of a map."""

STEPS = tuple(map(float, np.geomspace(0.01, 1.0, SIDE)))
"""Step sizes of a map, s."""

GRAVITIES = tuple(map(float, np.geomspace(0.1, 100.0, SIDE)))
"""Gravities of a map, m/s^2."""

HATCHES = {
    outcomes.OFF: ("/", "#000"),
    outcomes.OTHER: (".", "#fff"),
    outcomes.NO_SOLUTION: ("\\", "#0b3a5a"),
    outcomes.SINGULAR: ("|", "#000"),
    outcomes.RANK_LOST: ("-", "#fff"),
    outcomes.BLOWN_UP: ("x", "#fff"),
    outcomes.STOPPED: (".", "#000"),
}
"""Hatch of each outcome that has no size, and its ink."""

WORDS = {"fine": outcomes.FINE, "coarse": outcomes.COARSE, "lost": outcomes.LOST, "off": outcomes.OFF, "other": outcomes.OTHER}
"""Outcomes of runs that come to their end, by the names that the page has for them."""

H = 0.005
"""Step size of the kernels of the other screens where nothing else is said, s."""

DELTA = 9
"""Difference of the two releases that the page begins with, as a negative power of ten, rad."""

SUMMED = 0.01
"""Step size of the sums in the text, s."""


def mapped_ivp(gravity: float = 1.0) -> ConstrainedIvp:
    """Return the pendulum of the maps: horizontal, pushed sideways."""
    q0, p0 = (1.0, 0.0, 0.0), (0.0, SPEED, 0.0)
    return constrained(initial_value_problem("spherical_pendulum", "fig1.1", {"gravity": gravity}, q0=q0, p0=p0))


def content() -> Content:
    """Return the content of the page, which computes the numbers of its sentences itself."""
    ivp = mapped_ivp()
    scripts = {name: script(parse(name), ivp, STEPS[0], watch=("energy", "manifold"), rank=True) for name in MAPPED}
    lock, lock_scripts = _lock()
    stiff, stiff_scripts = _stiff()
    rounding, rounding_scripts = _rounding()
    chaos, chaos_scripts = _chaos()
    names = {name: LABELS.get(name, name_of(name)) for name in (*MAPPED, "lobatto3")}
    names |= {"stiff:rk4": "RK4", "stiff:midpoint": "midpoint rule"}
    colours = {name: stroke_of(name).color for name in names}
    problems = {"pendulum": ivp, "crank": _crank(1.1), "arms": initial_value_problem("double_pendulum", "horizontal")}
    wanted = {"pendulum": ["H", "H_p", "H_q", "g"], "crank": ["H", "G"], "arms": ["H"]}
    functions = ",".join(f"{key}:{script_of_functions(problem, wanted[key])}" for key, problem in problems.items())
    data = {"map": _map(ivp), "lock": lock, "stiff": stiff, "rounding": rounding, "chaos": chaos, "names": names, "colours": colours}
    return Content(
        scripts=scripts | lock_scripts | stiff_scripts | rounding_scripts | chaos_scripts,
        functions=f"{{{functions}}}",
        data=data,
        text=_text(names, colours),
    )


def _text(names: dict[str, str], colours: dict[str, str]) -> dict[str, Any]:
    """Return what the template names."""
    last = {"side": SIDE - 1, "rods": len(lesson.RODS) - 1, "eps": len(lesson.EPS) - 1}
    numbers_of_text = {"h": H, "delta": DELTA, "summed": SUMMED, "nearly": lesson.NEARLY, "tight": lesson.TIGHT, "finest": lesson.EPS[-1]}
    words = {"mapped": MAPPED, "names": names, "heads": HEADS, "colours": colours, "outcomes": outcomes.OUTCOMES}
    return {**words, **numbers_of_text, "last": last, "releases": SIDE_OF_RELEASES**2}


def _values(experiment: Experiment, name: str) -> list[Any]:
    """Return the values of a control of the notebook."""
    return next(list(control.values) for control in experiment.controls if control.name == name)


def statuses() -> dict[int, str]:
    """Return the word for the outcome of a run by the status with which its kernel stops."""
    told = {status: outcomes.word_of(reason) for status, (reason, _) in REASONS.items()}
    return told | {RANK_LOST: outcomes.SINGULAR}  # G = 2 q^T of a pendulum keeps its rank: the watch of pivots sees too large a step


def _map(ivp: ConstrainedIvp) -> dict[str, Any]:
    """Return what the maps need."""
    return {
        "methods": list(MAPPED),
        "start": [*map(float, ivp.p0), *map(float, ivp.q0)],
        "h": list(STEPS),
        "steps": [round(END / h) for h in STEPS],
        "gravities": list(GRAVITIES),
        "gravity": list(ivp.facts.PARAMETERS).index("gravity"),
        "mass": ivp.parameters["mass"],
        "length": ivp.parameters["length"],
        "end": END,
        "words": WORDS,
        "sized": list(outcomes.SIZED),
        "about": outcomes.OUTCOMES,
        "statuses": statuses(),
        "stopped": outcomes.STOPPED,
        "rank_lost": RANK_LOST,
        "no_solution": outcomes.NO_SOLUTION,
        "off": outcomes.FAR * residual_scales(ivp, ivp.p0, ivp.q0)[0],
        "jump": WRONG,
        "large": outcomes.LARGE,
        "all": outcomes.ALL,
        "sizes": list(SIZES),
        "size_colours": list(SIZE_COLOURS),
        "colours": COLOURS,
        "hatches": HATCHES,
    }


def _crank(rod: float) -> Any:
    return initial_value_problem("slider_crank", "turning", {"rod": rod})


def _lock() -> tuple[dict[str, Any], dict[str, Script]]:
    """Return what the screen of the mechanism needs, and its kernels."""
    methods = {name: parse(name) for name in lesson.CRANKS}
    scripts = {f"crank {name}": script(method, _crank(1.1), H, watch=("energy",), rank=True) for name, method in methods.items()}
    rods = {rod: {name: numbers(method, _crank(rod), H) for name, method in methods.items()} for rod in lesson.RODS}
    data = {"rods": list(lesson.RODS), "runs": list(rods.values()), "methods": list(methods), "end": T_END, "h": _values(lesson.LOCK, "h")}
    return data | {"step": H, "nearly": lesson.RODS.index(lesson.NEARLY)}, scripts


def _stiff() -> tuple[dict[str, Any], dict[str, Script]]:
    """Return what the screen of the spring needs, and its kernels."""
    ivp = initial_value_problem("spherical_pendulum", "fig1.2")
    scripts = {name: script(parse(name, {"eps": 0.01}), ivp, H) for name in lesson.SPRINGS}
    springs = [{name: numbers(parse(name, {"eps": eps}), ivp, H) for name in lesson.SPRINGS} for eps in lesson.EPS]
    data = {
        "eps": list(lesson.EPS),
        "runs": springs,
        "methods": list(lesson.SPRINGS),
        "tight": lesson.TIGHT,
        "end": T_END,
        "h": _values(lesson.STIFF, "h"),
        "step": H,
    }
    return data, scripts | {"held": script(parse("lobatto3"), ivp, H)}


def _rounding() -> tuple[dict[str, Any], dict[str, Script]]:
    """Return what the screen of the long sum needs, and its kernels."""
    ivp = initial_value_problem("spherical_pendulum", "fig1.1")
    scripts = {name: script(parse("rattle", compensated=compensated), ivp, H) for compensated, name in lesson.SUMS.items()}
    return {"names": list(lesson.SUMS.values()), "many": lesson.MANY, "h": _values(lesson.ROUNDING, "h"), "step": SUMMED}, scripts


def _chaos() -> tuple[dict[str, Any], dict[str, Script]]:
    """Return what the screen of the two pendulums needs, and its kernels."""
    ivp = initial_value_problem("double_pendulum", "horizontal")
    scripts = {f"arms {name}": script(parse(name), ivp, H) for name in lesson.PENDULUMS}
    return {
        "methods": list(lesson.PENDULUMS),
        "parted": PARTED,
        "end": defaults(lesson.CHAOS.controls)["t_end"],
        "h": _values(lesson.CHAOS, "h"),
        "step": H,
        "delta": DELTA,
    }, scripts
