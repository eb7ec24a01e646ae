"""A point mass on a torus under gravity: a constraint that is not quadratic, on a surface with angles that have no pole."""

import sympy as sp

from daebench.problems._charts import moving
from daebench.systems.constrained import Case, ConstrainedHamiltonian, Picture, coordinates


def problem(*, mass: float = 1.0, radius: float = 2.0, tube: float = 1.0, gravity: float = 1.0) -> ConstrainedHamiltonian:
    """Return motion on the torus whose axis is vertical, in Cartesian coordinates with q3 pointing up and the centre at the origin.

    ::

        H = |p|^2 / (2 mass) + mass gravity q3      g = (rho - radius)^2 + q3^2 - tube^2      rho = sqrt(q1^2 + q2^2)

    With the angles theta round the tube, from the outermost circle upwards, and phi about the axis, the angular momentum
    L3 = mass rho^2 phi' is conserved, and theta moves with one degree of freedom,

    ::

        mass tube^2 theta'^2 / 2 + L3^2 / (2 mass rho^2) + mass gravity tube sin theta = H      rho = radius + tube cos theta

    On the inner half the surface is saddle-shaped and geodesics diverge; the innermost circle is an unstable geodesic. G is not linear in
    q, so this problem reveals properties that hold only for spheres and rods: g along a straight line is not a parabola.

    Parameters
    ----------
    mass : float
        Mass of the point, kg.
    radius, tube : float
        Radius of the circle in the middle of the tube, and that of the tube, which is less, m.
    gravity : float
        Gravitational acceleration along -q3, m/s^2.
    """
    m, big, small = sp.symbols("mass radius tube", positive=True)
    gamma = sp.Symbol("gravity", real=True)
    q, p = coordinates(3)
    theta, phi = sp.symbols("theta phi", real=True)
    rho, M = sp.sqrt(q[0] ** 2 + q[1] ** 2), m * sp.eye(3)
    reach = big + small * sp.cos(theta)
    lowest, near = (big, 0, -small), sp.Rational(1, 1000)

    def pushed(outwards: str, along: str) -> tuple[sp.Expr, ...]:
        """Return the momentum on the lowest circle with theta' = outwards and phi' = along (rad/s)."""
        return m * small * sp.Rational(outwards), m * big * sp.Rational(along), sp.Integer(0)

    surface = reach * sp.cos(phi), reach * sp.sin(phi), small * sp.sin(theta)
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        M=M,
        U=m * gamma * q[2],
        g=[(rho - big) ** 2 + q[2] ** 2 - small**2],
        parameters={m: mass, big: radius, small: tube, gamma: gravity},
        cases={
            "through_hole": Case(
                q=lowest,
                p=pushed("2.5", "0.5"),
                about="from the lowest circle fast enough to go over the top and through the hole, again and again",
            ),
            "trough": Case(q=lowest, p=pushed("0.3", "0.6"), about="round the axis, and slowly up and down near the lowest circle"),
            "inner": Case(
                q=(big - small * sp.cos(near), 0, small * sp.sin(near)),
                p=(0, m * (big - small * sp.cos(near)), 0),
                # Without gravity, so that the innermost circle is a geodesic.
                parameters={"gravity": 0.0},
                about="no gravity, along the innermost circle and 1e-3 rad beside it: leaves an unstable geodesic and returns to it",
            ),
        },
        integrals={"L3": q[0] * p[1] - q[1] * p[0]},
        chart=moving(q, p, M, xi=(theta, phi), place=surface, inverse=(sp.atan2(q[2], rho - big), sp.atan2(q[1], q[0]))),
        picture=Picture(masses=[q], surface=surface, over=[(theta, 0, 2 * sp.pi), (phi, 0, 2 * sp.pi)]),
    )
