"""Three ways to hold the rod as an animation: pieces of the runs, and their energy errors, for the index of the gallery."""

import json
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from markupsafe import Markup

from daebench.draw.methods import stroke_of
from daebench.draw.orthographic import seen
from daebench.reports.index_reduction.rods import EARLY, T_END, H, Held, envelope
from daebench.reports.index_reduction.rods_figure import BOTTOM, NAMES, REACH, TOP, digits
from daebench.runs.files import atomic

LENGTH = 12.0
"""Length of a piece, units of time."""

SCALE = 1000
"""Positions, lengths and logarithms are written as integers in thousandths."""

FAR = 9.0
"""Points further away are drawn at this distance, outside the picture."""


def write_moving(runs: Mapping[str, Held], facts: SimpleNamespace, path: Path) -> Path:
    """Write the moving picture as a piece of HTML with its own style and script; return its path."""
    from jinja2 import Environment, StrictUndefined

    template = (resources.files("daebench.reports.index_reduction") / "moving.html").read_text(encoding="utf-8")
    said = {"better": digits(facts.better), "gone": f"{facts.gone:.0f}"}
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    text = environment.from_string(template).render(data=Markup(json.dumps(data(runs, facts), separators=(",", ":"))), t_end=T_END, **said)
    with atomic(path) as scratch:
        scratch.write_text(text, encoding="utf-8")
    return path


def data(runs: Mapping[str, Held], facts: SimpleNamespace) -> dict[str, Any]:
    """Return the data of the script."""
    return {
        "scale": SCALE,
        "h": H,
        "x": thousandths(np.log10([H, T_END])),
        "y": thousandths(np.log10([BOTTOM, TOP])),
        "runs": [
            {"name": NAMES[name], "color": stroke_of(name).color, "end": float(run.t[-1]), **curve(run)} for name, run in runs.items()
        ],
        "pieces": [
            {"start": start, "label": f"{label:.0f}", "words": words, "runs": [piece(run, start) for run in runs.values()]}
            for start, label, words in story(runs, facts)
        ],
    }


def story(runs: Mapping[str, Held], facts: SimpleNamespace) -> list[tuple[float, float, str]]:
    """Return the starting times of the pieces, the time that each is about, and a description of each."""
    rk4 = runs["rk4"]
    lost = float(rk4.t[np.flatnonzero(rk4.rod < REACH)[-1]])
    late = T_END / 5
    left = rk4.rod[np.searchsorted(rk4.t, late + LENGTH / 2)]
    return [
        (
            0.0,
            0.0,
            f"The same pendulum, the same step h = {H:g}. RK4 is {digits(facts.better)} times as accurate as RATTLE up to t = {EARLY:g}.",
        ),
        (
            round(facts.crossing - LENGTH / 2),
            facts.crossing,
            f"Symplectic Euler on the index-reduced equation stopped at t = {facts.se_stops:.0f}. "
            f"At t = {facts.crossing:.0f} the energy error of RK4 crosses that of RATTLE.",
        ),
        (late, late, f"The rod of RK4 is {left:.2f} long, and no warning was given."),
        (round(lost - 0.8 * LENGTH), facts.gone, f"RK4 loses the rod, and ends at infinity at t = {facts.gone:.0f}."),
        (T_END - LENGTH, T_END, "RATTLE still holds the rod. Its energy error has not grown."),
    ]


def piece(run: Held, start: float) -> list[list[int]]:
    """Return horizontal and vertical positions and lengths of the rod, step by step, up to the end of the run."""
    first = round(start / H)
    states = run.q[first : first + round(LENGTH / H) + 1]
    if not len(states):
        return [[], [], []]
    rod = run.rod[first : first + len(states)]
    near = np.minimum(1.0, FAR / np.maximum(rod, 1e-12))
    view = seen(states * near[:, None])
    return [thousandths(values) for values in (view[:, 0], view[:, 1], rod * near)]


def curve(run: Held) -> dict[str, list[int]]:
    """Return the logarithms of times and of the largest energy errors up to them."""
    t, error = envelope(run)
    return {
        "t": thousandths(np.log10(t)),
        "error": thousandths(np.log10(np.clip(np.maximum.accumulate(error), BOTTOM / 10, 100 * TOP))),
    }


def thousandths(values: Any) -> list[int]:
    """Return numbers times :data:`SCALE`, rounded."""
    return [int(value) for value in np.round(SCALE * np.asarray(values))]
