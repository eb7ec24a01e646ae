"""A point on a circle under a force that has no potential, turned about the centre: exact solution, for codes that solve DAEs."""

from collections.abc import Mapping, Sequence
from typing import Any

import mpmath as mp
import sympy as sp

from daebench.errors import BadInput
from daebench.systems.constrained import Case, Chart, ConstrainedHamiltonian, Picture

OFF = 1e-12
"""Largest distance of a start from the exact one."""


def problem() -> ConstrainedHamiltonian:
    """Return Arevalo's problem: a point of mass 1 on the unit circle, which a force of strength 2 drives clockwise.

    ::

        H = (px^2 + py^2) / 2,      F = (2 y, -2 x),      g = (x^2 + y^2 - 1) / 2
        x = sin t^2,    y = cos t^2,    lam = 4 t^2

    The force is tangent to the circle, so the rate of the angle is 2 t, and the force has put in the energy 2 t^2. The example is
    that of C. Arevalo and P. Lotstedt, *Improving the accuracy of BDF methods for index 3 differential-algebraic equations*, BIT 35 (1995)
    297-308, in the form in which the authors of ``solve_dae`` test codes with it; their multiplier is minus this one.
    """
    q, p, t = sp.symbols("x y", real=True), sp.symbols("px py", real=True), sp.Symbol("t", real=True)
    x, y = q
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        t=t,
        H=(p[0] ** 2 + p[1] ** 2) / 2,
        force=(2 * y, -2 * x),
        # With the half of the published problem, which makes its multiplier comparable; elsewhere distances have no half.
        g=[(x**2 + y**2 - 1) / 2],
        cases={"exact": Case(q=(0, 1), p=(0, 0), about="at rest at (0, 1): x = sin t^2, y = cos t^2")},
        closed_form=closed_form,
        chart=angle(q, p),
        picture=Picture(rods=[[(0, 0), q]], masses=[q], fixed=[(0, 0)]),
    )


def angle(q: Sequence[sp.Symbol], p: Sequence[sp.Symbol]) -> Chart:
    """Return the chart of the angle phi from the second axis, clockwise, and its rate omega, nowhere singular."""
    phi, omega = sp.symbols("phi omega", real=True)
    place = sp.Matrix([sp.sin(phi), sp.cos(phi)])
    return Chart(
        eta=(omega,),
        xi=(phi,),
        p=tuple(place.diff(phi) * omega),
        q=tuple(place),
        inverse_eta=(q[1] * p[0] - q[0] * p[1],),
        inverse_xi=(sp.atan2(q[0], q[1]),),
    )


def closed_form(t: Any, q0: Sequence[Any], p0: Sequence[Any], parameters: Mapping[str, Any]) -> tuple[list[Any], list[Any]]:
    """Return the exact state (q, p) at time t: the angle grows by omega0 t + t^2 from any start on the circle.

    Parameters
    ----------
    t : number
        Time; of either sign.
    q0, p0 : sequence of number, shape(2,)
        State at time 0, on the circle and tangent to it.
    parameters : mapping of str to number
        None.

    Raises
    ------
    BadInput
        If q0 and p0 are off the manifold by more than rounding.
    """
    if abs(q0[0] ** 2 + q0[1] ** 2 - 1) > OFF or abs(q0[0] * p0[0] + q0[1] * p0[1]) > OFF * (1 + abs(p0[0]) + abs(p0[1])):
        raise BadInput("the start is not on the unit circle, or does not move along it; give one that is.", "start-off-unit-circle")
    omega0 = q0[1] * p0[0] - q0[0] * p0[1]
    turned, rate = omega0 * t + t**2, omega0 + 2 * t
    c, s = mp.cos(turned), mp.sin(turned)
    q = [q0[0] * c + q0[1] * s, q0[1] * c - q0[0] * s]
    return q, [rate * q[1], -rate * q[0]]
