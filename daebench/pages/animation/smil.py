"""An animation as one SVG that moves by itself: for a page or a slide, without any script."""

from importlib import resources
from pathlib import Path

import numpy as np
from markupsafe import Markup

from daebench.draw.svg.marks import Curve
from daebench.draw.svg.panels import Frame, panel_svg, sample
from daebench.pages.animation.animated_runs import AnimatedRuns
from daebench.pages.animation.panels import GRAPH, SCENE, graph_panel, lines_at, path_of_lines, scene_panel
from daebench.runs.files import atomic

MOST_BYTES = 3_000_000
"""Most bytes of what moves, about."""

MOST_FRAMES = 1500
"""Most frames of a drawing."""

HEAD = 42.0
"""Height of the lines above the scenes, pixels."""

PAPER = """
svg.panels { color: #1d1d1f; background: #fffffd; }
@media (prefers-color-scheme: dark) { svg.panels { color: #e4e4e0; background: #191a1c; } }
.cursor { stroke: currentColor; fill: none; }
"""


def most_frames(points: int, runs: int, columns: int) -> int:
    """Return how many frames a drawing may have that shows so many points of so many methods; a point takes some dozen bytes."""
    del columns
    return min(MOST_FRAMES, int(MOST_BYTES / (runs * 12 * (points + 50))))


def write(path: Path, animated: AnimatedRuns) -> None:
    """Write an animation as a drawing: scenes in columns, the curves below them."""
    width = max(SCENE[0] * len(animated.runs), GRAPH[0])
    columns = max(1, min(len(animated.columns), int(width / SCENE[0])))
    top = HEAD + SCENE[1]
    scenes = [_scene(animated, k) for k in range(len(animated.runs))]
    graphs = [
        _graph(animated, column, ((n % columns) * width / columns, top + (n // columns) * GRAPH[1]), width / columns)
        for n, column in enumerate(animated.columns)
    ]
    height = top + GRAPH[1] * -(-len(animated.columns) // columns)
    style = (resources.files("daebench.draw.svg") / "panels.css").read_text(encoding="utf-8") + PAPER
    name = f"{animated.problem}, case {animated.case}"
    text = Markup(
        '<svg class="panels" xmlns="http://www.w3.org/2000/svg" width="{:g}" height="{:g}" viewBox="0 0 {:g} {:g}" role="img" '
        'aria-label="{}">'
        '<style>{}</style><text class="title" x="12" y="16">{}</text><text x="12" y="33">{}</text>{}{}</svg>'
    ).format(width, height, width, height, name, Markup(style), name, animated.pace, Markup("").join(scenes), Markup("").join(graphs))
    with atomic(path) as scratch:
        scratch.write_text(text, encoding="utf-8")


def _scene(animated: AnimatedRuns, k: int) -> Markup:
    """Return a scene whose parts move, under the name of its method and, where it stopped, when."""
    run, left = animated.runs[k], SCENE[0] * k
    frame = scene_panel(animated, k).frame(left, HEAD, *SCENE)
    texts: dict[str, list[str]] = {}
    for state in run.shown(animated.times):
        for kind, lines in lines_at(animated, k, int(state)).items():
            texts.setdefault(kind, []).append(path_of_lines(lines, frame))
    inside = {kind: _animated(values, animated.seconds) for kind, values in texts.items()}
    line = sample(Curve([], [], animated.stroke(k), width=2.2), frame.left + frame.width - 40, HEAD + 13)
    return panel_svg(scene_panel(animated, k, inside, title=animated.scene_title(k)), frame) + line


def _animated(values: list[str], seconds: float) -> Markup:
    """Return the element that makes a path go through these shapes, over and over; nothing where it stays."""
    if len(set(values)) < 2:
        return Markup("")
    form = '<animate attributeName="d" dur="{:g}s" repeatCount="indefinite" calcMode="discrete" values="{}"/>'
    return Markup(form).format(seconds, ";".join(values))


def _graph(animated: AnimatedRuns, column: str, corner: tuple[float, float], width: float) -> Markup:
    panel = graph_panel(animated, column)
    frame = panel.frame(*corner, width, GRAPH[1])
    return panel_svg(panel, frame) + _cursor(frame, animated)


def _cursor(frame: Frame, animated: AnimatedRuns) -> Markup:
    """Return the line that goes along with time."""
    shares = ";".join(f"{share:.2f} 0" for share in np.linspace(0, frame.width, len(animated.times)))
    form = (
        '<path class="cursor" d="M{:.1f} {:.1f}v{:.1f}"><animateTransform attributeName="transform" type="translate" dur="{:g}s" '
        'repeatCount="indefinite" calcMode="discrete" values="{}"/></path>'
    )
    return Markup(form).format(frame.left, frame.top, frame.height, animated.seconds, shares)
