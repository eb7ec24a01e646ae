"""Andrews' squeezer: seven bodies in the plane, three loops, a motor against a spring; M(q), and a benchmark of codes for DAEs."""

from collections.abc import Sequence

import sympy as sp

from daebench.systems.constrained import Case, Chart, ConstrainedHamiltonian, Picture, coordinates

Pieces = Sequence[tuple[sp.Expr, sp.Expr]]
"""Lengths and angles of the straight pieces from one point to another."""

xa, ya, xb, yb, xc, yc = map(sp.Rational, ["-.06934", "-.00227", "-.03635", ".03273", ".014", ".072"])
d, da, e, ea, fa, rr, ra = map(sp.Rational, [".028", ".0115", ".02", ".01421", ".01421", ".007", ".00092"])
sa, sb, sc, sd, ss = map(sp.Rational, [".01874", ".01043", ".018", ".02", ".035"])
ta, tb, u, ua, ub, zf, zt = map(sp.Rational, [".02308", ".00916", ".04", ".01228", ".00449", ".02", ".04"])
MASSES = list(map(sp.Rational, [".04325", ".00365", ".02373", ".00706", ".07050", ".00706", ".05498"]))
INERTIAS = list(map(sp.Rational, ["2.194e-6", "4.410e-7", "5.255e-6", "5.667e-7", "1.169e-5", "5.667e-7", "1.912e-5"]))
ORIGIN, A, B, C = (sp.Matrix(pivot) for pivot in ((0, 0), (xa, ya), (xb, yb), (xc, yc)))
RIGHT = sp.pi / 2


def problem(
    *, stiffness: float = 4530.0, rest_length: float = 0.07785, torque: float = 0.033, density: float = 1.0
) -> ConstrainedHamiltonian:
    """Return Andrews' squeezing mechanism in the angles q = (beta, Theta, gamma, Phi, delta, Omega, epsilon).

    Lengths, masses and moments of inertia, in m, kg and kg m^2, are those of Hairer and Wanner, *Solving Ordinary Differential
    Equations II*, section VII.7, under the same names. Three loops close in one point P: the crank 1 with the link 2 leads to it from the
    origin; so does the lever 3 from B, which a spring ties to C; and from A the arms 5 and 4, and 7 and 6.

    ::

        T = density/2 sum_k (mass_k |c_k'|^2 + inertia_k omega_k^2) = 1/2 q'^T M(q) q'   c_k centre of mass, omega_k angular speed
        U = stiffness/2 (|D - C| - rest_length)^2 - torque beta                          D where the spring holds the lever
        g = (P - P_3, P - P_54, P - P_76)                                                P_.. the same point by the lever and the arms

    A constant torque has a potential, so this is a Hamiltonian system, with one degree of freedom and no integral other than H. M depends
    on Theta, Phi and Omega, and couples beta with Theta, Phi with delta, and Omega with epsilon.

    The values printed for t = 0.03 s in the Bari test set have errors of up to 1.4e-9 rad in q, due to a shift of time by 1e-12 s, and of
    up to 1.5e-5 N in lam; the certified reference does not.

    Parameters
    ----------
    stiffness : float
        Stiffness of the spring, c0 of Hairer and Wanner, N/m.
    rest_length : float
        Length of the spring without force, l0, m.
    torque : float
        Torque of the motor on the crank, mom, N m.
    density : float
        Masses and moments of inertia of all bodies, relative to theirs; with 10^4 the same motion takes a hundred times as long.
    """
    c0, l0, rho = sp.symbols("stiffness rest_length density", positive=True)
    mom = sp.Symbol("torque", real=True)
    q, p = coordinates(7)
    M, (P, *ends) = rho * mass_matrix(q), [way[-1] for way in loops(q)]
    spring = hook(q) - C
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        M=M,
        U=c0 / 2 * (sp.sqrt(spring.dot(spring)) - l0) ** 2 - mom * q[0],
        g=[component for end in ends for component in P - end],
        parameters={c0: stiffness, l0: rest_length, mom: torque, rho: density},
        cases={"bari": Case(q=start(), p=(0,) * 7, about="at rest with Theta = 0: Hairer and Wanner, Bari test set, to t = 0.03")},
        chart=crank_angle(q, p, M),
        picture=picture(q),
    )


def loops(q: Sequence[sp.Expr]) -> list[list[sp.Matrix]]:
    """Return the points on the four paths to P: by crank and link, the lever, the arms 5 and 4, and the arms 7 and 6."""
    beta, Theta, gamma, Phi, delta, Omega, epsilon = q
    return [
        way(ORIGIN, [(rr, beta), (-d, beta + Theta)]),
        way(B, [(ss, gamma - RIGHT)]),
        way(A, [(zt, delta), (e, Phi + delta - RIGHT)]),
        way(A, [(u, epsilon - RIGHT), (zf, Omega + epsilon)]),
    ]


def hook(q: Sequence[sp.Expr]) -> sp.Matrix:
    """Return the point D of the lever, shape(2,)."""
    return way(B, [(sc, q[2] - RIGHT), (sd, q[2])])[-1]


def way(base: sp.Matrix, pieces: Pieces) -> list[sp.Matrix]:
    """Return a point and the ends of the straight pieces from it, one after another."""
    points = [base]
    for length, angle in pieces:
        points.append(points[-1] + length * sp.Matrix([sp.cos(angle), sp.sin(angle)]))
    return points


