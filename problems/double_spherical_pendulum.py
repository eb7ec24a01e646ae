"""Two point masses, one hung from the other, in space: chaotic, with a conserved angular momentum about the vertical."""

from collections.abc import Sequence
from typing import Any

import sympy as sp

from daebench.problems._charts import moving, projected, unit_vector
from daebench.problems._space import angular_momentum, mass_matrix, points
from daebench.systems.constrained import Case, Chart, ConstrainedHamiltonian, Picture, coordinates

PIVOT = (0, 0, 0)


def problem(
    *, mass1: float = 1.0, mass2: float = 1.0, length1: float = 1.0, length2: float = 1.0, gravity: float = 9.81
) -> ConstrainedHamiltonian:
    """Return the double spherical pendulum in Cartesian coordinates, q = (x1, y1, z1, x2, y2, z2) with z pointing up, pivot at the origin.

    ::

        H  = |p_1|^2 / (2 mass1) + |p_2|^2 / (2 mass2) + gravity (mass1 z1 + mass2 z2)
        g1 = |q_1|^2 - length1^2      g2 = |q_2 - q_1|^2 - length2^2

    The system of Marsden & Scheurle, Lagrangian reduction and the double spherical pendulum, ZAMP 44 (1993) 17-43. It has four degrees
    of freedom and two integrals, H and the angular momentum L3 about the vertical. L3 is quadratic, and RATTLE conserves it to round-off
    although the motion itself is lost: this is the smallest problem in space that shows which quantities of a chaotic motion a method
    conserves. Its multipliers are coupled, because the rods meet in the first mass.

    Parameters
    ----------
    mass1, mass2 : float
        Mass of the upper and of the lower point, kg.
    length1, length2 : float
        Length of the massless rod from the pivot to the upper point, and from there to the lower one, m.
    gravity : float
        Gravitational acceleration along -z, m/s^2.
    """
    masses, lengths = sp.symbols("mass1 mass2", positive=True), sp.symbols("length1 length2", positive=True)
    gamma = sp.Symbol("gravity", real=True)
    q, p = coordinates(6)
    first, second = points(q)
    rods, M = (first, second - first), mass_matrix(masses)
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        M=M,
        U=gamma * (masses[0] * q[2] + masses[1] * q[5]),
        g=[rod.dot(rod) - length**2 for rod, length in zip(rods, lengths, strict=True)],
        parameters=dict(zip([*masses, *lengths, gamma], [mass1, mass2, length1, length2, gravity], strict=True)),
        cases={
            "swing": pushed(masses, lengths, ("3/10", "-1/5"), ("9/10", "3/5"), "a small swing that goes round the vertical: regular"),
            "horizontal": pushed(masses, lengths, (sp.pi / 2, sp.pi / 2), ("1/2", 2), "from the horizontal with a push sideways: chaotic"),
        },
        integrals={"L3": angular_momentum(q, p)["L3"]},
        chart=projections(q, p, M, rods, lengths),
        picture=Picture(rods=[[PIVOT, tuple(first), tuple(second)]], masses=[tuple(first), tuple(second)], fixed=[PIVOT]),
    )


def pushed(masses: Sequence[sp.Expr], lengths: Sequence[sp.Expr], angles: Sequence[Any], rates: Sequence[Any], about: str) -> Case:
    """Return the case with the rods in the plane y = 0, at angles from hanging (rad), and turning out of it along y at rates (rad/s)."""
    place, speed = sp.zeros(3, 1), sp.Integer(0)
    q: list[sp.Expr] = []
    p: list[sp.Expr] = []
    for mass, length, angle, rate in zip(masses, lengths, map(sp.sympify, angles), map(sp.Rational, rates), strict=True):
        # Speeds add up as places do: the second mass moves with the first.
        place, speed = place + length * sp.Matrix([sp.sin(angle), 0, -sp.cos(angle)]), speed + length * rate
        q, p = [*q, *place], [*p, 0, mass * speed, 0]
    return Case(q=q, p=p, about=about)


def projections(
    q: Sequence[sp.Symbol], p: Sequence[sp.Symbol], M: sp.Matrix, rods: Sequence[sp.Matrix], lengths: Sequence[sp.Expr]
) -> Chart:
    """Return the chart by the stereographic projection of each rod's direction from the zenith: singular where a rod points straight up."""
    u = sp.symbols("u1:5", real=True)
    upright = sp.eye(3)
    first, second = (length * unit_vector(x, upright) for length, x in zip(lengths, (u[:2], u[2:]), strict=True))
    seen = [projected(rod / length, upright) for rod, length in zip(rods, lengths, strict=True)]
    return moving(q, p, M, xi=u, place=[*first, *(first + second)], inverse=[*seen[0], *seen[1]])
