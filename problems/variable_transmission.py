"""A continuously variable transmission: a pendulum sets the ratio at which two oscillators move."""

import sympy as sp

from daebench.systems.constrained import Case, ConstrainedHamiltonian, Picture


def problem(*, asymmetry: float = 0.0, coupling: float = 0.0) -> ConstrainedHamiltonian:
    """Return a transmission that a pendulum drives, q = (x, y, z): places of two oscillators x and z, and the pendulum's angle y.

    ::

        H = |p|^2 / 2 + (x^2 + z^2 + coupling x^2 z^2) / 2 - cos y + asymmetry sin(2 y) / 2        0 = x' + sin(y) z'

    All masses, stiffnesses, lengths and the gravitational acceleration are 1. The constraint does not act on y, so that the pendulum's
    energy, the integral ``driver``, is kept beside H. Without coupling the motion is integrable: over a period of y the vector (x, z, w)
    with w = sqrt(1 + sin(y)^2) z' is turned by a rotation.

    Turning the momenta round leads back along every motion. It takes the orbit of a pendulum that swings to itself, but that of one that
    turns over to the one that turns the other way. Where the potential of the pendulum is even, there is another map that leads back,
    (x, y, z, p_x, p_y, p_z) -> (-x, -y, z, p_x, p_y, -p_z), and it takes this orbit to itself. With an asymmetry neither does.

    The kind of problem is that of K. Modin and O. Verdier, Numer. Math. 145 (2020) 405-435. The numbers are our own.

    Parameters
    ----------
    asymmetry : float
        Part of the pendulum's potential that is odd in its angle.
    coupling : float
        Strength of the potential that couples x and z; with it the motion is not integrable.
    """
    epsilon, kappa = sp.symbols("asymmetry coupling", real=True)
    q, p = sp.symbols("x y z", real=True), sp.symbols("p_x p_y p_z", real=True)
    v = sp.symbols("v_x v_y v_z", real=True)
    x, y, z = q
    pendulum = -sp.cos(y) + epsilon * sp.sin(2 * y) / 2
    q0, turning = (1, 0, 1), (0, sp.Rational(5, 2), 0)
    bob, on_x, on_z = (sp.sin(y), -sp.cos(y)), (x, sp.Rational(3, 2)), (z, sp.Rational(5, 2))
    walls = [(-3, on_x[1]), (-3, on_z[1])]
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        v=v,
        M=sp.eye(3),
        U=(x**2 + z**2 + kappa * x**2 * z**2) / 2 + pendulum,
        g=[],
        velocity=[v[0] + sp.sin(y) * v[2]],
        parameters={epsilon: asymmetry, kappa: coupling},
        cases={
            "even": Case(q=q0, p=turning, about="the pendulum turns over in an even potential: integrable and reversible"),
            "coupled": Case(
                q=q0, p=turning, parameters={"coupling": 1.0}, about="the same with coupled oscillators: reversible, not integrable"
            ),
            "uneven": Case(
                q=q0, p=turning, parameters={"asymmetry": 0.5}, about="it turns over in an uneven one: integrable, not reversible"
            ),
            "uneven_coupled": Case(
                q=q0, p=turning, parameters={"asymmetry": 0.5, "coupling": 1.0}, about="both: neither reversible nor integrable"
            ),
            "swinging": Case(q=q0, p=(0, 1, 0), parameters={"asymmetry": 0.5}, about="it swings in the uneven one: reversible"),
        },
        integrals={"driver": p[1] ** 2 / 2 + pendulum},
        picture=Picture(
            rods=[[(0, 0), bob]], masses=[bob, on_x, on_z], fixed=[(0, 0), *walls], springs=list(zip(walls, (on_x, on_z), strict=True))
        ),
    )
