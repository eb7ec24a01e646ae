"""Springs as zigzags and dampers as dashed lines, in axes of Matplotlib."""

from collections.abc import Sequence
from typing import Any, Protocol

from daebench.draw.scene import AMPLITUDE, zigzag
from daebench.runs.ivp import Array


class Pulls(Protocol):
    """What has springs and dampers between numbered points."""

    @property
    def springs(self) -> Sequence[Sequence[int]]:
        """Which two points each spring is between."""

    @property
    def dampers(self) -> Sequence[Sequence[int]]:
        """Which two points each damper is between."""


def draw_pulls(axis: Any, pulls: Pulls, points: Array, extent: float, **style: Any) -> None:
    """Draw springs and dampers at one time.

    Parameters
    ----------
    axis : Axes
        Where they are drawn.
    pulls : Pulls
        Which points they are between.
    points : ndarray, shape(k, 2)
        The points.
    extent : float
        Extent of all that is drawn, which the width of springs is a part of.
    **style
        Colour, width and opacity of the lines.
    """
    for spring in pulls.springs:
        axis.plot(*zigzag(points[list(spring)], AMPLITUDE * extent).T, **style)
    for damper in pulls.dampers:
        axis.plot(*points[list(damper)].T, **style | {"linestyle": "--"})
