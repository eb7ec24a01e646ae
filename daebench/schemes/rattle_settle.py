"""RATTLE with SETTLE: the constraints of a rigid water molecule in closed form."""

from daebench.schemes.kernels.claims import WATER, Claims, Member
from daebench.schemes.kernels.language import CONSTRAINTS, G, H_p, mass, multiplier, norm, sqrt, squares
from daebench.schemes.kernels.newton import linear
from daebench.schemes.kernels.rattle_step import CHOICES, choices, rattle_step
from daebench.schemes.kernels.spaces import Jacobian, Multiplier, Number, Report, Rows, Step, Vector

Space = tuple[Number, Number, Number]
Plane = tuple[Number, Number]

CLAIMS = Claims(
    order=2,
    symmetric=True,
    symplectic=True,
    keeps_g=True,
    keeps_Gv=True,
    system="constrained",
    source="Miyamoto and Kollman, J. Comput. Chem. 13 (1992) 952-962; HLW (1.25)",
    separable_only=True,
    constraints=WATER,
)
MEMBERS = {
    "rattle_settle": Member(
        claims=CLAIMS,
        numbers=choices,
        options=CHOICES,
        multipliers=lambda: {"lam_n": 0.0, "mu_n": 1.0},
    ),
}


def cross(x: Space, y: Space) -> Space:
    """Return x cross y."""
    return x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]


def along(x: Space, y: Space) -> Number:
    """Return x^T y."""
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]


def unit(x: Space) -> Space:
    """Return x / |x|."""
    w = 1.0 / sqrt(along(x, x))
    return w * x[0], w * x[1], w * x[2]


def bonds(q: Vector) -> tuple[Space, Space]:
    """Return the positions of both hydrogen atoms relative to oxygen."""
    return (q[3] - q[0], q[4] - q[1], q[5] - q[2]), (q[6] - q[0], q[7] - q[1], q[8] - q[2])


def place(b0: Plane, c0: Plane, a1z: Number, b1: Space, c1: Space, sizes: Space) -> tuple[Plane, Plane]:
    """Return the displacements of both hydrogen atoms in the old plane of the molecule that restore the distances.

    ``sizes`` are ra, rb and rc: the distances of oxygen and of the middle of the hydrogen atoms from the centre of mass, and half of the
    distance of these.
    """
    ra, rb, rc = sizes
    sin_phi = a1z * (1.0 / ra)
    # The positive roots throughout: a molecule turns by less than 90 degrees in a step. A step too large makes a root NaN.
    cos_phi = sqrt(1.0 - sin_phi * sin_phi)
    sin_psi = (b1[2] - c1[2]) * (0.5 / rc) / cos_phi
    cos_psi = sqrt(1.0 - sin_psi * sin_psi)
    x = -rc * cos_psi
    tilt = rc * sin_psi * sin_phi
    b2, c2 = -rb * cos_phi - tilt, -rb * cos_phi + tilt
    alpha = x * (b0[0] - c0[0]) + b0[1] * b2 + c0[1] * c2
    beta = x * (c0[1] - b0[1]) + b0[0] * b2 + c0[0] * c2
    gamma = b0[0] * b1[1] - b1[0] * b0[1] + c0[0] * c1[1] - c1[0] * c0[1]
    total = alpha * alpha + beta * beta
    sin_theta = (alpha * gamma - beta * sqrt(total - gamma * gamma)) / total
    cos_theta = sqrt(1.0 - sin_theta * sin_theta)
    b_moved = (x * cos_theta - b2 * sin_theta - b1[0], x * sin_theta + b2 * cos_theta - b1[1])
    c_moved = (-x * cos_theta - c2 * sin_theta - c1[0], -x * sin_theta + c2 * cos_theta - c1[1])
    return b_moved, c_moved


def multipliers(b0: Plane, c0: Plane, b_moved: Plane, c_moved: Plane, mass_H: Number) -> Multiplier:
    """Return the nu that give these displacements of the hydrogen atoms: mass_H times that is -2 nu_1 b0 - 2 nu_3 (b0 - c0), and so on."""
    x, y = b0[0] - c0[0], b0[1] - c0[1]
    w = mass_H / (2.0 * (b0[0] * c0[1] - b0[1] * c0[0]))
    first = w * (b_moved[0] * y - b_moved[1] * x)
    second = w * (c_moved[0] * y - c_moved[1] * x)
    return three(first, second, -w * (b_moved[0] * b0[1] - b_moved[1] * b0[0]))


