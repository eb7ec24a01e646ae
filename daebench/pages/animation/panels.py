"""Panels of an animation as SVG: the scene of each method at one time, and its errors over time."""

from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from daebench.draw.figures import QUIET, Stroke
from daebench.draw.orthographic import projected
from daebench.draw.scene import zigzag
from daebench.draw.svg.axis import Axis
from daebench.draw.svg.marks import Curve, Dots, Mark, Note, Place, color_of, dashes_of, path_of
from daebench.draw.svg.panels import Panel
from daebench.pages.animation.animated_runs import AnimatedRuns
from daebench.runs.trajectory import Array

SCENE = (300.0, 300.0)
"""Width and height of a scene, pixels."""

GRAPH = (380.0, 215.0)
"""Width and height of a panel of curves, pixels."""

ROD, TRAIL, SPRING = 2.2, 1.4, 1.2
"""Widths of rods, of trails, and of springs and dampers, pixels."""

DASHES = (0, (4, 3))
"""Dashes of dampers, in widths of the line."""


@dataclass(frozen=True)
class Part:
    """A part of a scene that moves: one path."""

    kind: str
    """"trail", "springs", "dampers", "rods" or "masses"."""
    stroke: Stroke
    """Its colour."""
    lines: list[Array]
    """Lines through points; a line of one point is a disc; shape (n, 2)."""
    width: float
    """Width of the lines, pixels."""
    inside: Markup
    """What the path has in it."""

    def svg(self, place: Place) -> Markup:
        """Return it as a path with round ends."""
        form = Markup(
            '<path class="{}" d="{}" fill="none" stroke="{}" stroke-width="{}"{} stroke-linecap="round" stroke-linejoin="round">{}</path>'
        )
        dashes = dashes_of(self.stroke, self.width)
        return form.format(self.kind, path_of_lines(self.lines, place), color_of(self.stroke), self.width, dashes, self.inside)


def path_of_lines(lines: list[Array], place: Place) -> str:
    """Return lines as the data of one path; a line of one point is a dot."""
    texts = []
    for line in lines:
        path = path_of(*place(line[:, 0], line[:, 1]))
        texts.append(path + "h0" if len(line) == 1 and path else path)
    return "".join(texts)


def lines_at(animated: AnimatedRuns, run: int, state: int) -> dict[str, list[Array]]:
    """Return the lines of the parts of a run that move, by kind, at one of its states."""
    points, layout = animated.flat[run], animated.layout
    back = max(0, state - animated.trail)
    springs = {
        "springs": [zigzag(points[state, spring], animated.amplitude) for spring in layout.springs],
        "dampers": [points[state, damper] for damper in layout.dampers],
    }
    return {
        "trail": [points[back : state + 1, k] for k in animated.trails],
        **{kind: lines for kind, lines in springs.items() if lines},
        "rods": [points[state, rod] for rod in layout.rods],
        "masses": [points[state, [k]] for k in layout.masses],
    }


def scene_panel(animated: AnimatedRuns, run: int, inside: dict[str, Markup] | None = None, title: str = "") -> Panel:
    """Return the scene of a run at its start; ``inside`` is put into the paths of its parts, by kind."""
    quiet, stroke = Stroke(QUIET, "-", "o"), animated.stroke(run)
    marks: list[Mark] = [Curve(line[:, 0], line[:, 1], quiet, width=0.6, faint=True) for line in projected(animated.layout.surface)]
    if animated.layout.dimension == 3:
        marks += triad(animated)
    solid, dashed = (Stroke("currentColor", dashes, "o") for dashes in ("-", DASHES))
    colors = {"trail": stroke, "springs": solid, "dampers": dashed, "rods": solid, "masses": stroke}
    widths = {"trail": TRAIL, "springs": SPRING, "dampers": SPRING, "rods": ROD, "masses": animated.disc}
    for kind, lines in lines_at(animated, run, 0).items():
        marks.append(Part(kind, colors[kind], lines, widths[kind], (inside or {}).get(kind, Markup(""))))
    x, y = animated.flat[run][0, animated.layout.fixed].T
    marks.append(Dots(x, y, quiet, radius=3.0, hollow=True))
    return Panel(*animated.box, marks, title=title, equal=animated.equal, bare=animated.layout.dimension == 3)


def triad(animated: AnimatedRuns) -> list[Mark]:
    """Return the three directions of space with their names, in a corner of the scene."""
    corner, size = animated.corner
    quiet = Stroke(QUIET, "-", "o")
    marks: list[Mark] = []
    for axis, name in zip(np.eye(3), animated.layout.axes or "xyz", strict=True):
        tip = projected(axis[None])[0]
        x, y = np.stack([corner, corner + 0.8 * size * tip, corner + 1.25 * size * tip]).T
        marks += [Curve(x[:2], y[:2], quiet, width=1.2), Note(x[2], y[2], name, anchor="middle")]
    return marks


def graph_panel(animated: AnimatedRuns, column: str) -> Panel:
    """Return an error over time, a curve a method."""
    y = animated.error_axis(column)
    curves = [
        Curve(run.t, np.where(run.errors[column] >= y.low, run.errors[column], np.nan), animated.stroke(k), width=1.4)
        for k, run in enumerate(animated.runs)
        if column in run.errors
    ]
    return Panel(animated.time_axis, Axis("", y.low, y.high, log=True), curves, title=y.label)
