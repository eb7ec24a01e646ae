"""Where methods break: a mechanism that locks, a stiff spring, sums over very many steps, and two pendulums with nearly equal starts."""

from typing import Any

import numpy as np

from daebench.diagnostics.branch import WRONG
from daebench.diagnostics.manifold import residual_scales
from daebench.draw.methods import name_of, stroke_of
from daebench.methods.fixed_step.reasons import REASONS
from daebench.methods.fixed_step.script import Script, numbers, script, script_of_functions
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.pages.lesson.page import Content
from daebench.pages.report import Progress
from daebench.runs.ivp import ConstrainedIvp
from daebench.runs.make_ivp import constrained
from daebench.runs.request import Request
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

SUMMED, MANY = 0.01, 200_000
"""Step size of the sums in the text, s, and the steps that they take."""

STEP_SIZES = {
    "lock": (0.001, 0.002, 0.005, 0.01),
    "stiff": (0.001, 0.002, 0.005, 0.01),
    "rounding": (0.001, 0.01, 0.1),
    "chaos": (0.002, 0.005, 0.01),
}
"""Step sizes that the other screens offer, s."""

T_END, CHAOS_END, PARTED = 3.0, 40.0, 0.1
"""End of the runs of the mechanism and of the spring, and of two pendulums, s; distance at which these count as separated, m."""

CRANKS, RODS, NEARLY = ("rattle", "rk4"), (2.0, 1.5, 1.2, 1.1, 1.03, 1.01, 1.003, 1.001, 1.0), 1.001
"""Methods for the mechanism that locks, and lengths of its rod, in cranks; the one that nearly locks it."""

SPRINGS, EPS, TIGHT = ("stiff:rk4", "stiff:midpoint"), (0.1, 0.03, 0.01, 0.003, 0.001, 0.0003, 0.0001), 0.001
"""Methods for the spring, and how soft it is; the one that the text speaks of."""

SUMS = {False: "plain sums", True: "compensated sums"}
PENDULUMS = ("rattle", "lobatto3")
"""Methods for two pendulums that are released nearly alike."""


def mapped_ivp(gravity: float = 1.0) -> ConstrainedIvp:
    """Return the pendulum of the maps: horizontal, pushed sideways."""
    q0, p0 = (1.0, 0.0, 0.0), (0.0, SPEED, 0.0)
    return constrained(initial_value_problem("spherical_pendulum", "fig1.1", {"gravity": gravity}, q0=q0, p0=p0))


def content(tell: Progress) -> Content:
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
        "The extremes",
        scripts=scripts | lock_scripts | stiff_scripts | rounding_scripts | chaos_scripts,
        functions=f"{{{functions}}}",
        data=data,
        text=_text(names, colours),
    )


def _text(names: dict[str, str], colours: dict[str, str]) -> dict[str, Any]:
    """Return the values that the template names."""
    last = {"side": SIDE - 1, "rods": len(RODS) - 1, "eps": len(EPS) - 1}
    numbers_of_text = {"h": H, "delta": DELTA, "summed": SUMMED, "nearly": NEARLY, "tight": TIGHT, "finest": EPS[-1]}
    words = {"mapped": MAPPED, "names": names, "heads": HEADS, "colours": colours, "outcomes": outcomes.OUTCOMES}
    return {**words, **numbers_of_text, "last": last}


def statuses() -> dict[int, str]:
    """Return the word for the outcome of a run by the status with which its kernel stops."""
    words = {status: outcomes.word_of(reason) for status, (reason, _) in REASONS.items()}
    return words | {RANK_LOST: outcomes.SINGULAR}  # G = 2 q^T of a pendulum keeps its rank: the watch of pivots sees too large a step


def _map(ivp: ConstrainedIvp) -> dict[str, Any]:
    """Return the data of the maps."""
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
    """Return the data of the screen of the mechanism, and its kernels."""
    methods = {name: parse(name) for name in CRANKS}
    scripts = {f"crank {name}": script(method, _crank(1.1), H, watch=("energy",), rank=True) for name, method in methods.items()}
    rods = {rod: {name: numbers(method, _crank(rod), H) for name, method in methods.items()} for rod in RODS}
    data = {"rods": list(RODS), "runs": list(rods.values()), "methods": list(methods), "end": T_END, "h": list(STEP_SIZES["lock"])}
    return data | {"step": H, "nearly": RODS.index(NEARLY)}, scripts


def _stiff() -> tuple[dict[str, Any], dict[str, Script]]:
    """Return the data of the screen of the spring, and its kernels."""
    ivp = initial_value_problem("spherical_pendulum", "fig1.2")
    scripts = {name: script(parse(name, {"eps": 0.01}), ivp, H) for name in SPRINGS}
    springs = [{name: numbers(parse(name, {"eps": eps}), ivp, H) for name in SPRINGS} for eps in EPS]
    data = {
        "eps": list(EPS),
        "runs": springs,
        "methods": list(SPRINGS),
        "tight": TIGHT,
        "end": T_END,
        "h": list(STEP_SIZES["stiff"]),
        "step": H,
    }
    return data, scripts | {"held": script(parse("lobatto3"), ivp, H)}


def _rounding() -> tuple[dict[str, Any], dict[str, Script]]:
    """Return the data of the screen of the long sum, and its kernels."""
    ivp = initial_value_problem("spherical_pendulum", "fig1.1")
    scripts = {name: script(parse("rattle", compensated=compensated), ivp, H) for compensated, name in SUMS.items()}
    return {"names": list(SUMS.values()), "many": MANY, "h": list(STEP_SIZES["rounding"]), "step": SUMMED}, scripts


def _chaos() -> tuple[dict[str, Any], dict[str, Script]]:
    """Return the data of the screen of the two pendulums, and its kernels."""
    ivp = initial_value_problem("double_pendulum", "horizontal")
    scripts = {f"arms {name}": script(parse(name), ivp, H) for name in PENDULUMS}
    return {
        "methods": list(PENDULUMS),
        "parted": PARTED,
        "end": CHAOS_END,
        "h": list(STEP_SIZES["chaos"]),
        "step": H,
        "delta": DELTA,
    }, scripts


def thumbnail(axis: Any) -> None:
    """Draw how two double pendulums separate that are released nearly alike."""
    paths = []
    for angle in (0.0, 10.0**-DELTA):
        c, s = float(np.cos(angle)), float(np.sin(angle))
        ivp = initial_value_problem("double_pendulum", "horizontal", q0=(c, -s, 2 * c, -2 * s), p0=(0.0,) * 4)
        paths.append(parse("rattle").solve(ivp, Request(value=H, t_end=CHAOS_END, every=10, watch=())))
    distance = np.linalg.norm(paths[1].q[:, 2:] - paths[0].q[:, 2:], axis=1)
    axis.plot(paths[0].t[1:], distance[1:], color=stroke_of("rattle").color, linewidth=1.2)
    axis.set(yscale="log")
    axis.minorticks_off()
    axis.set_xlabel("time  [s]", loc="right")
    axis.set_ylabel("distance  [m]")
    axis.set_title(f"released 1e-{DELTA} rad apart", loc="left")
