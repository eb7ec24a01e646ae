"""Two unequal masses on rods in space, each held by a spring to a fixed point, under gravity: multipliers of both signs."""

import sympy as sp

from daebench import Case, ConstrainedHamiltonian, Picture


def problem(
    *, mass1: float = 1.5, mass2: float = 0.4, length1: float = 1.0, length2: float = 0.7, k1: float = 30.0, k2: float = 9.0
) -> ConstrainedHamiltonian:
    """Return the problem, q = (x1, y1, z1, x2, y2, z2); U = 3 (mass1 z1 + mass2 z2) + k1/2 |r1 - a|^2 + k2/4 |r2 - b|^4."""
    m1, m2, l1, l2, c1, c2 = sp.symbols("mass1 mass2 length1 length2 k1 k2", positive=True)
    q, p = sp.symbols("q1:7", real=True), sp.symbols("p1:7", real=True)
    R = sp.Rational
    first, second = sp.Matrix(q[:3]), sp.Matrix(q[3:])
    a, b = sp.Matrix([0, 0, 2]), sp.Matrix([1, -1, R(1, 2)])
    start = l1 * sp.Matrix([R(3, 5), 0, R(4, 5)])
    rod = l2 * sp.Matrix([0, R(5, 13), R(-12, 13)])
    v1 = sp.Matrix([R(4, 5), R(1, 2), R(-3, 5)])
    v2 = v1 + sp.Matrix([1, R(12, 13), R(5, 13)])
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        M=sp.diag(m1, m1, m1, m2, m2, m2),
        U=3 * (m1 * q[2] + m2 * q[5]) + c1 / 2 * (first - a).dot(first - a) + c2 / 4 * (second - b).dot(second - b) ** 2,
        g=[first.dot(first) - l1**2, (second - first).dot(second - first) - l2**2],
        parameters={m1: mass1, m2: mass2, l1: length1, l2: length2, c1: k1, c2: k2},
        cases={"moving": Case(q=tuple(start) + tuple(start + rod), p=tuple(m1 * v1) + tuple(m2 * v2), about="both masses moving")},
        picture=Picture(masses=[q[:3], q[3:]], rods=[[(0, 0, 0), q[:3], q[3:]]]),
    )
