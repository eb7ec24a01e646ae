"""Springs as zigzags and dampers as dashed lines, in axes of Matplotlib."""

from collections.abc import Sequence
from typing import Any, Protocol

from daebench.draw.scene import AMPLITUDE, zigzag
from daebench.runs.ivp import Array


class Springs(Protocol):
    """Something with springs and dampers between numbered points."""

    @property
    def springs(self) -> Sequence[Sequence[int]]:
        """The two points that each spring connects."""

    @property
    def dampers(self) -> Sequence[Sequence[int]]:
        """The two points that each damper connects."""


def draw_springs(axis: Any, springs: Springs, points: Array, extent: float, **style: Any) -> None:
    """Draw springs and dampers at one time.

    Parameters
    ----------
    axis : Axes
        Where they are drawn.
    springs : Springs
        The springs and dampers, by the numbers of their points.
    points : ndarray, shape(k, 2)
        The points.
    extent : float
        Extent of the whole drawing; the width of a spring is a fraction of it.
    **style
        Colour, width and opacity of the lines.
    """
    for spring in springs.springs:
        axis.plot(*zigzag(points[list(spring)], AMPLITUDE * extent).T, **style)
    for damper in springs.dampers:
        axis.plot(*points[list(damper)].T, **style | {"linestyle": "--"})
