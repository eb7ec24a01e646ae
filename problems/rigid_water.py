"""A rigid water molecule, three point masses held at fixed distances, in an electric field and a harmonic well."""

from collections.abc import Sequence

import sympy as sp

from daebench.problems._charts import moving
from daebench.problems._space import angular_momentum, mass_matrix, points
from daebench.systems.constrained import Case, Chart, ConstrainedHamiltonian, Picture, coordinates


def problem(
    *,
    oxygen: float = 15.9994,
    hydrogen: float = 1.008,
    bond: float = 1.0,
    angle: float = 109.47,
    charge: float = 0.41,
    field: float = 25.0,
    stiffness: float = 20.0,
) -> ConstrainedHamiltonian:
    """Return a water molecule as points r_1 (oxygen), r_2 and r_3 (hydrogen) in Cartesian coordinates.

    ::

        H = sum_i |p_i|^2 / (2 mass_i) - field charge (z_2 + z_3 - 2 z_1) + stiffness |r_1|^2 / 2
        g = |r_2 - r_1|^2 - bond^2,   |r_3 - r_1|^2 - bond^2,   |r_3 - r_2|^2 - 2 bond^2 (1 - cos angle)

    Geometry, masses and charges are those of SPC water, Berendsen, Postma, van Gunsteren & Hermans, in *Intermolecular Forces* (Reidel
    1981) 331-342; ``bond=0.9572``, ``angle=104.52`` and ``charge=0.417`` make it TIP3P. The three distances make the triangle rigid, for
    which SETTLE has a closed form (Miyamoto & Kollman, *J. Comput. Chem.* 13 (1992) 952-962) and other codes iterate.

    The field along the third axis turns the dipole, and the well holds the oxygen atom. Rotation and translation are coupled, since the
    centre of mass is not at the oxygen atom. The angular momentum L3 about the axis of the field is conserved.

    Lengths are in Angstrom, masses in u, charges in e and energies in kJ/mol, so that the unit of time is 0.1 ps.

    Parameters
    ----------
    oxygen, hydrogen : float
        Masses of the atoms, u.
    bond : float
        Distance of oxygen and hydrogen, Angstrom.
    angle : float
        Angle between the bonds, degrees.
    charge : float
        Charge of each hydrogen atom, e; that of oxygen is -2 charge.
    field : float
        Electric field along the third axis, kJ/mol/(e Angstrom).
    stiffness : float
        Stiffness of the well of the oxygen atom, kJ/mol/Angstrom^2.
    """
    heavy, light, b, degrees = sp.symbols("oxygen hydrogen bond angle", positive=True)
    e, E, k = sp.symbols("charge field stiffness", real=True)
    q, p = coordinates(9)
    r, M = points(q), mass_matrix([heavy, light, light])
    across, height = sides(b, degrees)
    squares = [(r[j] - r[i]).dot(r[j] - r[i]) for i, j in ((0, 1), (0, 2), (1, 2))]
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        M=M,
        U=k * r[0].dot(r[0]) / 2 - E * e * (r[1][2] + r[2][2] - 2 * r[0][2]),
        # In the order and with the factors that SETTLE expects: see ``rattle_settle``.
        g=[square - x for square, x in zip(squares, (b**2, b**2, 4 * across**2), strict=True)],
        parameters=dict(zip([heavy, light, b, degrees, e, E, k], [oxygen, hydrogen, bond, angle, charge, field, stiffness], strict=True)),
        cases={
            "tumbling": started(
                M, across, height, "0.7", "-0.4", "1.1", ("1", "0.8", "-0.6"), "turning as a whole and swinging in the well"
            ),
            "libration": started(M, across, height, "0.5", "0.2", "0.6", ("0", "0", "0"), "released at rest, at an angle to the field"),
        },
        integrals={"L3": angular_momentum(q, p)["L3"]},
        chart=place_and_attitude(q, p, M, across, height),
        picture=Picture(rods=[[tuple(r[1]), tuple(r[0]), tuple(r[2])]], masses=[tuple(x) for x in r]),
    )


def sides(bond: sp.Expr, degrees: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """Return half the distance of the hydrogen atoms, and the distance of their middle from oxygen."""
    half = sp.pi * degrees / 360
    return bond * sp.sin(half), bond * sp.cos(half)


def atoms(across: sp.Expr, height: sp.Expr) -> list[sp.Matrix]:
    """Return the atoms in the plane of the first two axes, oxygen at the origin and both hydrogen atoms up the second axis."""
    return [sp.zeros(3, 1), sp.Matrix([-across, height, 0]), sp.Matrix([across, height, 0])]


def turned(yaw: sp.Expr, pitch: sp.Expr, roll: sp.Expr) -> sp.Matrix:
    """Return the rotation R3(yaw) R2(pitch) R1(roll)."""
    return sp.rot_ccw_axis3(yaw) * sp.rot_ccw_axis2(pitch) * sp.rot_ccw_axis1(roll)


def started(M: sp.Matrix, across: sp.Expr, height: sp.Expr, yaw: str, pitch: str, roll: str, omega: Sequence[str], about: str) -> Case:
    """Return a case with the oxygen atom at the origin, an attitude in radians, and an angular velocity about the oxygen atom."""
    Q, turning = turned(*map(sp.Rational, (yaw, pitch, roll))), sp.Matrix([sp.Rational(x) for x in omega])
    r = [Q * atom for atom in atoms(across, height)]
    # About oxygen, which starts at rest in the well; the centre of mass then moves.
    v = [a for x in r for a in turning.cross(x)]
    return Case(q=[a for x in r for a in x], p=list(M * sp.Matrix(v)), about=about)


def place_and_attitude(q: Sequence[sp.Symbol], p: Sequence[sp.Symbol], M: sp.Matrix, across: sp.Expr, height: sp.Expr) -> Chart:
    """Return the chart of the place of oxygen and the attitude; it is singular where both hydrogen atoms lie along the third axis.

    ::

        r_i = place + R3(yaw) R2(pitch) R1(roll) atom_i
    """
    place, turns = sp.symbols("place1:4", real=True), sp.symbols("yaw pitch roll", real=True)
    r, Q = points(q), turned(*turns)
    e1 = (r[2] - r[1]) / (2 * across)
    e2 = ((r[1] + r[2]) / 2 - r[0]) / height
    e3 = e1.cross(e2)
    inverse = (*r[0], sp.atan2(e1[1], e1[0]), sp.atan2(-e1[2], sp.sqrt(e1[0] ** 2 + e1[1] ** 2)), sp.atan2(e2[2], e3[2]))
    placed = [sp.Matrix(place) + Q * atom for atom in atoms(across, height)]
    return moving(q, p, M, xi=(*place, *turns), place=[x for atom in placed for x in atom], inverse=inverse)
