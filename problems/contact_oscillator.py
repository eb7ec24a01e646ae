"""A contact oscillator: three oscillators, and a constraint on velocities that couples two of them as the third one swings."""

import sympy as sp

from daebench.systems.constrained import Case, ConstrainedHamiltonian, Picture


def problem(*, perturbation: float = 0.0, momenta: int = 1) -> ConstrainedHamiltonian:
    """Return the contact oscillator, q = (x, y, z): a point in space with unit mass and springs of unit stiffness; in these units.

    ::

        H = (p_x^2 + p_y^2 + (p_z - s sin z)^2) / 2 + (x^2 + y^2 + z^2 + perturbation x^2 z^2) / 2        0 = x' + y z'

    R. McLachlan and M. Perlmutter, J. Nonlinear Sci. 16 (2006) 283-328, section 5.2. The constraint does not act on y, so that its energy,
    the integral ``driver``, is kept beside H. Without a perturbation the motion is integrable: over a period of y the vector (x, z, w) with
    w = sqrt(1 + y^2) z' is turned by a rotation. The motion backward in time is the one with momenta turned round, p -> -p, with
    s = 0. A gradient that is added to the momenta, here that of -s cos z with s = momenta - 1, leaves positions and velocities as they are
    and makes the problem integrable and not reversible. It is one of the test problems of K. Modin and O. Verdier, Numer. Math. 145 (2020)
    405-435. Starts, perturbation and gradient are those of Verdier's program odelab; the printed numbers may differ.

    Parameters
    ----------
    perturbation : float
        Strength of the potential that couples x and z; with it the motion is reversible, but not integrable.
    momenta : int
        1: they are the velocities; 2: a gradient is added to them.
    """
    shift, epsilon = momenta - 1, sp.Symbol("perturbation", real=True)
    q, p = sp.symbols("x y z", real=True), sp.symbols("p_x p_y p_z", real=True)
    v = sp.symbols("v_x v_y v_z", real=True)
    x, y, z = q
    U = (x**2 + y**2 + z**2 + epsilon * x**2 * z**2) / 2
    energy = {"H": (p[0] ** 2 + p[1] ** 2 + (p[2] - shift * sp.sin(z)) ** 2) / 2 + U} if shift else {"M": sp.eye(3), "U": U}
    z0 = sp.sqrt(2) / 10
    x0 = sp.sqrt((2 - z0**2) / (1 + epsilon * z0**2))
    q0, p0 = (x0, 1, z0), (0, 0, shift * sp.sin(z0))
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        v=v,
        g=[],
        velocity=[v[0] + y * v[2]],
        parameters={epsilon: perturbation},
        cases={
            "integrable": Case(q=q0, p=p0, about="from rest, H = 3/2: integrable and reversible"),
            "perturbed": Case(q=q0, p=p0, parameters={"perturbation": 0.3}, about="from rest, H = 3/2: reversible and not integrable"),
        },
        integrals={"driver": (p[1] ** 2 + y**2) / 2},
        picture=Picture(rods=[[(0, 0, 0), q]], masses=[q], fixed=[(0, 0, 0)]),
        **energy,
    )
