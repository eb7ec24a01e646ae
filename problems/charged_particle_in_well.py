"""A charged particle in a nonuniform magnetic field and a potential well: Boris's method does not keep its energy for long."""

import sympy as sp

from daebench.problems._magnetic import energy, with_velocity
from daebench.systems.constrained import Case, ConstrainedHamiltonian, Picture, coordinates


def problem(*, mass: float = 1.0, field: float = 1.0) -> ConstrainedHamiltonian:
    """Return the motion of a unit charge in a magnetic field that grows with the distance from its axis.

    ::

        H = |p - A(q)|^2 / (2 mass) + q1^3 - q2^3 + q1^4 / 5 + q2^4 + q3^4      no constraint
        A = field / 3 R (-q2, q1, 0)      B = field (0, 0, R)      R = sqrt(q1^2 + q2^2)

    After E. Hairer and C. Lubich, BIT 58 (2018) 969: energy is nearly kept by Boris's method in a uniform field, or in a quadratic
    potential; this well and field are neither.

    Parameters
    ----------
    mass : float
        Mass, kg.
    field : float
        Growth of the magnetic field times the charge, kg/(m s).
    """
    m, b = sp.Symbol("mass", positive=True), sp.Symbol("field", real=True)
    q, p = coordinates(3)
    R = sp.sqrt(q[0] ** 2 + q[1] ** 2)
    U = q[0] ** 3 - q[1] ** 3 + q[0] ** 4 / 5 + q[1] ** 4 + q[2] ** 4
    place, v = (0, 1, sp.Rational(1, 10)), (sp.Rational(9, 100), sp.Rational(55, 100), sp.Rational(3, 10))
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        H=energy(q, p, mass=m, turn=b * R / 3) + U,
        g=[],
        parameters={m: mass, b: field},
        cases={"bound": Case(q=place, p=with_velocity(place, v, mass=m, turn=b / 3), about="bound in the well, turning about the axis")},
        picture=Picture(masses=[q]),
    )
