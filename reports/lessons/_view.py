"""A sphere seen from outside: where points of space are in the picture, and which of them are in front."""

from functools import partial

import numpy as np

from daebench.draw import orthographic
from daebench.draw.figures import BLACK, Stroke
from daebench.draw.svg.axis import Axis
from daebench.draw.svg.marks import Curve, Dots, Mark
from daebench.draw.svg.panels import Panel
from daebench.runs.ivp import Array

seen = partial(orthographic.seen, azimuth=-60.0, elevation=22.0)
"""The sphere as a geographer places the eye."""

REACH = 1.12
OUTLINE = Stroke(BLACK, "-", "")
AROUND = np.linspace(0, 2 * np.pi, 73)


def globe() -> list[Mark]:
    """Return the outline of the unit sphere and its equator."""
    equator = seen(np.stack([np.cos(AROUND), np.sin(AROUND), 0 * AROUND], axis=1))
    front = np.where(equator[:, 2:] >= 0, equator, np.nan)
    return [
        Curve(np.cos(AROUND), np.sin(AROUND), OUTLINE, width=0.8, faint=True),
        Curve(equator[:, 0], equator[:, 1], OUTLINE, width=0.5, faint=True),
        Curve(front[:, 0], front[:, 1], OUTLINE, width=0.8, faint=True),
    ]


def path(points: Array, stroke: Stroke, name: str = "") -> list[Mark]:
    """Return a curve in space: pale where the sphere is before it, with a dot at its end."""
    at = seen(points)
    behind = (at[:, 2] < 0) & (np.hypot(at[:, 0], at[:, 1]) < 1)
    hidden, shown = (np.where(chosen[:, None], at, np.nan) for chosen in (behind, ~behind))
    return [
        Curve(hidden[:, 0], hidden[:, 1], stroke, width=0.9, faint=True),
        Curve(shown[:, 0], shown[:, 1], stroke, name, width=1.3),
        Dots(at[-1:, 0], at[-1:, 1], stroke, radius=3.6),
    ]


def view(marks: list[Mark], title: str) -> Panel:
    """Return a view of the sphere with marks on it."""
    return Panel(Axis("", -REACH, REACH), Axis("", -REACH, REACH), [*globe(), *marks], title, equal=True, bare=True)
