"""Two point masses on the unit sphere that attract each other: one constraint each, coupled only by the force."""

from collections.abc import Sequence
from typing import Any

import sympy as sp

from daebench.problems._charts import moving, projected, unit_vector
from daebench.problems._space import angular_momentum, ellipsoid, mass_matrix, points
from daebench.systems.constrained import Case, Chart, ConstrainedHamiltonian, Picture, coordinates
from daebench.systems.kinetic_flows import product, sphere


def problem(*, mass1: float = 1.0, mass2: float = 1.0, strength: float = 1.0) -> ConstrainedHamiltonian:
    """Return the two-body problem on the unit sphere, q = (q_1, q_2) with both points in Cartesian coordinates.

    ::

        H   = |p_1|^2 / (2 mass1) + |p_2|^2 / (2 mass2) - strength / acos(q_1 . q_2)
        g_k = |q_k|^2 - 1

    acos(q_1 . q_2) is the distance on the sphere. The problem is one of the GniCodes of E. & M. Hairer (2003), in *Frontiers in Numerical
    Analysis*. In the plane a centre of mass moves uniformly and can be split off; on the sphere it cannot. There are four degrees of
    freedom, and the only known integrals are the three components of the angular momentum L = q_1 x p_1 + q_2 x p_2 and the energy. The
    problem tests whether a method conserves three quadratic integrals at once. The kinetic energies are not coupled and their flow is two
    rotations, so that splitting applies; G M^-1 G^T is diagonal.

    Parameters
    ----------
    mass1, mass2 : float
        Masses of the points, kg.
    strength : float
        Attraction: minus the potential energy at a distance of 1 rad, J.
    """
    masses, kappa = sp.symbols("mass1 mass2", positive=True), sp.Symbol("strength", real=True)
    q, p = coordinates(6)
    both, M = points(q), mass_matrix(masses)
    surface, over = ellipsoid(1, 1, 1)
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        M=M,
        U=-kappa / sp.acos(both[0].dot(both[1])),
        g=[x.dot(x) - 1 for x in both],
        parameters=dict(zip([*masses, kappa], [mass1, mass2, strength], strict=True)),
        cases={
            "gni": started(
                masses,
                ("1.3", "-2.1"),
                ("2.1", "-1.1"),
                ("1.2", "0.1"),
                ("0.1", "-0.5"),
                "the GniCodes' start: close encounters, down to 0.05 rad",
            ),
            "circling": started(
                masses,
                ("2", "2.5"),
                (sp.pi / 2, sp.pi / 2),
                ("0.3", "0.3"),
                (1, -1),
                "an almost circular motion about each other, while both move on: regular",
            ),
        },
        integrals=angular_momentum(q, p),
        kinetic_flow=product(*(sphere(q[k : k + 3], p[k : k + 3], mass=m, length=1) for k, m in zip((0, 3), masses, strict=True))),
        chart=projections(q, p, M),
        picture=Picture(masses=[tuple(x) for x in both], surface=surface, over=over),
    )


def started(
    masses: Sequence[sp.Expr], phi: Sequence[Any], theta: Sequence[Any], turn: Sequence[Any], rise: Sequence[Any], about: str
) -> Case:
    """Return the case with q_k = (cos phi sin theta, sin phi sin theta, cos theta), phi' = turn and theta' = rise (rad/s)."""
    q: list[sp.Expr] = []
    p: list[sp.Expr] = []
    for mass, *numbers in zip(masses, phi, theta, turn, rise, strict=True):
        # Exact numbers, so that the start is on the sphere to any number of digits.
        a, b, *rates = map(sp.nsimplify, numbers)
        along = sp.Matrix([-sp.sin(a) * sp.sin(b), sp.cos(a) * sp.sin(b), 0])
        down = sp.Matrix([sp.cos(a) * sp.cos(b), sp.sin(a) * sp.cos(b), -sp.sin(b)])
        q += [sp.cos(a) * sp.sin(b), sp.sin(a) * sp.sin(b), sp.cos(b)]
        p += mass * (rates[0] * along + rates[1] * down)
    return Case(q=q, p=p, about=about)


def projections(q: Sequence[sp.Symbol], p: Sequence[sp.Symbol], M: sp.Matrix) -> Chart:
    """Return the chart by the stereographic projection of both points from (1, -2, -2)/3, third column of S.

    In the declared cases no point comes within 70 degrees of it until t = 100.
    """
    u, S = sp.symbols("u1:5", real=True), sp.Matrix([[2, 2, 1], [2, -1, -2], [-1, 2, -2]]) / 3
    place = [*unit_vector(u[:2], S), *unit_vector(u[2:], S)]
    return moving(q, p, M, xi=u, place=place, inverse=[x for point in points(q) for x in projected(point, S)])
