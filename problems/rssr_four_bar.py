"""The RSSR linkage: a crank and a rocker on skew axes, and a coupler between them with a ball at either end."""

from collections.abc import Sequence
from dataclasses import replace

import sympy as sp

from daebench.joints import Mechanism, Plate, Rod, Start
from daebench.problems._linkages import Places, by_angle, followed, located, square, vectors
from daebench.systems.constrained import Chart, ConstrainedHamiltonian

GROUND: Places = {"O": (0, 0, 0), "N": ("0.5", 0, 0), "Q": (2, 2, 0), "R": (2, 2, "0.5")}
POINTS: Places = {"A": (0, "-0.3", "0.4"), "B": (2, "0.5", 0)}


def problem(
    *, crank_mass: float = 1.0, coupler_mass: float = 1.0, rocker_mass: float = 2.0, gravity: float = 9.81
) -> ConstrainedHamiltonian:
    """Return the linkage in natural coordinates, q = (A, B), the balls at the ends of the coupler.

    ::

        crank O N A and rocker Q R B, uniform triangles that turn about the axes O N and Q R at rest      coupler A B, a uniform rod
        g = |A - O|^2 - ..., |A - N|^2 - ..., |B - Q|^2 - ..., |B - R|^2 - ..., |B - A|^2 - ...

    A rod between two balls does not turn about itself, so one degree of freedom remains. The coupler reaches the rocker at all angles of
    the crank: the crank can make full turns.

    Parameters
    ----------
    crank_mass, coupler_mass, rocker_mass : float
        Mass of the crank, the coupler and the rocker, kg.
    gravity : float
        Gravitational acceleration along -z, m/s^2.
    """
    crank, coupler, rocker = sp.symbols("crank_mass coupler_mass rocker_mass", positive=True)
    gamma = sp.Symbol("gravity", real=True)
    linkage = Mechanism(
        ground=GROUND,
        points=POINTS,
        bodies={
            "crank": Plate("O", "N", "A", mass=crank),
            "rocker": Plate("Q", "R", "B", mass=rocker),
            "coupler": Rod("A", "B", mass=coupler),
        },
        gravity=(0, 0, -gamma),
        parameters={crank: crank_mass, coupler: coupler_mass, rocker: rocker_mass, gamma: gravity},
        cases={
            "turning": Start(spin={"crank": (15, 0, 0)}, about="the crank at 15 rad/s: enough for full turns"),
            "swing": Start(about="released at rest, the crank 0.64 rad from upright: it falls and swings"),
        },
    ).problem()
    return replace(linkage, chart=angle(linkage.q, linkage.p, linkage.M))


def angle(q: Sequence[sp.Symbol], p: Sequence[sp.Symbol], M: sp.Matrix) -> Chart:
    """Return the chart of the crank's angle from the vertical and its rate, nowhere singular.

    The rocker's end B moves on a circle in the plane z = 0; the coupler selects the points at its length from A.
    """
    phi = sp.Symbol("phi", real=True)
    at = vectors({**GROUND, **POINTS})
    crank, rocker, coupler = (square(at[one], at[other]) for one, other in ("AO", "BQ", "AB"))
    y, z = -sp.sqrt(crank) * sp.sin(phi), sp.sqrt(crank) * sp.cos(phi)
    # In the plane z = 0 of B the sphere about A is a circle about its foot, of radius^2 coupler - z^2.
    across, up = located([(sp.Matrix([0, y]), coupler - z**2), (sp.Matrix(at["Q"][:2]), rocker)], -1)
    place = [0, y, z, across, up, 0]
    a, b, still = sp.Matrix(q[:3]), sp.Matrix(q[3:]), sp.zeros(3, 1)
    a_rate = sp.Matrix([0, -a[2], a[1]])
    return by_angle(
        p,
        M,
        angle=phi,
        place=place,
        slope=sp.Matrix([*a_rate, *followed(b, [(a, a_rate), (at["Q"], still), (at["R"], still)])]),
        slope_at=sp.Matrix(place).diff(phi),
        angle_of_q=sp.atan2(-q[1], q[2]),
    )
