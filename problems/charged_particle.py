"""A charged particle in uniform magnetic and electric fields: a circle that drifts, with a closed form."""

from collections.abc import Mapping, Sequence
from typing import Any

import mpmath as mp
import sympy as sp

from daebench.problems._magnetic import energy, with_velocity
from daebench.systems.constrained import Case, ConstrainedHamiltonian, Picture, coordinates


def problem(*, mass: float = 1.0, field: float = 1.0, electric: float = 0.0) -> ConstrainedHamiltonian:
    """Return the motion of a unit charge in a magnetic field along q3 and an electric field along q1.

    ::

        H = |p - A(q)|^2 / (2 mass) - electric q1      A = field / 2 (-q2, q1, 0)      no constraint

    The momenta are not mass q': H is not separable, and H(-p, q) is not H(p, q). The velocity turns at the rate field / mass, and its mean
    is the drift (0, -electric / field, 0). With the radius |v| mass / field of the circle, the period is 2 pi in the case ``circle``.

    Parameters
    ----------
    mass : float
        Mass, kg.
    field : float
        Magnetic field B along q3 times the charge, kg/s, other than 0 for the closed form.
    electric : float
        Electric field along q1 times the charge, N.
    """
    m, B, E = sp.Symbol("mass", positive=True), sp.Symbol("field", real=True), sp.Symbol("electric", real=True)
    q, p = coordinates(3)
    place, v = (1, 0, 0), (0, 1, sp.Rational(1, 10))
    momenta = with_velocity(place, v, mass=m, turn=B / 2)
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        H=energy(q, p, mass=m, turn=B / 2) - E * q[0],
        g=[],
        parameters={m: mass, B: field, E: electric},
        cases={
            "helix": Case(q=place, p=momenta, about="a helix of radius 1 about the field"),
            "drift": Case(q=place, p=momenta, parameters={"electric": 0.2}, about="the circle drifts across an electric field"),
        },
        integrals={"p3": p[2], "guiding": p[1] + B / 2 * q[0]},
        closed_form=closed_form,
        picture=Picture(masses=[q]),
    )


def closed_form(t: Any, q0: Sequence[Any], p0: Sequence[Any], parameters: Mapping[str, Any]) -> tuple[list[Any], list[Any]]:
    """Return the exact state (q, p) at time t, mpmath numbers correct to mpmath's working precision.

    ::

        w = v1 + i (v2 + electric / field)      w(t) = w(0) exp(-i t field / mass)

    Parameters
    ----------
    t : number
        Time, s; of either sign.
    q0, p0 : sequence of number, shape(3,)
        State at time 0.
    parameters : mapping of str to number
        mass, field (other than 0) and electric.

    Raises
    ------
    ZeroDivisionError
        If there is no magnetic field.
    """
    with mp.workdps(mp.mp.dps + 15):
        mass, B, electric = (mp.mpmathify(parameters[name]) for name in ("mass", "field", "electric"))
        q, p = [mp.mpmathify(x) for x in q0], [mp.mpmathify(x) for x in p0]
        t, drift = mp.mpmathify(t), electric / B
        w = mp.mpc((p[0] + B / 2 * q[1]) / mass, (p[1] - B / 2 * q[0]) / mass + drift)
        turned = mp.expj(-t * B / mass)
        z = mp.mpc(q[0], q[1] - drift * t) + w * (turned - 1) * mass / (-1j * B)
        v, end = w * turned - 1j * drift, [z.real, z.imag, q[2] + t * p[2] / mass]
        momenta = [mass * v.real - B / 2 * end[1], mass * v.imag + B / 2 * end[0], p[2]]
    return [+x for x in end], [+x for x in momenta]
