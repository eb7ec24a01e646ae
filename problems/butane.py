"""Butane, four united atoms with rigid bonds and angles: the molecule of the SHAKE paper, which is flexible only about its middle bond."""

from collections.abc import Sequence

import sympy as sp

from daebench.problems._charts import moving
from daebench.problems._space import angular_momentum, mass_matrix, points
from daebench.systems.constrained import Case, Chart, ConstrainedHamiltonian, Picture, coordinates


def problem(
    *,
    methyl: float = 15.035,
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
    """Return n-butane without its hydrogen atoms, CH3-CH2-CH2-CH3, as points r_1, ..., r_4 in Cartesian coordinates.

    ::

        H = sum_i |p_i|^2 / (2 mass_i) + sum_k C_k cos(phi)^k
        g = |r_{i+1} - r_i|^2 - bond^2,   i = 1, 2, 3,    and    |r_{i+2} - r_i|^2 - 2 bond^2 (1 - cos angle),   i = 1, 2
        cos(phi) = (|r_4 - r_1|^2 - bond^2 (1 - 2 cos angle)^2) / (2 bond^2 sin(angle)^2) - 1

    The molecule is the one of Ryckaert, Ciccotti & Berendsen, *J. Comput. Phys.* 23 (1977) 327-341, the paper that introduced SHAKE; the
    potential is by Ryckaert & Bellemans, *Chem. Phys. Lett.* 30 (1975) 123-125. The angles are fixed as distances, so that each triangle of
    neighbours is rigid and all five multipliers are coupled. The torsion phi is 0 in trans; with rigid bonds and angles its cosine is
    linear in the squared distance of the outer atoms. Off the manifold this function differs from the cosine of the angle between two
    planes, so the multipliers are not the same, but the motion is.

    Total momentum P and angular momentum L about the origin are conserved, and from rest the torsion alone determines the positions of all
    atoms. It has wells in trans and, higher by 2.93 kJ/mol, at two gauche positions 120 degrees off, between barriers of 12.35
    (trans-gauche) and 44.8 kJ/mol (cis). A molecule that turns as a whole couples its torsion to its rotation.

    Lengths are in Angstrom, masses in u and energies in kJ/mol, so that the unit of time is 0.1 ps: t = 10 is a picosecond.

    Parameters
    ----------
    methyl, methylene : float
        Masses of the outer and of the inner atoms, u.
    bond : float
        Length of the bonds, Angstrom.
    angle : float
        Angle between neighbouring bonds, degrees.
    C0, C1, C2, C3, C4, C5 : float
        Coefficients of the torsion potential, kJ/mol.
    """
    outer, inner, b, degrees = sp.symbols("methyl methylene bond angle", positive=True)
    # Not positive, as masses and lengths are: some coefficients are negative.
    C = sp.symbols("C0:6", real=True)
    q, p = coordinates(12)
    r, M = points(q), mass_matrix([outer, inner, inner, outer])
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        M=M,
        U=sum(c * torsion_cosine(r, b, degrees) ** k for k, c in enumerate(C)),
        g=[distance(r, i, i + 1) - b**2 for i in range(3)] + [distance(r, i, i + 2) - 2 * b**2 * (1 - cosine(degrees)) for i in range(2)],
        parameters=dict(zip([outer, inner, b, degrees, *C], [methyl, methylene, bond, angle, C0, C1, C2, C3, C4, C5], strict=True)),
        cases=cases(b, degrees, [outer, inner, inner, outer]),
        integrals={**{f"P{k + 1}": sum(p[k::3]) for k in range(3)}, **angular_momentum(q, p)},
        chart=triangle_and_torsion(q, p, M, b, degrees),
        picture=Picture(rods=[[tuple(x) for x in r]], masses=[tuple(x) for x in r]),
    )


def cosine(degrees: sp.Expr) -> sp.Expr:
    """Return the cosine of an angle in degrees."""
    return sp.cos(sp.pi * degrees / 180)


