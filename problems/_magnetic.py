"""Charged particles in a magnetic field along the third axis that has a symmetry about it."""

from collections.abc import Sequence

import sympy as sp


def energy(q: Sequence[sp.Symbol], p: Sequence[sp.Symbol], *, mass: sp.Expr, turn: sp.Expr) -> sp.Expr:
    """Return |p - A(q)|^2 / (2 mass) with A = turn (-q2, q1, 0), in units in which the charge is 1."""
    A = (-turn * q[1], turn * q[0], 0)
    return sum((y - a) ** 2 for y, a in zip(p, A, strict=True)) / (2 * mass)


def with_velocity(q: Sequence[sp.Expr], v: Sequence[sp.Expr], *, mass: sp.Expr, turn: sp.Expr) -> tuple[sp.Expr, ...]:
    """Return the momenta p = mass v + A(q) at a place; ``turn`` is its value there."""
    return (mass * v[0] - turn * q[1], mass * v[1] + turn * q[0], mass * v[2])
