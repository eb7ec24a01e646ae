"""A knife edge that slides down an incline: a constraint on velocities, and a closed form."""

from collections.abc import Mapping, Sequence
from typing import Any

import mpmath as mp
import sympy as sp

from daebench.systems.constrained import Case, ConstrainedHamiltonian, Picture


def problem(*, mass: float = 1.25, inertia: float = 0.13, gravity: float = 9.81) -> ConstrainedHamiltonian:
    """Return a knife edge on an incline of 45 degrees, q = (x, y, phi): its point of contact moves along the edge only.

    ::

        H = (p_x^2 + p_y^2) / (2 mass) + p_phi^2 / (2 inertia) - mass gravity sin(pi/4) x        0 = sin(phi) x' - cos(phi) y'

    The edge turns at a constant rate omega and, where that is not 0, does not slide down: from rest it moves on a cycloid across the
    incline. ``sliding`` is omega u - gravity sin(pi/4) sin(phi) with the speed u along the edge. The equations are those of A. M. Bloch,
    *Nonholonomic Mechanics and Control*, section 1.6, and the numbers those of the benchmark of ``solve_dae``.

    Parameters
    ----------
    mass : float
        Mass, kg.
    inertia : float
        Moment of inertia about the point of contact, kg m^2.
    gravity : float
        Gravitational acceleration, m/s^2.
    """
    m, theta = sp.symbols("mass inertia", positive=True)
    gamma = sp.Symbol("gravity", real=True)
    q, p = sp.symbols("x y phi", real=True), sp.symbols("p_x p_y p_phi", real=True)
    v = sp.symbols("v_x v_y omega", real=True)
    x, y, phi = q
    down, edge = gamma * sp.sin(sp.pi / 4), (sp.cos(phi), sp.sin(phi))
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        v=v,
        M=sp.diag(m, m, theta),
        U=-m * down * x,
        g=[],
        velocity=[sp.sin(phi) * v[0] - sp.cos(phi) * v[1]],
        parameters={m: mass, theta: inertia, gamma: gravity},
        cases={
            "turning": Case(q=(0, 0, 0), p=(0, 0, theta * sp.pi / 3), about="from rest, turning at pi/3 rad/s; period 6 s"),
            "straight": Case(q=(0, 0, sp.pi / 6), p=(0, 0, 0), about="from rest, without turning: it slides along its edge"),
        },
        integrals={"spin": p[2], "sliding": (p[0] * edge[0] + p[1] * edge[1]) * p[2] / (m * theta) - down * edge[1]},
        closed_form=closed_form,
        picture=Picture(rods=[[(x - edge[0], y - edge[1]), (x + edge[0], y + edge[1])]], masses=[(x, y)]),
    )


def closed_form(t: Any, q0: Sequence[Any], p0: Sequence[Any], parameters: Mapping[str, Any]) -> tuple[list[Any], list[Any]]:
    """Return the exact state (q, p) at time t, from any start on the manifold, mpmath numbers correct to mpmath's working precision.

    ::

        phi = phi0 + omega t      u' = a cos(phi)      x' = u cos(phi)      y' = u sin(phi)      a = gravity sin(pi/4)

    Parameters
    ----------
    t : number
        Time, s; of either sign.
    q0, p0 : sequence of number, shape(3,)
        State at time 0.
    parameters : mapping of str to number
        mass, inertia and gravity.
    """
    with mp.workdps(mp.mp.dps + 15):
        (x, y, start), (p_x, p_y, p_phi), t = map(mp.mpmathify, q0), map(mp.mpmathify, p0), mp.mpmathify(t)
        mass, a = mp.mpmathify(parameters["mass"]), mp.mpmathify(parameters["gravity"]) * mp.sin(mp.pi / 4)
        omega = p_phi / mp.mpmathify(parameters["inertia"])
        phi, c, s = start + omega * t, mp.cos(start), mp.sin(start)
        u = (p_x * c + p_y * s) / mass
        if omega == 0:
            way, end = u * t + a * c * t**2 / 2, u + a * c * t
            q = [x + way * c, y + way * s, phi]
        else:
            rest, C, S = u - a / omega * s, mp.cos(phi), mp.sin(phi)
            x_turned = rest * (S - s) + a / omega * (S**2 - s**2) / 2
            y_turned = rest * (c - C) + a / omega * (omega * t - S * C + s * c) / 2
            q, end = [x + x_turned / omega, y + y_turned / omega, phi], rest + a / omega * S
        p = [mass * end * mp.cos(phi), mass * end * mp.sin(phi), p_phi]
    return [+value for value in q], [+value for value in p]
