"""Bricard's mechanism, five rods in a closed loop: it has one degree of freedom, although a count of constraints gives none."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import sympy as sp

from daebench.systems.constrained import Case, Chart, ConstrainedHamiltonian, Picture, coordinates

Y, X = sp.Matrix([0, 1, 0]), sp.Matrix([1, 0, 0])
"""Axes of the joints at P_5 and P_0."""


def problem(*, mass: float = 1.0, length: float = 1.0, width: float = 0.1, gravity: float = 9.81) -> ConstrainedHamiltonian:
    """Return five rods from P_5 to P_0 with revolute joints, the first and the last of which are on the ground.

    ::

        u_5, ..., u_0: unit vectors along the axes of the joints, u_5 = y, u_0 = x;   P_5 = 0, P_0 = (0, 0, length)
        q = (u_4x, u_4z, P_3, u_3, P_2, u_2, u_1y, u_1z),    P_4 = length u_5 x u_4,    P_1 = P_0 - length u_1 x u_0
        T = sum over the rods of mass/6 (v.v + v.w + w.w) + mass width^2/24 (|u_k'|^2 + |u_{k+1}'|^2),   v = P_k', w = P_{k+1}'
        g = |u_4|^2 - 1,  and for the rods k = 3, 2, 1 with r_k = P_k - P_{k+1}:
            |r_k|^2 - length^2,   u_{k+1} . u_k,   u_{k+1} . r_k,   u_k . r_k,   |u_k|^2 - 1

    Each rod has the axes of its joints across it and across each other, so that both axes and the rod itself are its natural coordinates
    (Garcia de Jalon and Bayo, *Kinematic and Dynamic Simulation of Multibody Systems*, Springer 1994). With them a rod of square section,
    of inertia mass width^2/6 about its length, has a constant mass matrix.

    There are 16 constraints on 16 positions, and G has rank 15 all along the motion: most loops of six joints in space are stiff, but this
    one moves (Bricard, *J. Math. Pures Appl.* 3 (1897) 113-150). One constraint is redundant everywhere, so only the combination G^T lam of
    the multipliers is determined. Joints of odd number all turn by one angle b and those of even number by one angle a, with (1 + cos a) (1
    + cos b) = 1, as in every linkage of threefold symmetry with right angles (Chen, You and Tarnai, *Int. J. Solids Struct.* 42 (2005)
    2287-2301). In the benchmark the joint P_3, the third from the origin, is back at its start after 4.99 s; it comes up to y = -0.866 and
    down to z = -0.5 on the way.

    Parameters
    ----------
    mass : float
        Mass of each rod, uniform, kg.
    length : float
        Length of each rod, and distance of P_0 and P_5, m.
    width : float
        Edge of the square section, m.
    gravity : float
        Gravitational acceleration along -y, m/s^2.
    """
    m, L, w = sp.symbols("mass length width", positive=True)
    gamma = sp.Symbol("gravity", real=True)
    q, p = coordinates(16)
    P, u, M = joints(q, L), axes(q), mass_matrix(q, m, L, w)
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        M=M,
        U=m * gamma * sum(a[1] + b[1] for a, b in pairwise(P)) / 2,
        g=constraints(P, u, L),
        parameters={m: mass, L: length, w: width, gamma: gravity},
        cases={
            "iftomm": Case(
                q=placed(sp.pi / 2, L),
                p=[0] * 16,
                about="IFToMM benchmark A04: released at rest with all rods along edges of a cube",
                # One of the sixteen constraints is redundant everywhere: elimination would stop at once.
                on_singular="least-squares",
            ),
            "swing": Case(
                q=placed(sp.Rational(1, 5), L),
                p=[0] * 16,
                about="released at rest near the lowest configuration: a small swing",
                on_singular="least-squares",
            ),
        },
        chart=angle(q, p, M, L),
        picture=Picture(
            rods=[[tuple(x) for x in P]],
            fixed=[tuple(P[0]), tuple(P[-1])],
            points={f"P{k}": tuple(x) for k, x in zip(range(5, -1, -1), P, strict=True)},
        ),
    )


def joints(q: Sequence[Any], length: Any) -> list[sp.Matrix]:
    """Return P_5, ..., P_0."""
    P_4, P_1 = length * sp.Matrix([q[1], 0, -q[0]]), length * sp.Matrix([0, -q[15], 1 + q[14]])
    return [sp.zeros(3, 1), P_4, sp.Matrix(q[2:5]), sp.Matrix(q[8:11]), P_1, sp.Matrix([0, 0, length])]


def axes(q: Sequence[Any]) -> list[sp.Matrix]:
    """Return u_5, ..., u_0."""
    return [Y, sp.Matrix([q[0], 0, q[1]]), sp.Matrix(q[5:8]), sp.Matrix(q[11:14]), sp.Matrix([0, q[14], q[15]]), X]


def constraints(P: Sequence[sp.Matrix], u: Sequence[sp.Matrix], length: sp.Expr) -> list[sp.Expr]:
    """Return g, shape(16,), from one end of the chain to the other."""
    g = [u[1].dot(u[1]) - 1]
    for k in (2, 3, 4):
        r = P[k] - P[k - 1]
        g += [r.dot(r) - length**2, u[k - 1].dot(u[k]), u[k - 1].dot(r), u[k].dot(r), u[k].dot(u[k]) - 1]
    return g


def mass_matrix(q: Sequence[sp.Symbol], mass: sp.Expr, length: sp.Expr, width: sp.Expr) -> sp.Matrix:
    """Return M, shape(16, 16), constant: joints and axes are linear in q, so their values at q' are their velocities up to a constant."""
    still = dict.fromkeys(q, 0)
    P, u = ([x - x.subs(still) for x in part] for part in (joints(q, length), axes(q)))
    T = sum(mass / 6 * (v.dot(v) + v.dot(w) + w.dot(w)) for v, w in pairwise(P))
    T += sum(mass * width**2 / 24 * (v.dot(v) + w.dot(w)) for v, w in pairwise(u))
    return sp.hessian(T, q)


