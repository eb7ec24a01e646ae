"""Linkages of one degree of freedom, point after point: positions and velocities of each from its distances from previous points."""

from collections.abc import Mapping, Sequence

import sympy as sp

from daebench.systems.constrained import Chart
from daebench.systems.picture import Exact

Places = Mapping[str, Sequence[Exact]]
"""Points by name."""

Distances = Sequence[tuple[sp.Matrix, sp.Expr]]
"""Points, each with the square of the distance from it."""


def vectors(places: Places) -> dict[str, sp.Matrix]:
    """Return points as columns of exact numbers."""
    return {name: sp.Matrix([sp.Rational(x) for x in place]) for name, place in places.items()}


def located(distances: Distances, side: int) -> sp.Matrix:
    """Return the point at given distances from two points of the plane or from three of space, on one side (+1, -1) of these.

    ::

        x = p_1 + alpha a + beta b + side gamma n      a = p_2 - p_1,   b = p_3 - p_1,   n = a x b, or a turned by a right angle
    """
    (p, square), *others = distances
    legs = [other - p for other, _ in others]
    right = [(square - far + dot(leg, leg)) / 2 for leg, (_, far) in zip(legs, others, strict=True)]
    if len(legs) == 1:
        n, coefficients = sp.Matrix([-legs[0][1], legs[0][0]]), [right[0] / dot(legs[0], legs[0])]
    else:
        n, (aa, ab, bb) = legs[0].cross(legs[1]), (dot(legs[i], legs[j]) for i, j in ((0, 0), (0, 1), (1, 1)))
        det = aa * bb - ab**2
        coefficients = [(bb * right[0] - ab * right[1]) / det, (aa * right[1] - ab * right[0]) / det]
    # The square root has its sign by ``side``: both points have the distances, and the linkage is in one of them.
    foot = sum((c * leg for c, leg in zip(coefficients, legs, strict=True)), sp.zeros(*p.shape))
    return p + foot + side * sp.sqrt((square - dot(foot, foot)) / dot(n, n)) * n


def followed(x: sp.Matrix, anchors: Sequence[tuple[sp.Matrix, sp.Matrix]]) -> sp.Matrix:
    """Return the velocity of a point that keeps its distances from two points of the plane, or three of space, which move.

    ``anchors`` has places and velocities: (x - p_k) . x' = (x - p_k) . p_k'.
    """
    legs = [x - p for p, _ in anchors]
    right = [dot(leg, v) for leg, (_, v) in zip(legs, anchors, strict=True)]
    if len(legs) == 2:
        a, b = legs
        det = a[0] * b[1] - a[1] * b[0]
        return sp.Matrix([right[0] * b[1] - right[1] * a[1], right[1] * a[0] - right[0] * b[0]]) / det
    a, b, c = legs
    n = [b.cross(c), c.cross(a), a.cross(b)]
    return sum((k * m for k, m in zip(right, n, strict=True)), sp.zeros(3, 1)) / dot(a, n[0])


def dot(a: sp.Matrix, b: sp.Matrix) -> sp.Expr:
    """Return a . b, not expanded."""
    return sp.Add(*(x * y for x, y in zip(a, b, strict=True)))


def square(a: sp.Matrix, b: sp.Matrix) -> sp.Expr:
    """Return the square of the distance of two points."""
    return dot(a - b, a - b)


def by_angle(
    p: Sequence[sp.Symbol],
    M: sp.Matrix,
    *,
    angle: sp.Symbol,
    place: Sequence[sp.Expr],
    slope: sp.Matrix,
    slope_at: sp.Matrix,
    angle_of_q: sp.Expr,
) -> Chart:
    """Return the chart of the angle of a crank and its rate omega.

    ::

        q = place(angle)      p = M q_angle omega      omega = p . q_angle / (q_angle^T M q_angle)

    Parameters
    ----------
    p : sequence of Symbol, shape(d,)
        Momenta.
    M : Matrix, shape(d, d)
        Mass matrix.
    angle : Symbol
        The angle.
    place : sequence of Expr, shape(d,)
        Positions in it.
    slope, slope_at : Matrix, shape(d, 1)
        q_angle in the positions, and in the angle.
    angle_of_q : Expr
        The angle in the positions.
    """
    omega = sp.Symbol("omega", real=True)
    return Chart(
        eta=(omega,),
        xi=(angle,),
        p=tuple(omega * entry for entry in M * slope_at),
        q=tuple(place),
        inverse_eta=(dot(sp.Matrix(list(p)), slope) / dot(slope, M * slope),),
        inverse_xi=(angle_of_q,),
    )
