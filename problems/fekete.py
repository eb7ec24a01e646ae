"""Points that repel each other on a sphere and come to rest by damping: elliptic Fekete points, and a large benchmark of DAE codes."""

import sympy as sp

from daebench.problems._charts import moving, projected, unit_vector
from daebench.problems._space import points as points_of
from daebench.systems.constrained import Case, Chart, ConstrainedHamiltonian, Picture, coordinates

RINGS = [(3, (3, 8), 13, 1), (7, (1, 8), 29, 1), (6, (-2, 15), 7, 1), (4, (-3, 10), 17, 0)]
"""For each ring: number of points, latitude as a fraction of pi, pi over the shift of the first longitude, and index of its first point."""

CHARTED = 8
"""Largest number of points with a chart: the chart of twenty points takes too long to derive."""


def problem(*, points: int = 20, damping: float = 0.5) -> ConstrainedHamiltonian:
    """Return the Fekete problem: n points p_i of mass 1 on the unit sphere, q = (p_1, ..., p_n), each coordinate damped.

    ::

        H = |p|^2 / 2 - sum_{i < j} ln |p_i - p_j|      F = -damping p      g_i = |p_i|^2 - 1

    The points come to rest where the product of their distances is largest, and all multipliers are then (n - 1)/4, for any start.
    A problem by J. D. Pinter, W. J. H. Stortelder and J. J. B. de Swart, *Computation of elliptic Fekete point sets*, CWI Quarterly 12
    (1999) 63-76, in F. Mazzia and C. Magherini, *Test Set for Initial Value Problem Solvers*, release 2.4 (Bari, 2008), whose
    multipliers are minus these. The derivation and compilation for twenty points takes about a minute, once. Then ``ida:index2`` reaches t
    = 1000 in a fraction of a second; with a tolerance of 1e-9 it agrees with the positions published there within 1e-8.

    Parameters
    ----------
    points : int
        Number of points, at least 2.
    damping : float
        Force over speed, kg/s.
    """
    alpha = sp.Symbol("damping", real=True)
    q, p = coordinates(3 * points)
    v = sp.symbols(f"v1:{3 * points + 1}", real=True)
    r = points_of(q)
    pairs = [(r[i] - r[j]).dot(r[i] - r[j]) for i in range(points) for j in range(i)]
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        v=v,
        # Without evaluation: SymPy takes ten seconds to search the 190 logarithms of twenty points for factors, and finds none.
        H=sp.Add(*(x**2 / 2 for x in p), *(-sp.log(square, evaluate=False) / 2 for square in pairs)),
        force=tuple(-alpha * x for x in v),
        g=[x.dot(x) - 1 for x in r],
        parameters={alpha: damping},
        cases=cases(points),
        chart=projections(q, p) if points <= CHARTED else None,
        picture=Picture(masses=[tuple(x) for x in r]),
    )


def cases(n: int) -> dict[str, Case]:
    """Return a start on a spiral for any number of points, and the start on four rings where there are twenty."""
    rest = (0,) * (3 * n)
    spiral = [at(sp.pi * sp.Rational(10 * i, 13), sp.asin(1 - sp.Rational(2 * i + 1, n))) for i in range(n)]
    about = "at rest on a spiral, four points unless another number is asked for: they come to rest in a tetrahedron"
    # Four points by default: a kernel for twenty takes about a minute to compile.
    several = {"spiral": Case(q=[x for point in spiral for x in point], p=rest, parameters={"points": 4}, about=about)}
    rings = [at(*place) for ring in RINGS for place in on_ring(*ring)]
    if n == len(rings):
        about = "at rest on four rings, twenty points: Bari test set, to t = 1000"
        several["bari"] = Case(q=[x for point in rings for x in point], p=rest, about=about)
    return several


def on_ring(count: int, latitude: tuple[int, int], shift: int, first: int) -> list[tuple[sp.Expr, sp.Expr]]:
    """Return the longitudes and latitudes of points at equal distances."""
    return [(2 * sp.pi * sp.Rational(k, count) + sp.pi / shift, sp.pi * sp.Rational(*latitude)) for k in range(first, first + count)]


def at(longitude: sp.Expr, latitude: sp.Expr) -> list[sp.Expr]:
    """Return the point of the unit sphere at a longitude and a latitude."""
    c = sp.cos(latitude)
    return [sp.cos(longitude) * c, sp.sin(longitude) * c, sp.sin(latitude)]


def projections(q: tuple[sp.Symbol, ...], p: tuple[sp.Symbol, ...]) -> Chart:
    """Return the chart by the stereographic projection of each point from (-1, -2, 2)/3, third column of S.

    From the spiral of four no point comes within 58 degrees of it.
    """
    S = sp.Matrix([[2, 2, -1], [-2, 1, -2], [-1, 2, 2]]) / 3
    u = sp.symbols(f"u1:{2 * len(q) // 3 + 1}", real=True)
    place = [x for k in range(0, len(u), 2) for x in unit_vector(u[k : k + 2], S)]
    return moving(q, p, sp.eye(len(q)), xi=u, place=place, inverse=[x for point in points_of(q) for x in projected(point, S)])
