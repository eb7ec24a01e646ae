"""A chain of equal point masses on equal massless rods in the plane: as many constraints as links, each coupled to its neighbours."""

import sympy as sp

from daebench.problems._links import angles, drawn
from daebench.systems.chain import ConstrainedChain
from daebench.systems.constrained import Case


def problem(*, links: int = 5, mass: float = 1.0, length: float = 1.0, gravity: float = 9.81) -> ConstrainedChain:
    """Return the chain in Cartesian coordinates, q = (x_1, y_1, ..., x_n, y_n) with y pointing up and the pivot q_0 at the origin.

    ::

        H   = sum_k |p_k|^2 / (2 mass) + mass gravity y_k      g_k = |q_k - q_{k-1}|^2 - length^2,   k = 1, ..., n
        G M^-1 G^T is tridiagonal: with r_k = q_k - q_{k-1},
            (G M^-1 G^T)_{1,1} = 4 |r_1|^2 / mass,   _{k,k} = 8 |r_k|^2 / mass,   _{k,k+1} = -4 r_k . r_{k+1} / mass

    H is the only first integral, unless gravity is 0. Released from the horizontal, all masses at first fall freely, because only the first
    rod turns: q'' = (0, -gravity) and lam = 0. The motion is chaotic: of five links with the default parameters a difference of one
    rounding has grown by e^36.7, to the size of the motion, after about 21 s; one percent is lost after 19 s. No double-precision run
    follows it further.

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
    x, y, x_before, y_before = here_and_before = sp.symbols("x y x_before y_before", real=True)
    k = sp.Symbol("k", integer=True, nonnegative=True)
    a, reach = sp.Rational(1, 10), (k + 1) * length_
    return ConstrainedChain(
        nodes=links,
        here=here_and_before[:2],
        before=here_and_before[2:],
        node=k,
        anchor=(0, 0),
        joints=[(x - x_before) ** 2 + (y - y_before) ** 2 - length_**2],
        mass=m * sp.eye(2),
        pull=gamma,
        U=m * y,
        parameters={m: mass, length_: length, gamma: gravity},
        cases={
            "horizontal5": Case(
                q=(reach, 0),
                p=(0, 0),
                parameters={"links": 5},
                about="released at rest from the horizontal, five links unless another number is asked for: chaotic",
            ),
            "hanging": Case(
                q=(reach * sp.sin(a), -reach * sp.cos(a)),
                p=(0, 0),
                about="released at rest, straight, 0.1 rad from hanging, any number of links: a small swing",
            ),
        },
        # A function, because a chart of thousands of links is never asked for.
        more=lambda q, p: {"chart": angles(q, p, [m] * links, [length_] * links)},
        drawn=drawn,
    )
