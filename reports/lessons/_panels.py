"""Panels of several lessons: quantities against time and paths on a sphere; and times as text."""

from collections.abc import Mapping
from functools import partial

import numpy as np
import numpy.typing as npt

from daebench.draw import orthographic
from daebench.draw.figures import BLACK, STROKES, Stroke
from daebench.draw.svg.axis import Axis, around
from daebench.draw.svg.marks import Curve, Dots, Mark
from daebench.draw.svg.panels import Panel
from daebench.runs.ivp import Array

MINUS_START = "H \N{MINUS SIGN} H\N{SUBSCRIPT ZERO} [J]"

seen = partial(orthographic.seen, azimuth=-60.0, elevation=22.0)
"""Viewpoint of the sphere, by longitude and latitude."""

REACH = 1.12
OUTLINE = Stroke(BLACK, "-", "")
AROUND = np.linspace(0, 2 * np.pi, 73)


def seconds(value: float) -> str:
    """Return a time with its unit."""
    return f"{value:g} s"


def small(value: float) -> str:
    """Return a small number by its power of ten: 1e-5."""
    return f"{value:.0e}".replace("e-0", "e-")


def against_time(t: npt.ArrayLike, curves: Mapping[str, npt.ArrayLike], label: str, title: str, axis: Axis | None = None) -> Panel:
    """Return curves against time; on a logarithmic axis moduli, and values below its low end are drawn at the low end.

    Parameters
    ----------
    t : array_like, shape(n,)
        Times, s.
    curves : mapping of str to array_like, shape(n,)
        Values, by name in the legend; an empty name is not in it.
    label, title : str
        Quantity with its unit, and title of the panel.
    axis : Axis, optional
        The axis; by default one that contains all values, and zero.
    """
    times = np.asarray(t, dtype=float)
    values = {name: np.asarray(curve, dtype=float) for name, curve in curves.items()}
    axis = axis or around(label, *values.values(), [0.0])
    if axis.log:
        values = {name: np.maximum(np.abs(curve), axis.low) for name, curve in values.items()}
    strokes = (STROKES[3], STROKES[0], STROKES[5])
    marks = [Curve(times[: len(curve)], curve, stroke, name) for (name, curve), stroke in zip(values.items(), strokes, strict=False)]
    return Panel(Axis("t [s]", 0.0, max(float(times[-1]), 1e-6)), axis, marks, title)


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
    """Return a curve in space: pale behind the sphere, with a dot at its end."""
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
