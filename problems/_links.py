"""Point masses on a chain of massless rods in the plane: the common part of the double pendulum and the longer chain.

Mass k is at q_k = (x_k, y_k), y up, and rod k leads to it from mass k - 1, the first from the pivot at the origin. Positions are
stacked as (x_1, y_1, x_2, y_2, ...), momenta likewise.
"""

from collections.abc import Sequence
from itertools import accumulate, pairwise
from typing import Any

import sympy as sp

from daebench.systems.constrained import Chart, Picture


def rods(x: Sequence[Any]) -> list[sp.Matrix]:
    """Return x_k - x_{k-1} for k = 1, ..., n with x_0 = 0, each shape(2,), of stacked points or velocities x, shape(2 n,)."""
    points = [sp.zeros(2, 1), *(sp.Matrix(x[k : k + 2]) for k in range(0, len(x), 2))]
    return [after - before for before, after in pairwise(points)]


def constraints(q: Sequence[sp.Symbol], lengths: Sequence[sp.Expr]) -> list[sp.Expr]:
    """Return g_k = |q_k - q_{k-1}|^2 - length_k^2, shape(n,), from positions of shape(2 n,)."""
    return [rod.dot(rod) - length**2 for rod, length in zip(rods(q), lengths, strict=True)]


def mass_matrix(masses: Sequence[sp.Expr]) -> sp.Matrix:
    """Return diag(mass_1, mass_1, mass_2, mass_2, ...), shape(2 n, 2 n)."""
    return sp.diag(*(mass for mass in masses for _ in range(2)))


def weight(q: Sequence[sp.Symbol], masses: Sequence[sp.Expr], gravity: sp.Expr) -> sp.Expr:
    """Return U = gravity sum_k mass_k y_k."""
    return gravity * sum(mass * y for mass, y in zip(masses, q[1::2], strict=True))


def stretched(lengths: Sequence[sp.Expr], along: tuple[Any, Any]) -> tuple[sp.Expr, ...]:
    """Return positions, shape(2 n,), of the chain stretched from the pivot in the direction of a unit vector."""
    return tuple(reach * component for reach in accumulate(lengths) for component in along)


def angles(q: Sequence[sp.Symbol], p: Sequence[sp.Symbol], masses: Sequence[sp.Expr], lengths: Sequence[sp.Expr]) -> Chart:
    """Return the chart of the rods' angles theta_k from the downward vertical and their rates omega_k, nowhere singular.

    ::

        q_k = sum_{j <= k} length_j (sin theta_j, -cos theta_j)      p_k = mass_k q_k'
        X^T J X has A_ij = length_i length_j (mass_{max(i,j)} + ... + mass_n) cos(theta_i - theta_j) in its block of rates and
        angles, the mass matrix of the motion in angles, which is positive definite everywhere: B(y) is not constant, HLW (2.22)
    """
    n = len(lengths)
    theta, omega = sp.symbols(f"theta1:{n + 1}", real=True), sp.symbols(f"omega1:{n + 1}", real=True)
    place = sp.Matrix.vstack(*accumulate(length * sp.Matrix([sp.sin(a), -sp.cos(a)]) for length, a in zip(lengths, theta, strict=True)))
    M = mass_matrix(masses)
    turning = zip(rods(q), rods(M.inv() * sp.Matrix(p)), lengths, strict=True)
    return Chart(
        eta=omega,
        xi=theta,
        p=tuple(M * place.jacobian(theta) * sp.Matrix(omega)),
        q=tuple(place),
        inverse_eta=tuple((rod[0] * rate[1] - rod[1] * rate[0]) / length**2 for rod, rate, length in turning),
        inverse_xi=tuple(sp.atan2(rod[0], -rod[1]) for rod in rods(q)),
    )


def drawn(q: Sequence[sp.Symbol]) -> Picture:
    """Return the rods as one line from the pivot, and the masses."""
    points = [tuple(q[k : k + 2]) for k in range(0, len(q), 2)]
    return Picture(rods=[[(0, 0), *points]], masses=points, fixed=[(0, 0)])
