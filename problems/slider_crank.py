"""A crank that drives a slider by a rod: the smallest mechanism, with a non-diagonal mass matrix, which can lock up."""

from collections.abc import Sequence

import sympy as sp

from daebench.systems.constrained import Case, Chart, ConstrainedHamiltonian, Picture, coordinates


def problem(
    *,
    crank: float = 1.0,
    rod: float = 2.0,
    crank_mass: float = 1.0,
    rod_mass: float = 1.0,
    slider_mass: float = 1.0,
    gravity: float = 9.81,
) -> ConstrainedHamiltonian:
    """Return the slider crank, q = (x1, y1, x2) with the crank's tip at (x1, y1), its pivot at the origin and the slider at (x2, 0).

    Crank and rod are uniform rods; one with end velocities v and w has the kinetic energy m/6 (v.v + v.w + w.w).

    ::

        T  = crank_mass/6 (x1'^2 + y1'^2) + rod_mass/6 (x1'^2 + y1'^2 + x1' x2' + x2'^2) + slider_mass/2 x2'^2
        U  = gravity (crank_mass + rod_mass) y1/2
        g1 = x1^2 + y1^2 - crank^2
        g2 = (x1 - x2)^2 + y1^2 - rod^2

    With rod > crank the rank of G is 2 everywhere. With rod = crank it drops to 1 at the lock-up, where the crank is perpendicular to the
    slider's line and rod and crank lie on each other. Two branches meet there: x2 = 2 crank cos(phi) with the crank's angle phi, on which
    the slider continues, and x2 = 0, on which it stays at the pivot while crank and rod turn together. With rod < crank the rank is 2
    again: the crank turns back where the rod is perpendicular, and the slider continues.

    Parameters
    ----------
    crank, rod : float
        Length of the crank and of the rod, m.
    crank_mass, rod_mass, slider_mass : float
        Mass of the crank, of the rod and of the slider, kg.
    gravity : float
        Gravitational acceleration along -y, m/s^2.
    """
    lengths, masses = sp.symbols("crank rod", positive=True), sp.symbols("crank_mass rod_mass slider_mass", positive=True)
    (a, b), (m1, m2, m3), gamma = lengths, masses, sp.Symbol("gravity", real=True)
    q, p = coordinates(3)
    x1, y1, x2 = q
    M = sp.Matrix([[(m1 + m2) / 3, 0, m2 / 6], [0, (m1 + m2) / 3, 0], [m2 / 6, 0, m2 / 3 + m3]])
    stretched, rest = (a, 0, a + b), (0, 0, 0)
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        M=M,
        U=gamma * (m1 + m2) * y1 / 2,
        g=[x1**2 + y1**2 - a**2, (x1 - x2) ** 2 + y1**2 - b**2],
        parameters=dict(zip([*lengths, *masses, gamma], [crank, rod, crank_mass, rod_mass, slider_mass, gravity], strict=True)),
        cases={
            "turning": Case(q=stretched, p=(0, 8 * a * M[1, 1], 0), about="stretched, the crank at 8 rad/s: enough for full turns"),
            "swing": Case(q=stretched, p=rest, about="released at rest, stretched: the crank swings through the lower half turn"),
            "lock_up": Case(
                q=stretched,
                p=rest,
                parameters={"rod": 1.0},
                about="released at rest, stretched, the rod as long as the crank: both are perpendicular at t = 0.8874, where G loses rank",
            ),
        },
        chart=crank_angle(q, p, M, lengths),
        picture=Picture(
            rods=[[(0, 0), (x1, y1)], [(x1, y1), (x2, 0)]],
            masses=[(x2, 0)],
            fixed=[(0, 0)],
            points={"O": (0, 0), "A": (x1, y1), "B": (x2, 0)},
        ),
    )


def crank_angle(q: Sequence[sp.Symbol], p: Sequence[sp.Symbol], M: sp.Matrix, lengths: Sequence[sp.Expr]) -> Chart:
    """Return the chart of the crank's angle phi from the slider's line and its rate omega, for rod > crank nowhere singular.

    ::

        q = (crank cos phi, crank sin phi, crank cos phi + sqrt(rod^2 - crank^2 sin^2 phi))      p = M q'

    With rod = crank it ends at the lock-up, where the square root has a corner: beyond, it is on the branch x2 = 0. With rod < crank it
    ends where the rod is perpendicular.
    """
    phi, omega = sp.symbols("phi omega", real=True)
    a, b = lengths
    x, y = a * sp.cos(phi), a * sp.sin(phi)
    place = sp.Matrix([x, y, x + sp.sqrt(b**2 - y**2)])
    # M couples the crank's tip with the slider, so that its velocity takes all momenta.
    v = M.LUsolve(sp.Matrix(p))
    return Chart(
        eta=(omega,),
        xi=(phi,),
        p=tuple(M * place.diff(phi) * omega),
        q=tuple(place),
        inverse_eta=((q[0] * v[1] - q[1] * v[0]) / a**2,),
        inverse_xi=(sp.atan2(q[1], q[0]),),
    )
