"""A knife edge that slides down an incline: a constraint on velocities, and a closed form."""

import sympy as sp

from daebench.systems.constrained import Case, ConstrainedHamiltonian


def problem(*, mass: float = 1.25, inertia: float = 0.13, gravity: float = 9.81) -> ConstrainedHamiltonian:
    """Return a knife edge on an incline of 45 degrees, q = (x, y, phi): its point of contact moves along the edge only.

    ::

        H = (p_x^2 + p_y^2) / (2 mass) + p_phi^2 / (2 inertia) - mass gravity sin(pi/4) x        0 = sin(phi) x' - cos(phi) y'

    Parameters
    ----------
    mass : float
        Mass, kg.
    inertia : float
        Moment of inertia about the point of contact, kg m^2.
    gravity : float
        Gravitational acceleration, m/s^2.
    """
    m, theta = sp.symbols("mass inertia", positive=True)
    gamma = sp.Symbol("gravity", real=True)
    q, p = sp.symbols("x y phi", real=True), sp.symbols("p_x p_y p_phi", real=True)
    v = sp.symbols("v_x v_y omega", real=True)
    x, _, phi = q
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        v=v,
        M=sp.diag(m, m, theta),
        U=-m * gamma * sp.sin(sp.pi / 4) * x,
        g=[],
        velocity=[sp.sin(phi) * v[0] - sp.cos(phi) * v[1]],
        parameters={m: mass, theta: inertia, gamma: gravity},
        cases={"turning": Case(q=(0, 0, 0), p=(0, 0, theta * sp.pi / 3), about="from rest, turning at pi/3 rad/s")},
    )
