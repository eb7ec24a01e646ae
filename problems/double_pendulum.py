"""Two point masses, one hung from the other, in the plane: the smallest chaotic problem, with two constraints that share one mass."""

import sympy as sp

from daebench.problems._links import angles, constraints, drawn, mass_matrix, stretched, weight
from daebench.systems.constrained import Case, ConstrainedHamiltonian, coordinates


def problem(
    *, mass1: float = 1.0, mass2: float = 1.0, length1: float = 1.0, length2: float = 1.0, gravity: float = 9.81
) -> ConstrainedHamiltonian:
    """Return the double pendulum in Cartesian coordinates, q = (x1, y1, x2, y2) with y pointing up and the pivot at the origin.

    ::

        H  = |p_1|^2 / (2 mass1) + |p_2|^2 / (2 mass2) + gravity (mass1 y1 + mass2 y2)
        g1 = x1^2 + y1^2 - length1^2
        g2 = (x2 - x1)^2 + (y2 - y1)^2 - length2^2

    H is the only first integral, unless gravity is 0. Released from the horizontal the motion is chaotic: with the default parameters
    a difference of one rounding has grown by e^36.7, to the size of the motion, after about 40 s. No double-precision run follows it
    for longer. From ``swing`` it is regular: in 400 s a small difference grows less than threefold.

    Parameters
    ----------
    mass1, mass2 : float
        Mass of the upper and of the lower point, kg.
    length1, length2 : float
        Length of the massless rod from the pivot to the upper point, and from there to the lower one, m.
    gravity : float
        Gravitational acceleration along -y, m/s^2.
    """
    masses, lengths = sp.symbols("mass1 mass2", positive=True), sp.symbols("length1 length2", positive=True)
    gamma = sp.Symbol("gravity", real=True)
    q, p = coordinates(4)
    # Exact, so that references can start on the manifold to any number of digits.
    a = sp.Rational(1, 10)
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        M=mass_matrix(masses),
        U=weight(q, masses, gamma),
        g=constraints(q, lengths),
        parameters=dict(zip([*masses, *lengths, gamma], [mass1, mass2, length1, length2, gravity], strict=True)),
        cases={
            "horizontal": Case(q=stretched(lengths, (1, 0)), p=(0, 0, 0, 0), about="released at rest from the horizontal: chaotic"),
            "swing": Case(
                q=stretched(lengths, (sp.sin(a), -sp.cos(a))),
                p=(0, 0, 0, 0),
                about="released at rest, straight, 0.1 rad from hanging: a regular swing",
            ),
        },
        chart=angles(q, p, masses, lengths),
        picture=drawn(q),
    )