def bodies(q: Sequence[sp.Expr]) -> list[tuple[Pieces, sp.Expr]]:
    """Return for each body the pieces from a fixed point to its centre of mass, and its angle of rotation."""
    beta, Theta, gamma, Phi, delta, Omega, epsilon = q
    return [
        ([(ra, beta)], beta),
        ([(rr, beta), (-da, beta + Theta)], beta + Theta),
        ([(sa, gamma - RIGHT), (sb, gamma)], gamma),
        ([(zt, delta), (e - ea, Phi + delta - RIGHT)], Phi + delta),
        ([(ta, delta), (tb, delta + RIGHT)], delta),
        ([(u, epsilon - RIGHT), (zf - fa, Omega + epsilon)], Omega + epsilon),
        ([(ua, epsilon - RIGHT), (-ub, epsilon)], epsilon),
    ]


def mass_matrix(q: Sequence[sp.Symbol]) -> sp.Matrix:
    """Return M(q) at density 1, shape(7, 7): of |c'|^2, pieces of lengths l, k at angles a, b are the part l k cos(a - b) a' b'."""
    M = sp.zeros(7, 7)
    for (pieces, turned), mass, inertia in zip(bodies(q), MASSES, INERTIAS, strict=True):
        between = sp.Matrix([[first * second * sp.cos(a - b) for second, b in pieces] for first, a in pieces])
        turning, spin = sp.Matrix([angle for _, angle in pieces]).jacobian(q), sp.Matrix([turned]).jacobian(q)
        M += mass * turning.T * between * turning + inertia * spin.T * spin
    return M.expand()


# In closed form, not the published decimals: references need the start to any number of digits.
def start() -> tuple[sp.Expr, ...]:
    """Return the angles, shape(7,), at which the loops are closed with crank and link on one line, Theta = 0."""
    far, near = sp.sqrt(B.dot(B)), d - rr
    beta = sp.atan2(yb, xb) - sp.acos((ss**2 - near**2 - far**2) / (2 * near * far))
    P = way(ORIGIN, [(-near, beta)])[-1]
    return beta, sp.S.Zero, sp.asin((P - B)[0] / ss), *folded(P)


def closed(beta: sp.Expr) -> tuple[sp.Expr, ...]:
    """Return the angles, shape(7,), at which the loops are closed, by that of the crank: smooth functions for any number of turns."""
    lever, link = elbow(way(ORIGIN, [(rr, beta)])[-1] - B, ss, d, -1)
    return beta, link - beta, lever + RIGHT, *folded(way(B, [(ss, lever)])[-1])


def folded(P: sp.Matrix) -> tuple[sp.Expr, ...]:
    """Return Phi, delta, Omega and epsilon by the point P, which stays within reach of the arms."""
    (fifth, fourth), (seventh, sixth) = elbow(P - A, zt, e, 1), elbow(P - A, u, zf, -1)
    return fourth + RIGHT - fifth, fifth, sixth - seventh - RIGHT, seventh + RIGHT


def elbow(tip: sp.Matrix, first: sp.Expr, second: sp.Expr, side: int) -> tuple[sp.Expr, sp.Expr]:
    """Return the angles of two pieces that lead to a tip with x > 0, by the law of cosines; with side 1 the first turns left."""
    r, towards = sp.sqrt(tip.dot(tip)), sp.atan(tip[1] / tip[0])
    before = sp.acos((r**2 + first**2 - second**2) / (2 * r * first))
    after = sp.acos((r**2 + second**2 - first**2) / (2 * r * second))
    return towards + side * before, towards - side * after


def crank_angle(q: Sequence[sp.Symbol], p: Sequence[sp.Symbol], M: sp.Matrix) -> Chart:
    """Return the chart of the crank's angle beta and its rate: q = closed(beta), p = M(q) q', nowhere singular."""
    beta, rate = sp.symbols("beta rate", real=True)
    place = sp.Matrix(closed(beta))
    return Chart(
        eta=(rate,),
        xi=(beta,),
        p=tuple(M.subs(dict(zip(q, place, strict=True))) * place.diff(beta) * rate),
        q=tuple(place),
        # M couples beta with Theta alone, so that a system of two unknowns gives beta' from p.
        inverse_eta=(M[:2, :2].LUsolve(sp.Matrix(p[:2]))[0],),
        inverse_xi=(q[0],),
    )


def picture(q: Sequence[sp.Symbol]) -> Picture:
    """Return the bodies from joint to joint, the lever as a triangle, and the spring; E is P, and the others are its ends."""
    (origin, tip, P), *_, (_, left, _), (_, right, _) = loops(q)
    D = hook(q)
    rods = [(origin, tip), (tip, P), (B, P, D, B), (A, left), (left, P), (A, right), (right, P)]
    named = {"O": ORIGIN, "A": A, "B": B, "C": C, "D": D, "E": P, "F": tip, "G": left, "H": right}
    return Picture(
        rods=[[tuple(point) for point in rod] for rod in rods],
        springs=[(tuple(D), tuple(C))],
        fixed=[tuple(pivot) for pivot in (ORIGIN, A, B, C)],
        points={name: tuple(point) for name, point in named.items()},
    )
