"""Euler's equations of the free rigid body, HLW VII.5: a Lie-Poisson system on spheres, solved by elliptic functions."""

from collections.abc import Mapping, Sequence
from itertools import permutations
from typing import Any

import sympy as sp

from daebench.problems._rigid_body_motion import euler
from daebench.problems._rotations import hat, turned
from daebench.problems.rigid_body_rotation import turning
from daebench.systems.picture import Picture
from daebench.systems.poisson import DarbouxMap, Lift, Part, PoissonCase, PoissonSystem

State = Sequence[sp.Expr]


def problem(*, I1: float = 0.6, I2: float = 0.8, I3: float = 1.0) -> PoissonSystem:
    """Return Euler's equations in the angular momentum y, seen from the body.

    ::

        y' = y x I^-1 y = B(y) grad H(y)      B = hat(y)      H = 1/2 sum y_i^2/I_i      C = 1/2 |y|^2

    Splittings: ``123`` and the other five orders of the rotations T_i = y_i^2/(2 I_i) about the axes; and ``top``, the symmetric top S with
    I1 in place of I2, which rotates y about axis 3, and the remaining rotation R about axis 2.

    Parameters
    ----------
    I1, I2, I3 : float
        Principal moments of inertia, kg m^2, positive.
    """
    y, moments = sp.symbols("y1:4", real=True), sp.symbols("I1:4", positive=True)
    e1, e2, e3 = (1 / moment for moment in moments)
    tilt, small = sp.Rational(11, 10), sp.Rational(1, 1000)
    return PoissonSystem(
        y=y,
        B=hat(y),
        H=kinetic(y, moments),
        casimirs={"C": kinetic(y, (1, 1, 1))},
        parameters=dict(zip(moments, (I1, I2, I3), strict=True)),
        cases={
            "hlw": PoissonCase(y=(sp.cos(tilt), 0, sp.sin(tilt)), about="HLW's body: about axis 3, that of the largest moment"),
            "middle": PoissonCase(y=(sp.sin(small), sp.cos(small), 0), about="1e-3 rad from the unstable middle axis: it turns over"),
            "separatrix": PoissonCase(
                y=(sp.sqrt((e2 - e3) / (e1 - e3)), 0, sp.sqrt((e1 - e2) / (e1 - e3))),
                about="the separatrix: tends to the middle axis and never leaves it; for I1 < I2 < I3",
            ),
            "symmetric": PoissonCase(
                y=(sp.cos(tilt), 0, sp.sin(tilt)),
                parameters={"I1": 0.8, "I2": 0.8},
                about="the symmetric top: even precession about axis 3",
            ),
        },
        closed_form=closed_form,
        parts=parts(y, moments),
        # All orders: the error of a splitting depends on which rotation comes first.
        splittings={"".join(order): tuple(f"T{axis}" for axis in order) for order in permutations("123")} | {"top": ("R", "S")},
        darboux=longitude(y),
        lift=rotation(y, moments),
        picture=on_unit_sphere(y, ("y1", "y2", "y3")),
    )


def on_unit_sphere(direction: State, axes: Sequence[str]) -> Picture:
    """Return a picture of a vector of length one, from the origin to the unit sphere."""
    theta, phi = sp.symbols("theta phi", real=True)
    surface = (sp.sin(theta) * sp.cos(phi), sp.sin(theta) * sp.sin(phi), -sp.cos(theta))
    over = [(theta, 0, sp.pi), (phi, 0, 2 * sp.pi)]
    return Picture(rods=[[(0, 0, 0), direction]], masses=[direction], fixed=[(0, 0, 0)], surface=surface, over=over, axes=axes)


def kinetic(y: State, moments: State) -> sp.Expr:
    """Return the kinetic energy 1/2 sum y_i^2/I_i."""
    return sp.Add(*(component**2 / moment for component, moment in zip(y, moments, strict=True))) / 2


def parts(y: State, moments: State) -> dict[str, Part]:
    """Return the rotations T1, T2, T3, the symmetric top S and the rotation R that makes it the body.

    The energy of the top is a Casimir function plus (1/I3 - 1/I1) y3^2/2, so its flow also rotates y about axis 3.
    """
    t = sp.Symbol("t", real=True)
    e = [1 / moment for moment in moments]
    named_parts = {f"T{i + 1}": Part(H=e[i] * y[i] ** 2 / 2, t=t, y=turned(y, i, e[i] * y[i] * t)) for i in range(3)}
    named_parts["R"] = Part(H=(e[1] - e[0]) * y[1] ** 2 / 2, t=t, y=turned(y, 1, (e[1] - e[0]) * y[1] * t))
    named_parts["S"] = Part(H=kinetic(y, [moments[0], moments[0], moments[2]]), t=t, y=turned(y, 2, (e[2] - e[0]) * y[2] * t))
    return named_parts


def longitude(y: State) -> DarbouxMap:
    """Return the longitude Q about axis 3, its momentum P = y3 and the length C.

    ::

        y = (sqrt(C^2 - P^2) sin Q, sqrt(C^2 - P^2) cos Q, P)      {Q, P} = 1

    They are canonical except at the poles y1 = y2 = 0, which are equilibria, so no other motion reaches them. The inverse holds on the
    whole space. In floating point they lose eps/sin^2 of the angle to axis 3: all digits within 1e-8 of a pole.
    """
    q, p, c = sp.symbols("Q P C", real=True)
    across = sp.sqrt(c**2 - p**2)
    return DarbouxMap(
        q=(q,),
        p=(p,),
        c=(c,),
        # atan2 of (y1, y2), not (y2, y1): with this order {Q, P} is +1.
        Q=(sp.atan2(y[0], y[1]),),
        P=(y[2],),
        C=(sp.sqrt(y[0] ** 2 + y[1] ** 2 + y[2] ** 2),),
        y=(across * sp.sin(q), across * sp.cos(q), p),
    )


def rotation(y: State, moments: State) -> Lift:
    """Return the motion of the rotation matrix Q with P = Q' D, whose image is the motion of y; it starts at Q = 1.

    ::

        Q' = Q hat(I^-1 y)      d_k = (I1 + I2 + I3)/2 - I_k      Q^T P - P^T Q = hat(y)

    A flat body, for example with I3 = I1 + I2, has no such motion: its D is singular.
    """
    omega = [component / moment for component, moment in zip(y, moments, strict=True)]
    return Lift(problem="rigid_body_rotation", q=tuple(sp.eye(3)), p=turning(omega, moments), y=body_momentum)


def body_momentum(p: Sequence[Any], q: Sequence[Any], parameters: Mapping[str, Any]) -> list[Any]:
    """Return the y of hat(y) = Q^T P - P^T Q, the angular momentum in the body, for matrices given row by row."""
    columns = [(i, i + 3, i + 6) for i in range(3)]
    return [sum(q[a] * p[b] - p[a] * q[b] for a, b in zip(columns[k], columns[j], strict=True)) for j, k in ((1, 2), (2, 0), (0, 1))]


def closed_form(t: Any, y0: Sequence[Any], parameters: Mapping[str, Any]) -> list[Any]:
    """Return the exact state at time t, mpmath numbers correct to mpmath's working precision; see ``_rigid_body_motion.euler``.

    Parameters
    ----------
    t : number
        Time, s; of either sign.
    y0 : sequence of number, shape(3,)
        Angular momentum at time 0, any.
    parameters : mapping of str to number
        The moments I1, I2, I3, positive.
    """
    return euler(t, y0, [parameters[name] for name in ("I1", "I2", "I3")])