def placed(b: Any, length: Any) -> list[sp.Expr]:
    """Return the positions, shape(16,), at an angle b of less than 120 degrees to both sides."""
    c, s = sp.cos(b), sp.sin(b)
    ca, sa = -c / (1 + c), sp.sqrt(1 + 2 * c) / (1 + c)
    P_3, P_2 = (s * (1 + ca), -sa, ca), (s, -sa * (1 + c), 1 - c)
    u_3, u_2 = (sa * s, ca, -sa * c), (c, s * sa, -s * ca)
    return [c, s, *(length * x for x in P_3), *u_3, *(length * x for x in P_2), *u_2, ca, sa]


def angle(q: Sequence[sp.Symbol], p: Sequence[sp.Symbol], M: sp.Matrix, length: sp.Expr) -> Chart:
    """Return the chart of the angle b of the joints of odd number, and its rate; 120 degrees are a turning point that it does not pass.

    ::

        q = placed(b)      p = M placed'(b) b'      b' = placed'(b)^T p / (placed'(b)^T M placed'(b))
    """
    b, rate = sp.symbols("angle angle_rate", real=True)
    place = sp.Matrix(placed(b, length))
    along = place.diff(b)
    # cos b and sin b are positions themselves: u_4 is (cos b, 0, sin b).
    here = along.subs({sp.cos(b): q[0], sp.sin(b): q[1]})
    return Chart(
        eta=(rate,),
        xi=(b,),
        p=tuple(M * along * rate),
        q=tuple(place),
        inverse_eta=(here.dot(sp.Matrix(p)) / (here.T * M * here)[0],),
        inverse_xi=(sp.atan2(q[1], q[0]),),
    )
