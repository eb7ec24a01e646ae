"""What the lessons draw again and again: quantities against time, and how times are written."""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from daebench.draw.figures import STROKES
from daebench.draw.svg.axis import Axis, around
from daebench.draw.svg.marks import Curve
from daebench.draw.svg.panels import Panel

MINUS_START = "H \N{MINUS SIGN} H\N{SUBSCRIPT ZERO} [J]"


def seconds(value: float) -> str:
    """Return a time with its unit."""
    return f"{value:g} s"


def small(value: float) -> str:
    """Return a small number by its power of ten: 1e-5."""
    return f"{value:.0e}".replace("e-0", "e-")


def against_time(t: npt.ArrayLike, curves: Mapping[str, npt.ArrayLike], label: str, title: str, axis: Axis | None = None) -> Panel:
    """Return curves against time; on a logarithmic axis moduli, and what is below its low end is drawn there.

    Parameters
    ----------
    t : array_like, shape(n,)
        Times, s.
    curves : mapping of str to array_like, shape(n,)
        What is drawn, by name in the legend; an empty name is not in it.
    label, title : str
        What is measured, with its unit, and what the panel shows.
    axis : Axis, optional
        Where it is drawn; by default an axis that holds all of it, and zero.
    """
    times = np.asarray(t, dtype=float)
    values = {name: np.asarray(each, dtype=float) for name, each in curves.items()}
    axis = axis or around(label, *values.values(), [0.0])
    if axis.log:
        values = {name: np.maximum(np.abs(each), axis.low) for name, each in values.items()}
    strokes = (STROKES[3], STROKES[0], STROKES[5])
    marks = [Curve(times[: len(each)], each, stroke, name) for (name, each), stroke in zip(values.items(), strokes, strict=False)]
    return Panel(Axis("t [s]", 0.0, max(float(times[-1]), 1e-6)), axis, marks, title)
