"""Watt's six-bar linkage: two loops of rods and triangles in the plane, and one degree of freedom."""

from collections.abc import Sequence
from dataclasses import replace

import sympy as sp

from daebench.joints import Mechanism, Plate, Rod, Start
from daebench.problems._linkages import Places, by_angle, dot, followed, located, square, vectors
from daebench.systems.constrained import Chart, ConstrainedHamiltonian

GROUND: Places = {"O": (0, 0), "Q": (4, 0)}
POINTS: Places = {"A": ("0.6", "0.8"), "B": ("3.4", "2.7"), "C": ("0.3", "1.4"), "D": ("1.6", "2.2"), "E": ("0.6", "2.9")}


def problem(
    *, crank_mass: float = 1.0, coupler_mass: float = 2.0, rocker_mass: float = 1.0, link_mass: float = 0.5, gravity: float = 9.81
) -> ConstrainedHamiltonian:
    """Return the linkage in natural coordinates, q = (A, B, E).

    ::

        crank O A C and coupler A B D, uniform triangles       rocker Q B, links C E and E D, uniform rods       O, Q at rest
        g = |A - O|^2 - 1, |B - A|^2 - ..., |B - Q|^2 - ..., |E - C|^2 - ..., |E - D|^2 - ...      C, D: linear in A, B

    The crank is the shortest of the four bars O A, A B, B Q, Q O, and its sum with the longest is less than the sum of the other two: it
    makes full turns (Grashof), and the second loop C E D closes at all its angles.

    Parameters
    ----------
    crank_mass, coupler_mass, rocker_mass : float
        Mass of the crank, the coupler and the rocker, kg.
    link_mass : float
        Mass of each of the two links, kg.
    gravity : float
        Gravitational acceleration along -y, m/s^2.
    """
    crank, coupler, rocker, link = sp.symbols("crank_mass coupler_mass rocker_mass link_mass", positive=True)
    gamma = sp.Symbol("gravity", real=True)
    linkage = Mechanism(
        ground=GROUND,
        points=POINTS,
        bodies={
            "crank": Plate("O", "A", "C", mass=crank),
            "coupler": Plate("A", "B", "D", mass=coupler),
            "rocker": Rod("Q", "B", mass=rocker),
            "first link": Rod("C", "E", mass=link),
            "second link": Rod("E", "D", mass=link),
        },
        gravity=(0, -gamma),
        parameters={crank: crank_mass, coupler: coupler_mass, rocker: rocker_mass, link: link_mass, gamma: gravity},
        cases={
            "turning": Start(spin={"crank": 12}, about="the crank at 12 rad/s: enough for full turns"),
            "swing": Start(about="released at rest: the linkage falls and swings"),
        },
    ).problem()
    return replace(linkage, chart=angle(linkage.q, linkage.p, linkage.M))


def angle(q: Sequence[sp.Symbol], p: Sequence[sp.Symbol], M: sp.Matrix) -> Chart:
    """Return the chart of the angle beta from the crank to the coupler, and its rate.

    Relative to the crank, it determines B and D, and these determine Q and E, each by an intersection of two circles. The linkage is then
    rotated so that Q is in its place.
    """
    beta = sp.Symbol("beta", real=True)
    at = vectors({**GROUND, **POINTS})
    crank = sp.Matrix([1, 0])
    b = crank + sp.sqrt(square(at["A"], at["B"])) * sp.Matrix([sp.cos(beta), sp.sin(beta)])
    c, d = carried(at["C"], at["O"], at["A"], at["O"], crank), carried(at["D"], at["A"], at["B"], crank, b)
    pivot = located([(at["O"], square(at["O"], at["Q"])), (b, square(at["Q"], at["B"]))], -1)
    e = located([(c, square(at["C"], at["E"])), (d, square(at["D"], at["E"]))], 1)
    # Rotated by cosine and sine of the pivot's direction, so that no angle, and no branch of one, is needed.
    turned = [(dot(point, pivot), pivot[0] * point[1] - pivot[1] * point[0]) for point in (crank, b, e)]
    place = [x / at["Q"][0] for point in turned for x in point]
    return by_angle(
        p,
        M,
        angle=beta,
        place=place,
        slope=slope(q),
        slope_at=sp.Matrix(place).diff(beta),
        angle_of_q=sp.atan2(q[0] * q[3] - q[1] * q[2], q[0] * (q[2] - q[0]) + q[1] * (q[3] - q[1])),
    )


def slope(q: Sequence[sp.Symbol]) -> sp.Matrix:
    """Return dq/dbeta: the velocities of A, B and E divided by the angular velocity of the coupler relative to the crank."""
    at = vectors({**GROUND, **POINTS})
    a, b, e = (sp.Matrix(q[k : k + 2]) for k in (0, 2, 4))
    a_rate = sp.Matrix([-a[1], a[0]])
    b_rate = followed(b, [(a, a_rate), (at["Q"], at["O"])])
    of_crank, of_coupler = (at["C"], at["O"], at["A"], at["O"]), (at["D"], at["A"], at["B"])
    anchors = [(carried(*of_crank, a), carried(*of_crank, a_rate))]
    anchors.append((carried(*of_coupler, a, b), carried(*of_coupler, a_rate, b_rate)))
    leg, turning = b - a, b_rate - a_rate
    # Less 1, the rate of the crank: velocities above are those for a crank that turns at 1 rad/s.
    against = (leg[0] * turning[1] - leg[1] * turning[0]) / square(at["A"], at["B"]) - 1
    return sp.Matrix([*a_rate, *b_rate, *followed(e, anchors)]) / against


def carried(x: sp.Matrix, a: sp.Matrix, b: sp.Matrix, a_now: sp.Matrix, b_now: sp.Matrix) -> sp.Matrix:
    """Return the position of a point x of a body from the positions of its points a and b, or its velocity from theirs."""
    leg, to, now = b - a, x - a, b_now - a_now
    along, aside = dot(leg, to) / dot(leg, leg), (leg[0] * to[1] - leg[1] * to[0]) / dot(leg, leg)
    return a_now + along * now + aside * sp.Matrix([-now[1], now[0]])
