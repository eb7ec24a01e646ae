"""A four-bar linkage with a spring along a diagonal: small vibrations about an equilibrium under gravity, and large ones."""

from collections.abc import Sequence
from typing import Any

import sympy as sp

from daebench.systems.constrained import Case, Chart, ConstrainedHamiltonian, Picture, coordinates


def problem(
    *, mass: float = 1.0, length: float = 1.0, stiffness: float = 25.0, natural_length: float = 1.4142135623730951, gravity: float = 9.81
) -> ConstrainedHamiltonian:
    """Return three bars A B, B C and C D with A = 0 and D = (length, 0) on the ground, and a spring from A to C.

    ::

        q = (x_B, y_B, x_C, y_C)      T = mass/6 (v.v + v.w + w.w) of a bar whose ends move with v, w
        U = mass gravity (y_A + 2 y_B + 2 y_C + y_D)/2 + stiffness/2 (|C - A| - natural_length)^2
        g = |B - A|^2 - length^2,   |C - B|^2 - length^2,   |D - C|^2 - length^2
        in parallel, B = length (cos theta, sin theta), C = B + (length, 0), and with c(theta) = |C - A| = 2 length cos(theta/2):
            (5/3) mass length^2 theta'' = -d/dtheta (2 mass gravity length sin theta + stiffness/2 (c - natural_length)^2)
        at an equilibrium the eigenvalues of the linearised motion are +- i omega, omega^2 = U_thetatheta / (5/3 mass length^2)

    The problem is of the kind of the IFToMM benchmark *Fourbar linkage with diagonal spring*, which asks for the equilibrium and for the
    eigenvalues of the linearised motion (see also Gonzalez, Masarati, Cuadrado & Naya, *J. Comput. Nonlinear Dyn.* 12 (2017) 041009). The
    numbers here are not those of the benchmark, which are not available; the tests compare the motion with the motion in theta. With equal
    bars the bars on the ground stay parallel until all bars lie in one line, where G loses rank.

    Parameters
    ----------
    mass : float
        Mass of each bar, uniform along it, kg.
    length : float
        Length of each bar, and distance of A and D, m.
    stiffness : float
        Stiffness of the spring, N/m.
    natural_length : float
        Length of the spring without force, m.
    gravity : float
        Gravitational acceleration along -y, m/s^2.
    """
    m, L, l0 = sp.symbols("mass length natural_length", positive=True)
    k, gamma = sp.symbols("stiffness gravity", real=True)
    q, p = coordinates(4)
    A, B, C, D = ends(q, L)
    M = m * sp.kronecker_product(sp.Matrix([[4, 1], [1, 4]]) / 6, sp.eye(2))
    diagonal = sp.sqrt((C - A).dot(C - A))
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        M=M,
        U=m * gamma * (B[1] + C[1]) + k * (diagonal - l0) ** 2 / 2,
        g=[(b - a).dot(b - a) - L**2 for a, b in ((A, B), (B, C), (C, D))],
        parameters={m: mass, L: length, k: stiffness, l0: natural_length, gamma: gravity},
        cases={
            "released": Case(
                q=parallel(-sp.Rational(3, 10), L),
                p=[0] * 4,
                about="released at rest 0.3 rad below the line of all bars: a large vibration",
            ),
            "hanging": Case(q=parallel(-sp.Rational(3, 2), L), p=[0] * 4, about="released at rest near the lower equilibrium"),
        },
        chart=angle(q, p, M, L),
        picture=Picture(
            rods=[[tuple(x) for x in (A, B, C, D)]],
            springs=[(tuple(A), tuple(C))],
            fixed=[tuple(A), tuple(D)],
            points={name: tuple(x) for name, x in zip("ABCD", (A, B, C, D), strict=True)},
        ),
    )


def ends(q: Sequence[Any], length: Any) -> list[sp.Matrix]:
    """Return A, B, C and D."""
    return [sp.zeros(2, 1), sp.Matrix(q[:2]), sp.Matrix(q[2:]), sp.Matrix([length, 0])]


def parallel(theta: Any, length: Any) -> list[sp.Expr]:
    """Return the positions, shape(4,), with A B and D C at an angle from the first axis."""
    x, y = length * sp.cos(theta), length * sp.sin(theta)
    return [x, y, x + length, y]


def angle(q: Sequence[sp.Symbol], p: Sequence[sp.Symbol], M: sp.Matrix, length: sp.Expr) -> Chart:
    """Return the chart of the angle theta of the parallel bars and its rate, p = M q'."""
    theta, rate = sp.symbols("theta theta_rate", real=True)
    place = sp.Matrix(parallel(theta, length))
    along = place.diff(theta)
    turned = sp.Matrix([-q[1], q[0], -q[1], q[0]])
    inertia = sp.simplify((along.T * M * along)[0])
    return Chart(
        eta=(rate,),
        xi=(theta,),
        p=tuple(M * along * rate),
        q=tuple(place),
        # The momenta along the motion: ``turned`` is the derivative of place by theta, written in positions.
        inverse_eta=(turned.dot(sp.Matrix(p)) / inertia,),
        inverse_xi=(sp.atan2(q[1], q[0]),),
    )
