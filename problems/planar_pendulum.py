"""A point mass on a circle under gravity: one degree of freedom, and a closed form for comparisons."""

from collections.abc import Mapping, Sequence
from typing import Any

import sympy as sp

from daebench.problems._pendulum_motion import in_units, planar
from daebench.systems.constrained import Case, Chart, ConstrainedHamiltonian, Picture, coordinates
from daebench.systems.kinetic_flows import sphere


def problem(*, mass: float = 1.0, length: float = 1.0, gravity: float = 1.0) -> ConstrainedHamiltonian:
    """Return the planar pendulum in Cartesian coordinates with q2 pointing up.

    ::

        H = |p|^2 / (2 mass) + mass gravity q2,      g = |q|^2 - length^2

    Parameters
    ----------
    mass : float
        Mass of the point, kg.
    length : float
        Length of the massless rod, m.
    gravity : float
        Gravitational acceleration along -q2, m/s^2.
    """
    m, length_ = sp.symbols("mass length", positive=True)
    gamma = sp.Symbol("gravity", real=True)
    q, p = coordinates(2)
    near = sp.Rational(1, 1000)
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        M=m * sp.eye(2),
        U=m * gamma * q[1],
        g=[q[0] ** 2 + q[1] ** 2 - length_**2],
        parameters={m: mass, length_: length, gamma: gravity},
        cases={
            "horizontal": Case(q=(1, 0), p=(0, 0), about="released at rest from the horizontal"),
            "near_top": Case(q=(sp.sin(near), sp.cos(near)), p=(0, 0), about="at rest, 1e-3 rad from the unstable equilibrium"),
            "rotating": Case(q=(0, -1), p=(sp.Rational(5, 2), 0), about="through the lowest point fast enough to go round"),
            # The gravity is that of the benchmark; the other cases keep 1, so that their period is near 2 pi.
            "iftomm_a01": Case(
                q=(-1, 0),
                p=(0, 0),
                parameters={"gravity": 9.81},
                about="IFToMM benchmark A01: released at rest from the horizontal, gravity 9.81",
            ),
        },
        closed_form=closed_form,
        kinetic_flow=sphere(q, p, mass=m, length=length_),
        chart=angle(q, p, mass=m, length=length_),
        picture=Picture(rods=[[(0, 0), q]], masses=[q], fixed=[(0, 0)]),
    )


def angle(q: Sequence[sp.Symbol], p: Sequence[sp.Symbol], *, mass: sp.Expr, length: sp.Expr) -> Chart:
    """Return the chart of the angle theta from the lowest point and its rate omega, nowhere singular.

    ::

        q = length (sin theta, -cos theta)      p = mass q'      X^T J X = mass length^2 J: with one angle, B is constant
    """
    theta, omega = sp.symbols("theta omega", real=True)
    x = length * sp.Matrix([sp.sin(theta), -sp.cos(theta)])
    return Chart(
        eta=(omega,),
        xi=(theta,),
        p=tuple(mass * x.diff(theta) * omega),
        q=tuple(x),
        inverse_eta=((q[0] * p[1] - q[1] * p[0]) / (mass * length**2),),
        inverse_xi=(sp.atan2(q[0], -q[1]),),
    )


def closed_form(t: Any, q0: Sequence[Any], p0: Sequence[Any], parameters: Mapping[str, Any]) -> tuple[list[Any], list[Any]]:
    """Return the exact state (q, p) at time t, mpmath numbers correct to mpmath's working precision.

    By Jacobi's elliptic functions; see ``_pendulum_motion.planar``.

    Parameters
    ----------
    t : number
        Time, s; of either sign.
    q0, p0 : sequence of number, shape(2,)
        State at time 0, on the constraint manifold, with the accuracy that the result should have.
    parameters : mapping of str to number
        mass (kg), length (m) and gravity (m/s^2), all positive.

    Raises
    ------
    BadInput
        If q0 and p0 are off the manifold by more than rounding.
    """
    return in_units(planar, t, q0, p0, parameters)
