"""A slider crank whose crank is turned by a motor through a prescribed angle: time-dependent constraints, a spring and a damper."""

import sympy as sp

from daebench.systems.constrained import Case, Chart, ConstrainedHamiltonian, Picture, coordinates


def problem(
    *,
    crank: float = 0.5,
    rod: float = 1.5,
    rod_mass: float = 1.0,
    slider_mass: float = 2.0,
    load_mass: float = 1.0,
    stiffness: float = 60.0,
    damping: float = 2.0,
    speed: float = 6.0,
    ripple: float = 0.3,
    gravity: float = 9.81,
) -> ConstrainedHamiltonian:
    """Return the driven slider crank, q = (x1, y1, x2, x3): the crank's tip (x1, y1), the slider (x2, 0) and a load (x3, 0) behind it.

    A motor holds the crank at the angle phi(t) with any torque that is needed. A spring and a damper pull a load along the slider's line.

    ::

        phi(t) = speed t + ripple (1 - cos(speed t))
        T = rod_mass/6 (x1'^2 + y1'^2 + x1' x2' + x2'^2) + slider_mass/2 x2'^2 + load_mass/2 x3'^2
        U = gravity rod_mass y1/2 + stiffness/2 (x3 - x2 - rod)^2        F = -damping (x3' - x2') in x3, and its opposite in x2
        g = (x1 - crank cos phi, y1 - crank sin phi, (x1 - x2)^2 + y1^2 - rod^2)

    The three positions of the mechanism are functions of time, so only the load moves freely: it is a linear oscillator under a known
    force. The multipliers of the first two constraints are the force at the crank's tip.

    Parameters
    ----------
    crank, rod : float
        Length of the crank and of the rod, m; the rod is longer. The spring without force is as long as the rod.
    rod_mass, slider_mass, load_mass : float
        Mass of the uniform rod, of the slider and of the load, kg.
    stiffness : float
        Stiffness of the spring, N/m.
    damping : float
        Damping constant, N s/m.
    speed : float
        Mean angular speed of the crank, rad/s.
    ripple : float
        Amplitude of the angle's deviation from uniform rotation, rad; below 1 the crank turns in one direction.
    gravity : float
        Gravitational acceleration along -y, m/s^2.
    """
    lengths, masses = sp.symbols("crank rod", positive=True), sp.symbols("rod_mass slider_mass load_mass", positive=True)
    k, c, w, r, gamma = others = sp.symbols("stiffness damping speed ripple gravity", real=True)
    (a, b), (m1, m2, m3) = lengths, masses
    q, p, v = (*coordinates(4), sp.symbols("v1:5", real=True))
    t = sp.Symbol("t", real=True)
    x1, y1, x2, x3 = q
    M = sp.Matrix([[m1 / 3, 0, m1 / 6, 0], [0, m1 / 3, 0, 0], [m1 / 6, 0, m1 / 3 + m2, 0], [0, 0, 0, m3]])
    phi = w * t + r * (1 - sp.cos(w * t))
    pull = c * (v[3] - v[2])
    driven = driven_places(phi, a, b)
    # Positions and rates from the driven motion itself, so that the start is consistent for any parameters.
    begin = [place.subs(t, 0) for place in driven]
    rates = [place.diff(t).subs(t, 0) for place in driven]
    values = [crank, rod, rod_mass, slider_mass, load_mass, stiffness, damping, speed, ripple, gravity]
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        t=t,
        v=v,
        M=M,
        U=gamma * m1 * y1 / 2 + k / 2 * (x3 - x2 - b) ** 2,
        force=(0, 0, pull, -pull),
        g=[x1 - a * sp.cos(phi), y1 - a * sp.sin(phi), (x1 - x2) ** 2 + y1**2 - b**2],
        parameters=dict(zip([*lengths, *masses, *others], values, strict=True)),
        cases={
            "turning": Case(
                q=(*begin, a + 2 * b), p=tuple(M * sp.Matrix([*rates, 0])), about="stretched, the load at rest and the spring without force"
            )
        },
        chart=load(q, p, M, t, driven),
        picture=picture(*q),
    )


def picture(x1: sp.Symbol, y1: sp.Symbol, x2: sp.Symbol, x3: sp.Symbol) -> Picture:
    """Return crank, rod, spring and damper, and the joints O, A, B and C that they are between."""
    pivot, A, B, C = (0, 0), (x1, y1), (x2, 0), (x3, 0)
    points = {"O": pivot, "A": A, "B": B, "C": C}
    return Picture(rods=[[pivot, A], [A, B]], springs=[(B, C)], dampers=[(B, C)], masses=[B, C], fixed=[pivot], points=points)


def driven_places(phi: sp.Expr, a: sp.Expr, b: sp.Expr) -> list[sp.Expr]:
    """Return x1, y1 and x2 at an angle of the crank, the slider on the side that it is on when stretched."""
    x, y = a * sp.cos(phi), a * sp.sin(phi)
    return [x, y, x + sp.sqrt(b**2 - y**2)]


def load(q: tuple[sp.Symbol, ...], p: tuple[sp.Symbol, ...], M: sp.Matrix, t: sp.Symbol, driven: list[sp.Expr]) -> Chart:
    """Return the chart of the load's place and velocity, singular nowhere: all else is known."""
    x, rate = sp.symbols("load load_rate", real=True)
    return Chart(
        eta=(rate,),
        xi=(x,),
        p=tuple(M * sp.Matrix([*(place.diff(t) for place in driven), rate])),
        q=(*driven, x),
        inverse_eta=(p[3] / M[3, 3],),
        inverse_xi=(q[3],),
    )
