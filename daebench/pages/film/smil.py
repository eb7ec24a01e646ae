"""An animation as one SVG that moves by itself: for a page or a slide, without any script."""

from importlib import resources
from pathlib import Path

import numpy as np
from markupsafe import Markup

from daebench.draw.svg.marks import Curve
from daebench.draw.svg.panels import Frame, panel_svg, sample
from daebench.pages.film.panels import GRAPH, SCENE, graph_panel, lines_at, path_of_lines, scene_panel
from daebench.pages.film.reel import Reel
from daebench.runs.files import atomic

MOST_BYTES = 3_000_000
"""Most bytes of what moves, about."""

MOST_FRAMES = 1500
"""Most frames of a drawing."""

HEAD = 42.0
"""Height of the lines above the scenes, pixels."""

PAPER = """
svg.sheet { color: #1d1d1f; background: #fffffd; }
@media (prefers-color-scheme: dark) { svg.sheet { color: #e4e4e0; background: #191a1c; } }
.cursor { stroke: currentColor; fill: none; }
"""


def most_frames(points: int, takes: int, columns: int) -> int:
    """Return how many frames a drawing may have that shows so many points of so many methods; a point takes some dozen bytes."""
    del columns
    return min(MOST_FRAMES, int(MOST_BYTES / (takes * 12 * (points + 50))))


def write(path: Path, reel: Reel) -> None:
    """Write an animation as a drawing: scenes in columns, the curves below them."""
    width = max(SCENE[0] * len(reel.takes), GRAPH[0])
    columns = max(1, min(len(reel.columns), int(width / SCENE[0])))
    top = HEAD + SCENE[1]
    scenes = [_scene(reel, k) for k in range(len(reel.takes))]
    graphs = [
        _graph(reel, column, ((n % columns) * width / columns, top + (n // columns) * GRAPH[1]), width / columns)
        for n, column in enumerate(reel.columns)
    ]
    height = top + GRAPH[1] * -(-len(reel.columns) // columns)
    style = (resources.files("daebench.draw.svg") / "panels.css").read_text(encoding="utf-8") + PAPER
    name = f"{reel.problem}, case {reel.case}"
    text = Markup(
        '<svg class="sheet" xmlns="http://www.w3.org/2000/svg" width="{:g}" height="{:g}" viewBox="0 0 {:g} {:g}" role="img" '
        'aria-label="{}">'
        '<style>{}</style><text class="title" x="12" y="16">{}</text><text x="12" y="33">{}</text>{}{}</svg>'
    ).format(width, height, width, height, name, Markup(style), name, reel.pace, Markup("").join(scenes), Markup("").join(graphs))
    with atomic(path) as scratch:
        scratch.write_text(text, encoding="utf-8")


def _scene(reel: Reel, k: int) -> Markup:
    """Return a scene whose parts move, under the name of its method and, where it stopped, when."""
    take, left = reel.takes[k], SCENE[0] * k
    frame = scene_panel(reel, k).frame(left, HEAD, *SCENE)
    texts: dict[str, list[str]] = {}
    for state in take.shown(reel.times):
        for kind, lines in lines_at(reel, k, int(state)).items():
            texts.setdefault(kind, []).append(path_of_lines(lines, frame))
    inside = {kind: _animated(values, reel.seconds) for kind, values in texts.items()}
    line = sample(Curve([], [], reel.stroke(k), width=2.2), frame.left + frame.width - 40, HEAD + 13)
    return panel_svg(scene_panel(reel, k, inside, title=take.method + reel.end_of(k)), frame) + line


def _animated(values: list[str], seconds: float) -> Markup:
    """Return the element that makes a path go through these shapes, over and over; nothing where it stays."""
    if len(set(values)) < 2:
        return Markup("")
    form = '<animate attributeName="d" dur="{:g}s" repeatCount="indefinite" calcMode="discrete" values="{}"/>'
    return Markup(form).format(seconds, ";".join(values))


def _graph(reel: Reel, column: str, corner: tuple[float, float], width: float) -> Markup:
    panel = graph_panel(reel, column)
    frame = panel.frame(*corner, width, GRAPH[1])
    return panel_svg(panel, frame) + _cursor(frame, reel)


def _cursor(frame: Frame, reel: Reel) -> Markup:
    """Return the line that goes along with time."""
    shares = ";".join(f"{share:.2f} 0" for share in np.linspace(0, frame.width, len(reel.times)))
    form = (
        '<path class="cursor" d="M{:.1f} {:.1f}v{:.1f}"><animateTransform attributeName="transform" type="translate" dur="{:g}s" '
        'repeatCount="indefinite" calcMode="discrete" values="{}"/></path>'
    )
    return Markup(form).format(frame.left, frame.top, frame.height, reel.seconds, shares)