def three(first: Number, second: Number, third: Number) -> Multiplier:
    """Return the multiplier of these entries."""
    return multiplier(first if k == 0 else second if k == 1 else third for k in range(CONSTRAINTS))


def solve_positions(p0: Vector, q0: Vector, dq: Vector, G0: Jacobian, V: Rows) -> tuple[Vector, Multiplier, Report]:
    """Return dq - V^T nu with g(q0 + dq - V^T nu) = 0, nu and a report."""
    M, square = mass(p0, q0), squares(q0)
    b0, c0 = bonds(q0)
    b, c = bonds(q0 + dq)
    height, rc = sqrt(square[0] - square[2] / 4), sqrt(square[2]) / 2
    part = M[3][3] / (M[0][0] + 2.0 * M[3][3])
    a1 = (-part * (b[0] + c[0]), -part * (b[1] + c[1]), -part * (b[2] + c[2]))
    b1, c1 = (b[0] + a1[0], b[1] + a1[1], b[2] + a1[2]), (c[0] + a1[0], c[1] + a1[1], c[2] + a1[2])
    Z = unit(cross(b0, c0))
    X = unit(cross(a1, Z))
    Y = cross(Z, X)
    b_flat, c_flat = (along(X, b0), along(Y, b0)), (along(X, c0), along(Y, c0))
    b_here, c_here = (along(X, b1), along(Y, b1), along(Z, b1)), (along(X, c1), along(Y, c1), along(Z, c1))
    sizes = (2.0 * part * height, (1.0 - 2.0 * part) * height, rc)
    b_moved, c_moved = place(b_flat, c_flat, along(Z, a1), b_here, c_here, sizes)
    nu = multipliers(b_flat, c_flat, b_moved, c_moved, M[3][3])
    # A closed form has no pivots; a root of a negative number shows as NaN in nu, and so in the report.
    return dq - H_p(G0.T @ nu, q0), nu, linear(1.0, norm(nu))


def solve_momenta(p: Vector, q: Vector) -> tuple[Vector, Multiplier, Report]:
    """Return n = G(q)^T mu such that G M^-1 (p - n) = 0, mu and a report."""
    M, G1, square = mass(p, q), G(q), squares(q)
    value = G1 @ H_p(p, q)
    w_O, w_H = 4.0 / M[0][0], 4.0 / M[3][3]
    same, other = (w_O + w_H) * square[0], w_O * (square[0] - square[2] / 2)
    edge, edge_H = w_H * square[2] / 2, 2.0 * w_H * square[2]
    total = value[0] + value[1]
    w = 1.0 / ((same + other) * edge_H - 2.0 * edge * edge)
    half_sum = (edge_H * total / 2 - edge * value[2]) * w
    half_difference = (value[0] - value[1]) * (0.5 / (same - other))
    mu = three(half_sum + half_difference, half_sum - half_difference, ((same + other) * value[2] - edge * total) * w)
    return G1.T @ mu, mu, linear(1.0, norm(mu))


def increment(p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1 - p0, q1 - q0, lam and mu, and a report.

    The step is :func:`daebench.schemes.kernels.rattle_step.rattle_step`. The forces of the constraints lie in the plane of the old
    molecule, with normal Z: heights over it are unchanged, and determine the angles phi and psi of inclination of the new molecule. The
    angle theta of rotation about Z follows from the total moment of those forces, which is zero::

        sin phi = a1z / ra,      sin psi = (b1z - c1z) / (2 rc cos phi),      alpha sin theta + beta cos theta = gamma

    with the letters of Miyamoto and Kollman, *J. Comput. Chem.* 13 (1992): a is oxygen, b and c are hydrogen, 0 is before, 1 is without
    constraints, seen from the centre of mass; X is normal to Z and to a1. Positions are relative to oxygen, and the centre of mass enters
    only through them, so that rounding is relative to distances. The multipliers nu follow from the displacements of the hydrogen atoms.
    Momenta are projected by the 3 by 3 system of the same paper, whose matrix G M^-1 G^T is that of a rigid triangle::

        [s  o  e] mu_1         s = 4 d^2 (1/m_O + 1/m_H),     o = 4 (d^2 - d_H^2 / 2) / m_O
        [o  s  e] mu_2 = G v   e = 2 d_H^2 / m_H,             f = 8 d_H^2 / m_H
        [e  e  f] mu_3
    """
    return rattle_step(solve_positions, solve_momenta, p0, q0, h)
