"""Pictures of problems: the drawing of a state."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import sympy as sp

Exact = Any
"""An exact number or expression: int, str such as "9.81", or a SymPy expression in the problem's parameters."""

Point = Sequence[Exact]
"""A point of the plane or of space, shape(2,) or shape(3,), in the problem's positions, or its state y, and parameters."""


@dataclass(frozen=True, kw_only=True)
class Picture:
    """Picture of a problem: the parts that are drawn at given positions.

    Parameters
    ----------
    rods : sequence of sequence of points
        Rigid parts, each a line through its points.
    masses : sequence of points
        Point masses.
    fixed : sequence of points
        Pivots and other points that do not move.
    springs, dampers : sequence of pairs of points
        Ends of springs, which are drawn as zigzags, and of dampers, as dashed lines.
    surface : tuple of three Expr, optional
        Surface on which the masses move, in the symbols ``over`` and the parameters.
    over : sequence of (Symbol, lower bound, upper bound)
        The two coordinates of the surface.
    axes : sequence of str, shape(2,) or shape(3,)
        Names of the coordinates, if they are not the lengths x, y and z.
    points : mapping of str to point
        Named points, such as the joints of a mechanism; a run reports their final positions in JSON. They are not drawn.
    """

    rods: Sequence[Sequence[Point]] = ()
    masses: Sequence[Point] = ()
    fixed: Sequence[Point] = ()
    springs: Sequence[tuple[Point, Point]] = ()
    dampers: Sequence[tuple[Point, Point]] = ()
    surface: tuple[sp.Expr, sp.Expr, sp.Expr] | None = None
    over: Sequence[tuple[sp.Symbol, Exact, Exact]] = ()
    axes: Sequence[str] = ()
    points: Mapping[str, Point] = field(default_factory=dict)
