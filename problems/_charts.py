"""Charts by coordinates and their rates, and the stereographic projection, which is singular at a single point of a sphere."""

from collections.abc import Sequence
from typing import Any

import sympy as sp

from daebench.systems.constrained import Chart


def moving(
    q: Sequence[sp.Symbol],
    p: Sequence[sp.Symbol],
    M: sp.Matrix,
    *,
    xi: Sequence[sp.Symbol],
    place: Sequence[sp.Expr],
    inverse: Sequence[sp.Expr],
) -> Chart:
    """Return the chart of coordinates xi and their rates eta.

    ::

        q = place(xi)      p = M place'(xi) eta      eta = inverse'(q) M^-1 p
        X^T J X has the mass matrix of the motion in xi, place'^T M place', in its block of rates and coordinates: it is
        regular wherever xi are coordinates; B(y) is not constant, HLW (2.22)

    Parameters
    ----------
    q, p : sequence of Symbol, shape(d,)
        Positions and momenta.
    M : Matrix, shape(d, d)
        Constant diagonal mass matrix.
    xi : sequence of Symbol, shape(d - m,)
        The coordinates.
    place : sequence of Expr, shape(d,)
        Positions in xi.
    inverse : sequence of Expr, shape(d - m,)
        The coordinates in q.
    """
    eta = [sp.Symbol(f"{x}_rate", real=True) for x in xi]
    P = M * sp.Matrix(place).jacobian(xi) * sp.Matrix(eta)
    # By the derivative of the inverse, and not of place: the rates then need no linear system.
    rates = sp.Matrix(inverse).jacobian(q) * M.inv() * sp.Matrix(p)
    return Chart(eta=eta, xi=xi, p=tuple(P), q=tuple(place), inverse_eta=tuple(rates), inverse_xi=tuple(inverse))


def unit_vector(x: Sequence[Any], S: sp.Matrix) -> sp.Matrix:
    """Return the point of the unit sphere that is projected to x, shape(2,), from the third column of the rotation S.

    ::

        n = S (2 x1, 2 x2, |x|^2 - 1) / (|x|^2 + 1)
    """
    square = x[0] ** 2 + x[1] ** 2
    return S * sp.Matrix([2 * x[0], 2 * x[1], square - 1]) / (square + 1)


def projected(n: Sequence[sp.Expr], S: sp.Matrix) -> list[sp.Expr]:
    """Return the stereographic projection x, shape(2,), of a unit vector n, the inverse of :func:`unit_vector`."""
    seen = S.T * sp.Matrix(n)
    # Singular only where n is the third column of S: problems choose S so that no motion comes near it.
    return [seen[0] / (1 - seen[2]), seen[1] / (1 - seen[2])]
