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
    """Draw springs and dampers at one time, between points of shape(k, 2)."""
    for spring in springs.springs:
        axis.plot(*zigzag(points[list(spring)], AMPLITUDE * extent).T, **style)
    for damper in springs.dampers:
        axis.plot(*points[list(damper)].T, **style | {"linestyle": "--"})
