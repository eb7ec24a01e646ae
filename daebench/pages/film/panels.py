"""What an animation shows as panels of SVG: the scene of each method at one time, and its errors over time."""

from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from daebench.draw.figures import QUIET, Stroke
from daebench.draw.orthographic import projected
from daebench.draw.svg.axis import Axis
from daebench.draw.svg.marks import Curve, Dots, Mark, Note, Place, color_of, path_of
from daebench.draw.svg.panels import Panel
from daebench.pages.film.reel import Reel
from daebench.runs.trajectory import Array

SCENE = (300.0, 300.0)
"""Width and height of a scene, pixels."""

GRAPH = (380.0, 215.0)
"""Width and height of a panel of curves, pixels."""

ROD, TRAIL = 2.2, 1.4
"""Widths of rods and trails, pixels."""


@dataclass(frozen=True)
class Part:
    """A part of a scene that moves: one path.

    Parameters
    ----------
    kind : str
        "rods", "masses" or "trail".
    stroke : Stroke
        Its colour.
    lines : sequence of ndarray, shape(n, 2)
        Lines through points; a line of one point is a disc.
    width : float
        Width of the lines, pixels.
    inside : Markup
        What the path has in it.
    """

    kind: str
    stroke: Stroke
    lines: list[Array]
    width: float
    inside: Markup

    def svg(self, place: Place) -> Markup:
        """Return it as a path with round ends."""
        form = Markup(
            '<path class="{}" d="{}" fill="none" stroke="{}" stroke-width="{}" stroke-linecap="round" stroke-linejoin="round">{}</path>'
        )
        return form.format(self.kind, path_of_lines(self.lines, place), color_of(self.stroke), self.width, self.inside)


def path_of_lines(lines: list[Array], place: Place) -> str:
    """Return lines as the data of one path; a line of one point is a dot."""
    texts = []
    for line in lines:
        path = path_of(*place(line[:, 0], line[:, 1]))
        texts.append(path + "h0" if len(line) == 1 and path else path)
    return "".join(texts)


def lines_at(reel: Reel, take: int, state: int) -> dict[str, list[Array]]:
    """Return the lines of the parts of a take that move, by kind, at one of its states."""
    points = reel.flat[take]
    back = max(0, state - reel.trail)
    return {
        "trail": [points[back : state + 1, k] for k in reel.trails],
        "rods": [points[state, rod] for rod in reel.layout.rods],
        "masses": [points[state, [k]] for k in reel.layout.masses],
    }


def scene_panel(reel: Reel, take: int, inside: dict[str, Markup] | None = None, title: str = "") -> Panel:
    """Return the scene of a take at its start; ``inside`` is put into the paths of its parts, by kind."""
    quiet, stroke = Stroke(QUIET, "-", "o"), reel.stroke(take)
    marks: list[Mark] = [Curve(line[:, 0], line[:, 1], quiet, width=0.6, faint=True) for line in projected(reel.layout.surface)]
    if reel.layout.dimension == 3:
        marks += triad(reel)
    colors = {"trail": stroke, "rods": Stroke("currentColor", "-", "o"), "masses": stroke}
    widths = {"trail": TRAIL, "rods": ROD, "masses": reel.disc}
    for kind, lines in lines_at(reel, take, 0).items():
        marks.append(Part(kind, colors[kind], lines, widths[kind], (inside or {}).get(kind, Markup(""))))
    x, y = reel.flat[take][0, reel.layout.fixed].T
    marks.append(Dots(x, y, quiet, radius=3.0, hollow=True))
    return Panel(*reel.box, marks, title=title, equal=reel.equal, bare=reel.layout.dimension == 3)


def triad(reel: Reel) -> list[Mark]:
    """Return the three directions of space with their names, in a corner of the scene."""
    corner, size = reel.corner
    quiet = Stroke(QUIET, "-", "o")
    found: list[Mark] = []
    for axis, name in zip(np.eye(3), reel.layout.axes or "xyz", strict=True):
        tip = projected(axis[None])[0]
        x, y = np.stack([corner, corner + 0.8 * size * tip, corner + 1.25 * size * tip]).T
        found += [Curve(x[:2], y[:2], quiet, width=1.2), Note(x[2], y[2], name, anchor="middle")]
    return found


def graph_panel(reel: Reel, column: str) -> Panel:
    """Return an error over time, a curve a method."""
    y = reel.error_axis(column)
    curves = [
        Curve(take.t, np.where(take.errors[column] >= y.low, take.errors[column], np.nan), reel.stroke(k), width=1.4)
        for k, take in enumerate(reel.takes)
        if column in take.errors
    ]
    return Panel(reel.time_axis, Axis("", y.low, y.high, log=True), curves, title=y.label)