def distance(r: Sequence[sp.Matrix], i: int, j: int) -> sp.Expr:
    """Return |r_j - r_i|^2."""
    return (r[j] - r[i]).dot(r[j] - r[i])


def torsion_cosine(r: Sequence[sp.Matrix], b: sp.Expr, degrees: sp.Expr) -> sp.Expr:
    """Return cos(phi), 1 in trans, where the constraints hold."""
    along, off = steps(b, degrees)
    return (distance(r, 0, 3) - (b + 2 * along) ** 2) / (2 * off**2) - 1


def steps(b: sp.Expr, degrees: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """Return the components of a bond along the next one and perpendicular to it."""
    return -b * cosine(degrees), b * sp.sin(sp.pi * degrees / 180)


def atoms(b: sp.Expr, degrees: sp.Expr, torsion: sp.Expr) -> list[sp.Matrix]:
    """Return the atoms with the second at the origin, the third on the first axis, and the first in the plane of the first two axes."""
    along, off = steps(b, degrees)
    last = sp.Matrix([b + along, -off * sp.cos(torsion), -off * sp.sin(torsion)])
    return [sp.Matrix([-along, off, 0]), sp.zeros(3, 1), sp.Matrix([b, 0, 0]), last]


def cases(b: sp.Expr, degrees: sp.Expr, masses: Sequence[sp.Expr]) -> dict[str, Case]:
    """Return cases with the centre of mass at rest: three released at rest, and one that turns as a whole."""

    def started(torsion: str, about: str, omega: Sequence[str] = ("0", "0", "0")) -> Case:
        r = atoms(b, degrees, sp.Rational(torsion))
        # The centre of mass is at rest, so that the total momentum is zero.
        centre = sum((m * x for m, x in zip(masses, r, strict=True)), sp.zeros(3, 1)) / sum(masses)
        turning = sp.Matrix([sp.Rational(x) for x in omega])
        p = [m * turning.cross(x - centre) for m, x in zip(masses, r, strict=True)]
        return Case(q=[a for x in r for a in x], p=[a for x in p for a in x], about=about)

    return {
        "trans": started("0.5", "released at a torsion of 0.5 rad: swings about trans"),
        "gauche": started("2.4", "released at a torsion of 2.4 rad: caught in a gauche well"),
        "crossing": started("3", "released near cis, at 3 rad: over both trans-gauche barriers and back"),
        "tumbling": started("2.5", "over the barriers with little to spare, and turning as a whole", ("0.3", "0.05", "0.2")),
    }


def triangle_and_torsion(q: Sequence[sp.Symbol], p: Sequence[sp.Symbol], M: sp.Matrix, b: sp.Expr, degrees: sp.Expr) -> Chart:
    """Return the chart of the place of the second atom, the attitude of the rigid triangle of the first three, and the torsion.

    ::

        r_i = place + R3(yaw) R2(pitch) R1(roll) atom_i(torsion)

    It is singular where the middle bond is parallel to the third axis.
    """
    place, turns = sp.symbols("place1:4", real=True), sp.symbols("yaw pitch roll torsion", real=True)
    yaw, pitch, roll, torsion = turns
    Q = sp.rot_ccw_axis3(yaw) * sp.rot_ccw_axis2(pitch) * sp.rot_ccw_axis1(roll)
    along, off = steps(b, degrees)
    r = points(q)
    first, last = r[0] - r[1], r[3] - r[2]
    e1 = (r[2] - r[1]) / b
    e2 = (first + along * e1) / off
    e3 = e1.cross(e2)
    inverse = (
        *r[1],
        sp.atan2(e1[1], e1[0]),
        sp.atan2(-e1[2], sp.sqrt(e1[0] ** 2 + e1[1] ** 2)),
        sp.atan2(e2[2], e3[2]),
        sp.atan2(-last.dot(e3), -last.dot(e2)),
    )
    placed = [sp.Matrix(place) + Q * atom for atom in atoms(b, degrees, torsion)]
    return moving(q, p, M, xi=(*place, *turns), place=[x for atom in placed for x in atom], inverse=inverse)
