"""A point mass on a spring under gravity: at the resonance 2:1 the energy goes from springing to swinging and back."""

import sympy as sp

from daebench.systems.constrained import Case, ConstrainedHamiltonian, Picture, coordinates
from daebench.systems.kinetic_flows import free


def problem(*, mass: float = 1.0, length: float = 1.0, gravity: float = 1.0, stiffness: float = 3.0) -> ConstrainedHamiltonian:
    """Return the elastic pendulum in the plane, in Cartesian coordinates with q2 pointing up.

    ::

        H = |p|^2 / (2 mass) + mass gravity q2 + stiffness (|q| - length)^2 / 2      no constraint

    A. Vitt and G. Gorelik, Zh. Tekh. Fiz. 3 (1933) 294. At rest the spring is as long as L = length + mass gravity / stiffness. Springing
    has the frequency sqrt(stiffness / mass), swinging sqrt(gravity / L); the first is twice the second where stiffness is 3 mass gravity /
    length, as by default. The stiffer the spring, the nearer the motion is to that of ``planar_pendulum``, which has a rod.

    Parameters
    ----------
    mass : float
        Mass of the point, kg.
    length : float
        Length of the spring without a force, m.
    gravity : float
        Gravitational acceleration along -q2, m/s^2.
    stiffness : float
        Stiffness of the spring, N/m.
    """
    m, rest, gamma, k = sp.symbols("mass length gravity stiffness", positive=True)
    q, p = coordinates(2)
    L = rest + m * gamma / k
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        M=m * sp.eye(2),
        U=m * gamma * q[1] + k * (sp.sqrt(q[0] ** 2 + q[1] ** 2) - rest) ** 2 / 2,
        g=[],
        parameters={m: mass, rest: length, gamma: gravity, k: stiffness},
        cases={
            "springing": Case(q=(L / 100, -L - rest / 5), p=(0, 0), about="pulled down and a little aside: springing becomes swinging"),
            "stiff": Case(q=(rest, 0), p=(0, 0), parameters={"stiffness": 1e4}, about="a stiff spring, released from the horizontal"),
        },
        kinetic_flow=free(q, p, mass=m),
        picture=Picture(rods=[[(0, 0), q]], masses=[q], fixed=[(0, 0)]),
    )
