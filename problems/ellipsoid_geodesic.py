"""A free point mass on an ellipsoid: Jacobi's geodesics, integrable, of two kinds with an unstable one between them."""

from collections.abc import Sequence

import sympy as sp

from daebench.problems._charts import moving, projected, unit_vector
from daebench.problems._space import ellipsoid
from daebench.systems.constrained import Case, Chart, ConstrainedHamiltonian, Picture, coordinates


def problem(*, mass: float = 1.0, a1: float = 1.8, a2: float = 1.5, a3: float = 0.7) -> ConstrainedHamiltonian:
    """Return the motion along geodesics of the ellipsoid with semi-axes a1 > a2 > a3, in Cartesian coordinates along its axes.

    ::

        H = |p|^2 / (2 mass)      g = q1^2 / a1^2 + q2^2 / a2^2 + q3^2 / a3^2 - 1
        Jacobi's integral  (q1^2 / a1^4 + q2^2 / a2^4 + q3^2 / a3^4) (p1^2 / a1^2 + p2^2 / a2^2 + p3^2 / a3^2)

    C. G. J. Jacobi, *Vorlesungen ueber Dynamik*, 28th lecture; the integral is also called Joachimsthal's. There is no potential: every
    force is a constraint force, and the errors of a method come from its treatment of the surface. The integral is of fourth degree, and no
    method is designed to conserve it; with |p| it determines the kind of the geodesic. Geodesics that cross the ellipse q2 = 0 between
    neighbouring umbilics stay off the ends of either the shortest or the longest axis, round which they wind. Those through an umbilic
    all meet again in the opposite one, half the length of that ellipse away, and are unstable. The umbilics are at
    ``q = (+-a1 s, 0, +-a3 c)`` with ``s^2 = (a1^2 - a2^2) / (a1^2 - a3^2)`` and ``c^2 = 1 - s^2``: s = 3/5 and c = 4/5 with the default
    semi-axes.

    Parameters
    ----------
    mass : float
        Mass of the point, kg.
    a1, a2, a3 : float
        Semi-axes, m; the case ``umbilic`` needs a1 > a2 > a3.
    """
    m, *a = sp.symbols("mass a1:4", positive=True)
    q, p = coordinates(3)
    M = m * sp.eye(3)
    surface, over = ellipsoid(*a)
    steep = sum(x**2 / b**4 for x, b in zip(q, a, strict=True))
    share = sum(y**2 / b**2 for y, b in zip(p, a, strict=True))
    side = (0, a[1], 0)
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        M=M,
        U=sp.Integer(0),
        g=[sum(x**2 / b**2 for x, b in zip(q, a, strict=True)) - 1],
        parameters=dict(zip([m, *a], [mass, a1, a2, a3], strict=True)),
        cases={
            "round_short": Case(
                q=side, p=(m * sp.Rational(4, 5), 0, m * sp.Rational(3, 5)), about="winds round the shortest axis: regular"
            ),
            "round_long": Case(
                q=side, p=(m * sp.Rational(5, 13), 0, m * sp.Rational(12, 13)), about="winds round the longest axis: regular"
            ),
            "umbilic": Case(
                q=umbilic(a), p=(0, m, 0), about="from an umbilic through the opposite one and back, to the ellipse q2 = 0: unstable"
            ),
        },
        integrals={"Jacobi": steep * share},
        chart=projection(q, p, M, a),
        picture=Picture(masses=[q], surface=surface, over=over),
    )


def umbilic(a: Sequence[sp.Expr]) -> tuple[sp.Expr, ...]:
    """Return the umbilic with q1 positive and q3 negative."""
    s2 = (a[0] ** 2 - a[1] ** 2) / (a[0] ** 2 - a[2] ** 2)
    return a[0] * sp.sqrt(s2), sp.Integer(0), -a[2] * sp.sqrt(1 - s2)


def projection(q: Sequence[sp.Symbol], p: Sequence[sp.Symbol], M: sp.Matrix, a: Sequence[sp.Expr]) -> Chart:
    """Return the chart by the stereographic projection of (q1/a1, q2/a2, q3/a3) from (3/5, 0, 4/5), third column of S.

    With the default semi-axes this point is an umbilic, which only geodesics through an umbilic reach.
    """
    # A rotation with rational entries, so that the chart has no roots.
    u, S = sp.symbols("u1:3", real=True), sp.Matrix([[4, 0, 3], [0, 5, 0], [-3, 0, 4]]) / 5
    place = [b * x for b, x in zip(a, unit_vector(u, S), strict=True)]
    return moving(q, p, M, xi=u, place=place, inverse=projected([x / b for b, x in zip(a, q, strict=True)], S))
