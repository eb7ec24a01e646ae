"""Two beads joined by a rod: the light one on a saddle of fourth degree, the heavy one on a nonlinear spring, under gravity."""

import sympy as sp

from daebench import Case, ConstrainedHamiltonian, Picture


def problem(
    *, mass1: float = 1.0, mass2: float = 4.0, length: float = 1.0, stiffness: float = 5.0, gravity: float = 9.81
) -> ConstrainedHamiltonian:
    """Return the beads, q = (x1, y1, z1, x2, y2, z2); the spring has the energy stiffness r^4 / 4 at the distance r of (0, 0, 1)."""
    m1, m2, l, k = sp.symbols("mass1 mass2 length stiffness", positive=True)
    gamma = sp.Symbol("gravity", real=True)
    q, p = sp.symbols("q1:7", real=True), sp.symbols("p1:7", real=True)
    r2 = q[3] ** 2 + q[4] ** 2 + (q[5] - 1) ** 2

    def height(x, y):
        return sp.Rational(3, 10) * x**2 - sp.Rational(1, 5) * y**2 + sp.Rational(1, 20) * x**4

    x, y = sp.Rational(1, 2), sp.Rational(2, 5)
    first = (x, y, height(x, y))
    second = (first[0], first[1] + l * sp.Rational(3, 5), first[2] - l * sp.Rational(4, 5))
    u, v = sp.Rational(7, 10), sp.Rational(-1, 2)
    sx, sy = sp.Rational(3, 5) * x + sp.Rational(1, 5) * x**3, -sp.Rational(2, 5) * y
    v1 = (u, v, sx * u + sy * v)
    turn = (sp.Rational(1, 2), sp.Rational(4, 5) * sp.Rational(3, 5), sp.Rational(3, 5) * sp.Rational(3, 5))
    v2 = tuple(a + b for a, b in zip(v1, turn))
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        M=sp.diag(m1, m1, m1, m2, m2, m2),
        U=gamma * (m1 * q[2] + m2 * q[5]) + k * r2**2 / 4,
        g=[q[2] - height(q[0], q[1]), (q[3] - q[0]) ** 2 + (q[4] - q[1]) ** 2 + (q[5] - q[2]) ** 2 - l**2],
        parameters={m1: mass1, m2: mass2, l: length, k: stiffness, gamma: gravity},
        cases={"thrown": Case(q=first + second, p=tuple(m1 * a for a in v1) + tuple(m2 * a for a in v2), about="pushed sideways")},
        picture=Picture(masses=[q[:3], q[3:]]),
    )
