"""A point mass on a sphere under gravity, HLW Example 1.1: the smallest problem on which index reduction loses the two-form."""

from collections.abc import Mapping, Sequence
from typing import Any

import sympy as sp

from daebench.problems._pendulum_motion import in_units, spherical
from daebench.problems._space import ellipsoid
from daebench.systems.constrained import Case, Chart, ConstrainedHamiltonian, Picture, coordinates
from daebench.systems.kinetic_flows import sphere


def problem(*, mass: float = 1.0, length: float = 1.0, gravity: float = 1.0) -> ConstrainedHamiltonian:
    """Return the spherical pendulum, HLW (1.3), in Cartesian coordinates with q3 pointing up.

    ::

        H = |p|^2 / (2 mass) + mass gravity q3,      g = |q|^2 - length^2

    Parameters
    ----------
    mass : float
        Mass of the point, kg.
    length : float
        Length of the massless rod, m.
    gravity : float
        Gravitational acceleration along -q3, m/s^2.
    """
    m, length_ = sp.symbols("mass length", positive=True)
    gamma = sp.Symbol("gravity", real=True)
    q, p = coordinates(3)
    # Exact angles: rounded to doubles the start would be off the sphere, which costs 2e-12 by t = 100.
    a, b = sp.Rational(1, 10), sp.Rational(13, 10)
    surface, over = ellipsoid(length_, length_, length_)
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        M=m * sp.eye(3),
        U=m * gamma * q[2],
        g=[q[0] ** 2 + q[1] ** 2 + q[2] ** 2 - length_**2],
        parameters={m: mass, length_: length, gamma: gravity},
        cases={
            "fig1.1": Case(
                q=(0, sp.sin(a), -sp.cos(a)),
                p=(sp.Rational(6, 100), 0, 0),
                about="HLW Fig. 1.1: a slow swing near the lowest point",
            ),
            "fig1.2": Case(
                q=(sp.sin(b), 0, sp.cos(b)),
                p=(3 * sp.cos(b), sp.Rational(13, 2), -3 * sp.sin(b)),
                about="HLW Fig. 1.2: fast, from the upper half",
            ),
            "fig1.2b": Case(
                q=(sp.sin(b), 0, -sp.cos(b)),
                p=(3 * sp.cos(b), sp.Rational(13, 2), 3 * sp.sin(b)),
                about="as fig1.2 with the other tangent completion: fast, from the lower half",
            ),
        },
        integrals={"L3": q[0] * p[1] - q[1] * p[0]},
        closed_form=closed_form,
        kinetic_flow=sphere(q, p, mass=m, length=length_),
        chart=angles(q, p, mass=m, length=length_),
        picture=Picture(rods=[[(0, 0, 0), q]], masses=[q], fixed=[(0, 0, 0)], surface=surface, over=over),
    )


def angles(q: Sequence[sp.Symbol], p: Sequence[sp.Symbol], *, mass: sp.Expr, length: sp.Expr) -> Chart:
    """Return the chart of angles and their rates: theta from the lowest point, phi about the vertical; singular at both poles.

    ::

        q = length (sin theta cos phi, sin theta sin phi, -cos theta)      p = mass q'
        X^T J X has mass length^2 (1, sin^2 theta) in its block of rates and angles: B(y) is not constant, HLW (2.22)
    """
    theta, phi, omega, turn = sp.symbols("theta phi omega turn", real=True)
    x = length * sp.Matrix([sp.sin(theta) * sp.cos(phi), sp.sin(theta) * sp.sin(phi), -sp.cos(theta)])
    rho = sp.sqrt(q[0] ** 2 + q[1] ** 2)
    across = q[0] * p[0] + q[1] * p[1]
    return Chart(
        eta=(omega, turn),
        xi=(theta, phi),
        p=tuple(mass * (x.diff(theta) * omega + x.diff(phi) * turn)),
        q=tuple(x),
        inverse_eta=((rho * p[2] - q[2] * across / rho) / (mass * length**2), (q[0] * p[1] - q[1] * p[0]) / (mass * rho**2)),
        inverse_xi=(sp.atan2(rho, -q[2]), sp.atan2(q[1], q[0])),
    )


def closed_form(t: Any, q0: Sequence[Any], p0: Sequence[Any], parameters: Mapping[str, Any]) -> tuple[list[Any], list[Any]]:
    """Return the exact state (q, p) at time t, mpmath numbers correct to mpmath's working precision.

    By Jacobi's elliptic functions and elliptic integrals of the third kind; see ``_pendulum_motion.spherical``.

    Parameters
    ----------
    t : number
        Time, s; of either sign.
    q0, p0 : sequence of number, shape(3,)
        State at time 0, on the constraint manifold, with the accuracy that the result should have.
    parameters : mapping of str to number
        mass (kg), length (m) and gravity (m/s^2), all positive.

    Raises
    ------
    BadInput
        If q0 and p0 are off the manifold by more than rounding.
    """
    return in_units(spherical, t, q0, p0, parameters)
