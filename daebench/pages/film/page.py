"""An animation as one HTML page that needs no other file: it plays, stops, and goes to any time."""

import base64
import json
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from daebench.draw.svg.marks import Curve
from daebench.draw.svg.panels import Frame, sample, sheet
from daebench.pages.film.panels import GRAPH, SCENE, graph_panel, scene_panel
from daebench.pages.film.reel import Reel
from daebench.runs.files import atomic
from daebench.runs.trajectory import Array
from daebench.studies.comparison.table import LABELS

SCALE = 50
"""Steps to a pixel in which places are kept, as whole numbers of 16 bits."""

MISSING = -32768
"""What stands for a place that is not finite."""

MOST_BYTES = 1_500_000
"""Most bytes of places and errors, about."""

MOST_FRAMES = 20_000
"""Most frames of a page."""


def most_frames(points: int, takes: int, columns: int) -> int:
    """Return how many frames a page may have that shows so many points of so many methods, and so many errors."""
    return min(MOST_FRAMES, int(MOST_BYTES / (takes * 4 / 3 * (4 * points + 2 + 4 * columns))))


def write(path: Path, reel: Reel) -> None:
    """Write an animation as a page."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    folder = Path(str(resources.files("daebench.pages.film")))
    environment = Environment(
        loader=FileSystemLoader(folder), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    style = _text("daebench.pages.film", "page.css") + _text("daebench.draw.svg", "panels.css")
    text = environment.get_template("page.html").render(
        reel=reel,
        labels=LABELS,
        bare=reel.layout.dimension == 3,
        scenes=[_scene(reel, k) for k in range(len(reel.takes))],
        graphs=[_graph(reel, column) for column in reel.columns],
        data=Markup(json.dumps(data(reel), separators=(",", ":"))),
        style=Markup(style),
        script=Markup(_text("daebench.pages.film", "player.js")),
    )
    with atomic(path) as scratch:
        scratch.write_text(text, encoding="utf-8")


def data(reel: Reel) -> dict[str, Any]:
    """Return what the script of the page is given."""
    return {
        "frames": len(reel.times),
        "fps": reel.fps,
        "step": float(reel.times[1]),
        "trail": reel.trail,
        "scale": SCALE,
        "points": reel.flat[0].shape[1],
        "rods": reel.layout.rods,
        "masses": reel.layout.masses,
        "trails": reel.trails,
        "takes": [_take(reel, k) for k in range(len(reel.takes))],
    }


def _take(reel: Reel, k: int) -> dict[str, Any]:
    take = reel.takes[k]
    return {
        "shown": _coded(take.shown(reel.times).astype("<i2")),
        "points": _coded(places(reel, k).astype("<i2")),
        "errors": {name: _coded(take.errors[name].astype("<f4")) for name in reel.columns if name in take.errors},
        "end": float(take.t[-1]),
        "failed": take.failure is not None,
    }


def places(reel: Reel, k: int) -> Array:
    """Return the points of a take in pixels of its scene times :data:`SCALE`, rounded, shape(n, k, 2)."""
    flat = reel.flat[k]
    pixels = SCALE * np.stack(scene_frame(reel, k)(flat[..., 0], flat[..., 1]), axis=-1)
    there = np.isfinite(pixels).all(axis=-1, keepdims=True)
    return np.where(there, np.clip(np.nan_to_num(np.round(pixels)), MISSING + 1, -MISSING - 1), MISSING)


def scene_frame(reel: Reel, k: int) -> Frame:
    """Return where the axes of a scene are in its drawing."""
    return scene_panel(reel, k).frame(0, 0, *SCENE)


def _scene(reel: Reel, k: int) -> dict[str, Any]:
    take = reel.takes[k]
    line = Curve([], [], reel.stroke(k), width=2.2)
    svg = sheet([scene_panel(reel, k)], alt=f"{reel.problem} with {take.method}", columns=1, width=SCENE[0], height=SCENE[1])
    return {"take": take, "leaves": reel.leaves(k), "sample": sample(line, 2, 4), "svg": svg}


def _graph(reel: Reel, column: str) -> Markup:
    alt = f"{LABELS[column]} over time with {', '.join(take.method for take in reel.takes)}"
    return sheet([graph_panel(reel, column)], alt=alt, columns=1, width=GRAPH[0], height=GRAPH[1])


def _coded(values: Any) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")


def _text(package: str, name: str) -> str:
    return (resources.files(package) / name).read_text(encoding="utf-8")
