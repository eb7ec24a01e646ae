"""A bead on the wire y = x^4/4 + x^2/2, a second mass on a rod from it, springs to two fixed points, and gravity."""

import sympy as sp

from daebench import Case, ConstrainedHamiltonian, Picture


def problem(
    *,
    mass1: float = 1.0,
    mass2: float = 2.5,
    length: float = 1.0,
    k1: float = 8.0,
    k2: float = 20.0,
    rest: float = 0.5,
    gravity: float = 9.81,
) -> ConstrainedHamiltonian:
    """Return the problem, q = (x1, y1, x2, y2).

    U = gravity (mass1 y1 + mass2 y2) + k1/2 |r1 - (0, 1)|^2 + k2/2 (|r2 - (2, 0)| - rest)^2
    """
    m1, m2, l, ka, kb, l0 = sp.symbols("mass1 mass2 length k1 k2 rest", positive=True)
    gamma = sp.Symbol("gravity", real=True)
    q, p = sp.symbols("q1:5", real=True), sp.symbols("p1:5", real=True)
    x1, y1, x2, y2 = q
    R = sp.Rational
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        M=sp.diag(m1, m1, m2, m2),
        U=gamma * (m1 * y1 + m2 * y2) + ka / 2 * (x1**2 + (y1 - 1) ** 2) + kb / 2 * (sp.sqrt((x2 - 2) ** 2 + y2**2) - l0) ** 2,
        g=[y1 - x1**4 / 4 - x1**2 / 2, (x2 - x1) ** 2 + (y2 - y1) ** 2 - l**2],
        parameters={m1: mass1, m2: mass2, l: length, ka: k1, kb: k2, l0: rest, gamma: gravity},
        cases={
            "released": Case(q=(1, R(3, 4), 1, R(3, 4) - l), p=(0, 0, 0, 0), about="at rest, the rod hanging"),
            "moving": Case(
                q=(R(1, 2), R(9, 64), R(1, 2) + R(3, 5) * l, R(9, 64) - R(4, 5) * l),
                p=(m1, m1 * R(5, 8), m2 * R(9, 5), m2 * (R(5, 8) + R(3, 5))),
                about="both masses moving",
            ),
        },
        picture=Picture(masses=[(x1, y1), (x2, y2)], rods=[[(x1, y1), (x2, y2)]]),
    )
