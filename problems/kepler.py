"""A planet about a fixed sun: closed orbits of any eccentricity, two integrals besides the energy, and a closed form."""

from collections.abc import Mapping, Sequence
from typing import Any

import mpmath as mp
import sympy as sp

from daebench.errors import BadInput
from daebench.systems.constrained import Case, ConstrainedHamiltonian, Picture, coordinates
from daebench.systems.kinetic_flows import free


def problem(*, mu: float = 1.0) -> ConstrainedHamiltonian:
    """Return the Kepler problem in the plane, for a planet of unit mass.

    ::

        H = |p|^2 / 2 - mu / |q|      no constraint
        L = q1 p2 - q2 p1      A = (p2 L - mu q1 / |q|, -p1 L - mu q2 / |q|)

    HLW Section I.2.3. A is the Runge-Lenz vector, of length mu e in the direction of the perihelion, where the orbits begin. With mu = 1
    the orbits of all cases have the semi-axis 1, so that the period is 2 pi and H = -1/2; L is sqrt(1 - e^2).

    Parameters
    ----------
    mu : float
        Gravitational parameter, m^3/s^2.
    """
    mu_ = sp.Symbol("mu", positive=True)
    q, p = coordinates(2)
    r, L = sp.sqrt(q[0] ** 2 + q[1] ** 2), q[0] * p[1] - q[1] * p[0]
    about = {"eccentric": sp.Rational(3, 5), "circular": sp.Integer(0), "very_eccentric": sp.Rational(9, 10)}
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        M=sp.eye(2),
        U=-mu_ / r,
        g=[],
        parameters={mu_: mu},
        cases={
            name: Case(q=(1 - e, 0), p=(0, sp.sqrt(mu_ * (1 + e) / (1 - e))), about=f"from the perihelion, eccentricity {float(e):g}")
            for name, e in about.items()
        },
        integrals={"L": L, "A1": p[1] * L - mu_ * q[0] / r, "A2": -p[0] * L - mu_ * q[1] / r},
        closed_form=closed_form,
        kinetic_flow=free(q, p, mass=1),
        picture=Picture(masses=[q], fixed=[(0, 0)]),
    )


def closed_form(t: Any, q0: Sequence[Any], p0: Sequence[Any], parameters: Mapping[str, Any]) -> tuple[list[Any], list[Any]]:
    """Return the exact state (q, p) at time t by Kepler's equation, mpmath numbers correct to mpmath's working precision.

    ::

        E - e sin E = E0 - e sin E0 + t sqrt(mu / a^3)      1/a = 2/|q0| - |p0|^2 / mu      e exp(i E0) = 1 - |q0|/a + i q0.p0 / sqrt(mu a)

    Parameters
    ----------
    t : number
        Time, s; of either sign.
    q0, p0 : sequence of number, shape(2,)
        State at time 0.
    parameters : mapping of str to number
        mu (m^3/s^2), positive.

    Raises
    ------
    BadInput
        If the orbit is not an ellipse.
    """
    with mp.workdps(2 * mp.mp.dps + 15):
        q, p, mu = [mp.mpmathify(x) for x in q0], [mp.mpmathify(x) for x in p0], mp.mpmathify(parameters["mu"])
        r0 = mp.norm(q)
        curvature = 2 / r0 - mp.fdot(p, p) / mu
        if not (curvature > 0 and q[0] * p[1] != q[1] * p[0]):
            raise BadInput(
                "the closed form of the Kepler problem is that of ellipses; give a start with H < 0 and L other than 0.",
                "kepler-orbit-not-elliptic",
            )
        a = 1 / curvature
        n, c, s = mp.sqrt(mu / a**3), 1 - r0 / a, mp.fdot(q, p) / mp.sqrt(mu * a)
        E0, e = mp.atan2(s, c), mp.hypot(s, c)
        E = _anomaly(E0 - s + n * mp.mpmathify(t), e)
        D = E - E0
        r = a * (1 - e * mp.cos(E))
        # Lagrange's coefficients: q and p are combinations of q0 and p0.
        of_q = 1 - a / r0 * (1 - mp.cos(D)), (mp.sin(D) - c * mp.sin(D) + s * (1 - mp.cos(D))) / n
        of_p = -n * a**2 / (r * r0) * mp.sin(D), 1 - a / r * (1 - mp.cos(D))
        end = [[one * x + other * y for x, y in zip(q, p, strict=True)] for one, other in (of_q, of_p)]
    return [+x for x in end[0]], [+x for x in end[1]]  # rounded to the precision of the caller


def _anomaly(M: Any, e: Any) -> Any:
    """Return the solution E of E - e sin E = M in (-pi, pi], but for full turns, by Newton's method, which is monotone from pi."""
    M -= 2 * mp.pi * mp.nint(M / (2 * mp.pi))
    E = mp.pi * mp.sign(M)
    while True:
        change = (E - e * mp.sin(E) - M) / (1 - e * mp.cos(E))
        E -= change
        if abs(change) <= mp.eps * 64 * (1 + abs(E)):
            return E
