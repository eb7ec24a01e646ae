"""A thin disc that rolls on a plane, falls over and rises again: constraints on positions and on velocities together."""

from collections.abc import Sequence
from typing import Any

import sympy as sp

from daebench.problems._space import points
from daebench.systems.constrained import Case, ConstrainedHamiltonian, Picture, coordinates


def problem(*, mass: float = 15.0, radius: float = 1.0, gravity: float = 9.81) -> ConstrainedHamiltonian:
    """Return a homogeneous disc that rolls without slipping: its centre c and two axes a, b in its plane, q = (c, a, b).

    ::

        H = |p_c|^2 / (2 mass) + (|p_a|^2 + |p_b|^2) / (2 K) + mass gravity c_3        K = mass radius^2 / 4
        g = |a|^2 - 1, |b|^2 - 1, a . b, c_3^2 - radius^2 (a_3^2 + b_3^2)
        0 = c_3 c' - radius^2 (a_3 a' + b_3 b'), components 1 and 2

    Natural coordinates: the lowest point of the disc is c + s a + t b with (s, t) = -radius^2 (a_3, b_3) / c_3, and its velocity is 0; the
    third component of that is the derivative of the last g. The moments of inertia are (K, K, 2 K). The energy is the only integral in
    closed form; two more are linear in the velocities, with Legendre functions of the inclination. The numbers, and the starts ``hante``
    and ``tilted``, are those of S. Hante's benchmark for ``RATTLie_nonhol``, to t = 2.

    Parameters
    ----------
    mass : float
        Mass, kg.
    radius : float
        Radius, m.
    gravity : float
        Gravitational acceleration along -c_3, m/s^2.
    """
    m, r = sp.symbols("mass radius", positive=True)
    gamma = sp.Symbol("gravity", real=True)
    q, p = coordinates(9)
    v = sp.symbols("v1:10", real=True)
    (c, a, b), (c_rate, a_rate, b_rate) = map(points, (q, v))
    K = m * r**2 / 4
    slip = c[2] * c_rate - r**2 * (a[2] * a_rate + b[2] * b_rate)
    rim = [tuple(c + r * (sp.cos(s) * a + sp.sin(s) * b)) for s in (sp.pi * k / 12 for k in range(25))]

    def rolling(tilt: Any, omega: Sequence[Any], about: str) -> Case:
        """Return the case of a disc that is tilted about its direction of motion, and turns with omega about a, b and a x b."""
        a0, b0 = sp.Matrix([-1, 0, 0]), sp.Matrix([0, -sp.sin(tilt), sp.cos(tilt)])
        normal = a0.cross(b0)
        rates = omega[2] * b0 - omega[1] * normal, omega[0] * normal - omega[2] * a0
        momenta = (*(m * r * rates[1]), *(K * rates[0]), *(K * rates[1]))
        return Case(q=(0, 0, r * sp.cos(tilt), *a0, *b0), p=momenta, about=about)

    return ConstrainedHamiltonian(
        q=q,
        p=p,
        v=v,
        M=sp.diag(*[m] * 3, *[K] * 6),
        U=m * gamma * c[2],
        g=[a.dot(a) - 1, b.dot(b) - 1, a.dot(b), c[2] ** 2 - r**2 * (a[2] ** 2 + b[2] ** 2)],
        velocity=[slip[0], slip[1]],
        parameters={m: mass, r: radius, gamma: gravity},
        cases={
            "hante": rolling(0, (0, 15, 5), "upright, turning at 15 rad/s about the vertical and rolling at 5 rad/s"),
            "tilted": rolling(sp.pi / 12, (0, 15, 5), "the same, tilted by 15 degrees"),
            "straight": rolling(0, (0, 0, 5), "upright and straight ahead at 5 rad/s"),
        },
        picture=Picture(rods=[rim, [tuple(c), tuple(c + r * a)]], masses=[tuple(c)]),
    )
