"""Rotations about the axes of a body: the cross product as a matrix, and a vector turned."""

from collections.abc import Sequence

import sympy as sp


def hat(y: Sequence[sp.Expr]) -> sp.Matrix:
    """Return the matrix of the cross product, shape(3, 3): hat(y) w = y x w."""
    return sp.Matrix([[0, -y[2], y[1]], [y[2], 0, -y[0]], [-y[1], y[0], 0]])


def turned(vector: Sequence[sp.Expr], axis: int, angle: sp.Expr) -> list[sp.Expr]:
    """Return the solution at s = angle of x' = x x e_axis from a vector: the vector rotated by -angle about the axis 0, 1 or 2."""
    after, j, k = list(vector), (axis + 1) % 3, (axis + 2) % 3
    after[j] = vector[j] * sp.cos(angle) + vector[k] * sp.sin(angle)
    after[k] = vector[k] * sp.cos(angle) - vector[j] * sp.sin(angle)
    return after
