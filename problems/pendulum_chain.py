"""A chain of equal point masses on equal massless rods in the plane: as many constraints as links, each tied to its neighbours."""

import sympy as sp

from daebench.problem import Case, ConstrainedHamiltonian, coordinates
from daebench.problems._links import angles, constraints, mass_matrix, stretched, weight


def problem(*, links: int = 5, mass: float = 1.0, length: float = 1.0, gravity: float = 9.81) -> ConstrainedHamiltonian:
    """Return the chain in Cartesian coordinates, q = (x_1, y_1, ..., x_n, y_n) with y pointing up and the pivot q_0 at the origin.

    ::

        H   = sum_k |p_k|^2 / (2 mass) + mass gravity y_k      g_k = |q_k - q_{k-1}|^2 - length^2,   k = 1, ..., n
        G M^-1 G^T is tridiagonal: with r_k = q_k - q_{k-1},
            (G M^-1 G^T)_{1,1} = 4 |r_1|^2 / mass,   _{k,k} = 8 |r_k|^2 / mass,   _{k,k+1} = -4 r_k . r_{k+1} / mass

    H is the only first integral, unless gravity is 0. Released from the horizontal all masses at first fall freely, for no rod but
    the first turns: q'' = (0, -gravity) and lam = 0. The motion is chaotic: of five links with the default parameters a difference of
    one rounding has grown by e^36.7, to the size of the motion, after about 22 s, which is as far as a double-precision run follows it.

    Parameters
    ----------
    links : int
        Number n of links, and of masses.
    mass : float
        Mass of each point, kg.
    length : float
        Length of each massless rod, m.
    gravity : float
        Gravitational acceleration along -y, m/s^2.
    """
    m, length_ = sp.symbols("mass length", positive=True)
    gamma = sp.Symbol("gravity", real=True)
    q, p = coordinates(2 * links)
    masses, lengths = [m] * links, [length_] * links
    a, rest = sp.Rational(1, 10), (0,) * (2 * links)
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        M=mass_matrix(masses),
        U=weight(q, masses, gamma),
        g=constraints(q, lengths),
        parameters={m: mass, length_: length, gamma: gravity},
        cases={
            "horizontal5": Case(
                q=stretched(lengths, (1, 0)),
                p=rest,
                parameters={"links": 5},
                about="released at rest from the horizontal, five links unless another number is asked for: chaotic",
            ),
            "hanging": Case(
                q=stretched(lengths, (sp.sin(a), -sp.cos(a))),
                p=rest,
                about="released at rest, straight, 0.1 rad from hanging, any number of links: a small swing",
            ),
        },
        chart=angles(q, p, masses, lengths),
    )
