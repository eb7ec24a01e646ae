"""Cyclohexane, a ring of six united atoms with rigid bonds and angles: the chair is rigid, and the boat has a redundant constraint."""

from collections.abc import Sequence

import sympy as sp

from daebench.problems._space import angular_momentum, mass_matrix, points
from daebench.systems.constrained import Case, ConstrainedHamiltonian, Picture, coordinates

ATOMS = 6


def problem(
    *,
    methylene: float = 14.027,
    bond: float = 1.53,
    angle: float = 109.47,
    C0: float = 9.28,
    C1: float = 12.16,
    C2: float = -13.12,
    C3: float = -3.06,
    C4: float = 26.24,
    C5: float = -31.50,
) -> ConstrainedHamiltonian:
    """Return cyclohexane without its hydrogen atoms, (CH2)6, as points r_1, ..., r_6 in Cartesian coordinates.

    ::

        H = sum_i |p_i|^2 / (2 methylene) + sum over the six bonds of sum_k C_k cos(phi)^k
        g = |r_{i+1} - r_i|^2 - bond^2,   |r_{i+2} - r_i|^2 - 2 bond^2 (1 - cos angle),   i = 1, ..., 6, indices modulo 6
        cos(phi) = (|r_{i+3} - r_i|^2 - bond^2 (1 - 2 cos angle)^2) / (2 bond^2 sin(angle)^2) - 1

    The twelve distances are the edges of an octahedron. In the chair they are independent and leave the six degrees of freedom of a rigid
    body. The boat is one of Bricard's flexible octahedra (*J. Math. Pures Appl.* 3 (1897) 113-150), symmetric under a half turn: G has rank
    11 along the whole motion, one constraint is redundant, and the boat moves round the ring from atom to atom, which is called
    pseudorotation (Hazebroek and Oosterhoff, *Discuss. Faraday Soc.* 10 (1951) 87-93). The start determines the form of a motion.

    Opposite torsions are equal, as they have the same outer atoms. Their potential is that of butane, by Ryckaert & Bellemans, *Chem. Phys.
    Lett.* 30 (1975) 123-125, with phi = 0 in trans. Total momentum P and angular momentum L about the origin are conserved.

    Lengths are in Angstrom, masses in u and energies in kJ/mol, so that the unit of time is 0.1 ps: t = 10 is a picosecond.

    Parameters
    ----------
    methylene : float
        Mass of each atom, u.
    bond : float
        Length of the bonds, Angstrom.
    angle : float
        Angle between neighbouring bonds, degrees.
    C0, C1, C2, C3, C4, C5 : float
        Coefficients of the torsion potential, kJ/mol.
    """
    mass, b, degrees = sp.symbols("methylene bond angle", positive=True)
    C = sp.symbols("C0:6", real=True)
    q, p = coordinates(3 * ATOMS)
    r, cosine = points(q), sp.cos(sp.pi * degrees / 180)
    sides = b**2, 2 * b**2 * (1 - cosine)
    cosines = [(distance(r, i, i + 3) - b**2 * (1 - 2 * cosine) ** 2) / (2 * b**2 * (1 - cosine**2)) - 1 for i in range(3)]
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        M=mass_matrix([mass] * ATOMS),
        # Twice three: opposite torsions have the same outer atoms, and so the same cosine.
        U=2 * sum(c * x**k for x in cosines for k, c in enumerate(C)),
        g=[distance(r, i, i + 1) - sides[0] for i in range(ATOMS)] + [distance(r, i, i + 2) - sides[1] for i in range(ATOMS)],
        parameters=dict(zip([mass, b, degrees, *C], [methylene, bond, angle, C0, C1, C2, C3, C4, C5], strict=True)),
        cases={
            "boat": flexible(sides, b, "9/10", "released at rest near the boat: pseudorotation, with a redundant constraint"),
            "twist": flexible(sides, b, "3/4", "released at rest near the twisted boat: swings about it, with a redundant constraint"),
            "chair": Case(
                q=[a for x in chair(*sides) for a in x],
                p=[mass * a for x in chair(*sides) for a in sp.Matrix([sp.Rational(3, 10), 0, sp.Rational(1, 5)]).cross(x)],
                about="the rigid chair, rotating",
            ),
        },
        integrals={**{f"P{k + 1}": sum(p[k::3]) for k in range(3)}, **angular_momentum(q, p)},
        picture=Picture(rods=[[tuple(x) for x in [*r, r[0]]]], masses=[tuple(x) for x in r]),
    )


def distance(r: Sequence[sp.Matrix], i: int, j: int) -> sp.Expr:
    """Return |r_j - r_i|^2 of atoms counted round the ring."""
    step = r[j % ATOMS] - r[i]
    return step.dot(step)


def chair(first: sp.Expr, second: sp.Expr) -> list[sp.Matrix]:
    """Return atoms by turns above and below a plane, for these squares of the distances of neighbours and of next neighbours."""
    radius, height = sp.sqrt(second / 3), sp.sqrt(first - second / 3) / 2
    at = [sp.pi * i / 3 for i in range(ATOMS)]
    return [sp.Matrix([radius * sp.cos(a), radius * sp.sin(a), (-1) ** i * height]) for i, a in enumerate(at)]


def flexible(sides: tuple[sp.Expr, sp.Expr], bond: sp.Expr, part: str, about: str) -> Case:
    """Return a case at rest, with the first atom at a distance from the axis whose square is a part of bond^2: from 0.7 to 0.9."""
    q = [a for x in boat(*sides, sp.Rational(part) * bond**2) for a in x]
    return Case(q=q, p=[0] * len(q), about=about, on_singular="least-squares")


def boat(first: sp.Expr, second: sp.Expr, A: sp.Expr) -> list[sp.Matrix]:
    """Return atoms of which opposite ones are exchanged by a half turn about the third axis, of which the first has the distance sqrt(A).

    ::

        r_i = (e_i, z_i),  r_{i+3} = (-e_i, z_i),     s = (second + first)/2,   k = (second - first)/4
        e_1.e_2 = e_2.e_3 = -e_1.e_3 = k        |e_i|^2 + |e_j|^2 + (z_i - z_j)^2 = s
        |e_i|^2 are the roots of  x^3 - S x^2 + (s S - 3 s^2/4) x - 2 k^3 - k^2 S,   with any S
    """
    s, k = (second + first) / 2, (second - first) / 4
    # S is chosen so that A is a root; the two others follow from a quadratic equation.
    S = (A**3 - 3 * s**2 * A / 4 - 2 * k**3) / (A**2 - s * A + k**2)
    half = (S - A) / 2
    root = sp.sqrt(half**2 - (2 * k**3 + k**2 * S) / A)
    B, C = half + root, half - root
    c, d = k / sp.sqrt(A * B), -k / sp.sqrt(A * C)
    e = [(1, 0), (c, sp.sqrt(1 - c**2)), (d, sp.sqrt(1 - d**2))]
    z = (0, sp.sqrt(s - A - B), sp.sqrt(s - A - C))
    up = [sp.Matrix([sp.sqrt(x) * a, sp.sqrt(x) * b, height]) for x, (a, b), height in zip((A, B, C), e, z, strict=True)]
    return [*up, *(sp.diag(-1, -1, 1) * x for x in up)]
