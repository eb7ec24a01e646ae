"""Point masses in space: vectors stacked point after point, conserved quantities, and surfaces on which the points move."""

from collections.abc import Sequence
from typing import Any

import sympy as sp

Surface = tuple[tuple[sp.Expr, sp.Expr, sp.Expr], list[tuple[sp.Symbol, Any, Any]]]


def points(x: Sequence[Any]) -> list[sp.Matrix]:
    """Return the vectors, shape(3,), that are stacked in x, shape(3 n,)."""
    return [sp.Matrix(x[k : k + 3]) for k in range(0, len(x), 3)]


def mass_matrix(masses: Sequence[sp.Expr]) -> sp.Matrix:
    """Return diag(mass_1, mass_1, mass_1, mass_2, ...), shape(3 n, 3 n)."""
    return sp.diag(*(mass for mass in masses for _ in range(3)))


def angular_momentum(q: Sequence[sp.Symbol], p: Sequence[sp.Symbol]) -> dict[str, sp.Expr]:
    """Return the components L1, L2, L3 of the total angular momentum about the origin, the sum of all q_k x p_k."""
    total = sum((x.cross(y) for x, y in zip(points(q), points(p), strict=True)), sp.zeros(3, 1))
    return {f"L{k + 1}": total[k] for k in range(3)}


def ellipsoid(a1: Any, a2: Any, a3: Any) -> Surface:
    """Return the surface of an ellipsoid with these semi-axes, and its coordinates theta from the third axis and phi about it."""
    theta, phi = sp.symbols("theta phi", real=True)
    surface = a1 * sp.sin(theta) * sp.cos(phi), a2 * sp.sin(theta) * sp.sin(phi), a3 * sp.cos(theta)
    return surface, [(theta, 0, sp.pi), (phi, 0, 2 * sp.pi)]
