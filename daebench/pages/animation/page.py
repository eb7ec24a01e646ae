"""An animation as one HTML page that needs no other file: it plays, stops, and goes to any time."""

import base64
import json
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from daebench.diagnostics.along import LABELS
from daebench.draw.methods import name_of
from daebench.draw.scene import END, ZIGZAG
from daebench.draw.svg.marks import Curve
from daebench.draw.svg.panels import draw_panels, sample
from daebench.pages.animation.animated_runs import AnimatedRuns
from daebench.pages.animation.panels import GRAPH, SCENE, graph_panel, scene_panel
from daebench.runs.files import atomic
from daebench.runs.trajectory import Array
from daebench.systems.lazily import jinja2

SCALE = 50
"""Steps to a pixel in which places are kept, as whole numbers of 16 bits."""

MISSING = -32768
"""What stands for a place that is not finite."""

MOST_BYTES = 1_500_000
"""Most bytes of places and errors, about."""

MOST_FRAMES = 20_000
"""Most frames of a page."""


def most_frames(points: int, runs: int, columns: int) -> int:
    """Return how many frames a page may have that shows so many points of so many methods, and so many errors."""
    return min(MOST_FRAMES, int(MOST_BYTES / (runs * 4 / 3 * (4 * points + 2 + 4 * columns))))


def write(path: Path, animated: AnimatedRuns) -> None:
    """Write an animation as a page."""
    folder = Path(str(resources.files("daebench.pages.animation")))
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(folder), autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    style = _text("daebench.pages.animation", "page.css") + _text("daebench.draw.svg", "panels.css")
    text = environment.get_template("page.html").render(
        animated=animated,
        labels=LABELS,
        bare=animated.layout.dimension == 3,
        scenes=[_scene(animated, k) for k in range(len(animated.runs))],
        graphs=[_graph(animated, column) for column in animated.columns],
        data=Markup(json.dumps(data(animated), separators=(",", ":"))),
        style=Markup(style),
        script=Markup(_text("daebench.pages.animation", "player.js")),
    )
    with atomic(path) as scratch:
        scratch.write_text(text, encoding="utf-8")


def data(animated: AnimatedRuns) -> dict[str, Any]:
    """Return the data of the page's script."""
    return {
        "frames": len(animated.times),
        "fps": animated.fps,
        "step": float(animated.times[1]),
        "trail": animated.trail,
        "scale": SCALE,
        "points": animated.flat[0].shape[1],
        "rods": animated.layout.rods,
        "masses": animated.layout.masses,
        "springs": animated.layout.springs,
        "dampers": animated.layout.dampers,
        "zigzag": {"corners": ZIGZAG, "end": END, "amplitude": _amplitude(animated)},
        "trails": animated.trails,
        "runs": [_run(animated, k) for k in range(len(animated.runs))],
    }


def _run(animated: AnimatedRuns, k: int) -> dict[str, Any]:
    run = animated.runs[k]
    return {
        "shown": _coded(run.shown(animated.times).astype("<i2")),
        "points": _coded(places(animated, k).astype("<i2")),
        "errors": {name: _coded(run.errors[name].astype("<f4")) for name in animated.columns if name in run.errors},
        "end": float(run.t[-1]),
        "failed": run.failure is not None,
    }


def _amplitude(animated: AnimatedRuns) -> float:
    """Return half the width of springs in pixels of a scene."""
    x, _ = scene_panel(animated, 0).frame(0, 0, *SCENE)(np.array([0.0, animated.amplitude]), np.zeros(2))
    return round(float(x[1] - x[0]), 2)


def places(animated: AnimatedRuns, k: int) -> Array:
    """Return the points of a run in pixels of its scene times :data:`SCALE`, rounded, shape(n, k, 2)."""
    flat = animated.flat[k]
    pixels = SCALE * np.stack(scene_panel(animated, k).frame(0, 0, *SCENE)(flat[..., 0], flat[..., 1]), axis=-1)
    there = np.isfinite(pixels).all(axis=-1, keepdims=True)
    return np.where(there, np.clip(np.nan_to_num(np.round(pixels)), MISSING + 1, -MISSING - 1), MISSING)


def _scene(animated: AnimatedRuns, k: int) -> dict[str, Any]:
    run = animated.runs[k]
    line = Curve([], [], animated.stroke(k), width=2.2)
    svg = draw_panels(
        [scene_panel(animated, k)], alt=f"{animated.problem} with {name_of(run.method)}", columns=1, width=SCENE[0], height=SCENE[1]
    )
    return {"run": run, "name": name_of(run.method), "leaves": animated.leaves(k), "sample": sample(line, 2, 4), "svg": svg}


def _graph(animated: AnimatedRuns, column: str) -> Markup:
    alt = f"{LABELS[column]} over time with {', '.join(name_of(run.method) for run in animated.runs)}"
    return draw_panels([graph_panel(animated, column)], alt=alt, columns=1, width=GRAPH[0], height=GRAPH[1])


def _coded(values: Any) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")


def _text(package: str, name: str) -> str:
    return (resources.files(package) / name).read_text(encoding="utf-8")
