"""Exact motion of pendulums by elliptic functions, in mpmath numbers: the closed forms of the planar and spherical pendulum.

Everything here is in units of the pendulum: mass = length = gravity = 1, x = q / length, v = p / (mass length w), tau = w t with
w = sqrt(gravity / length). The last component points up.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any

import mpmath as mp

from daebench.errors import BadInput

Vector = list[Any]
Motion = Callable[[Any, Vector, Vector], tuple[Vector, Vector]]

OFF = 1e-12
"""Initial values whose relative distance from the sphere or its tangent plane is larger are refused."""


def in_units(motion: Motion, t: Any, q0: Sequence[Any], p0: Sequence[Any], parameters: Mapping[str, Any]) -> tuple[Vector, Vector]:
    """Return (q, p) at time t by a motion in units of the pendulum, correct to mpmath's working precision.

    The computation uses more than twice the digits, because the roots of an almost circular motion lose half of them. The rounding of q0
    and p0 off the manifold is removed by projection, q0 along the rod and then p0.

    Raises
    ------
    BadInput
        If q0 and p0 are off the manifold by more than rounding.
    """
    with mp.workdps(2 * mp.mp.dps + 25):
        mass, length, gravity = (mp.mpmathify(parameters[name]) for name in ("mass", "length", "gravity"))
        w = mp.sqrt(gravity / length)
        x = [mp.mpmathify(a) / length for a in q0]
        v = [mp.mpmathify(a) / (mass * length * w) for a in p0]
        size = mp.norm(x)
        if abs(size - 1) > OFF or abs(mp.fdot(x, v)) > OFF * (1 + mp.norm(v)):
            raise BadInput(
                "the closed form of a pendulum needs initial values on the constraint manifold; project them first.",
                "pendulum-start-inconsistent",
            )
        x = [a / size for a in x]
        along = mp.fdot(x, v)
        v = [b - along * a for a, b in zip(x, v, strict=True)]
        x, v = motion(w * mp.mpmathify(t), x, v)
        q, p = [length * a for a in x], [mass * length * w * b for b in v]
    return [+a for a in q], [+b for b in p]  # rounded to the precision of the caller


def planar(tau: Any, x: Vector, v: Vector) -> tuple[Vector, Vector]:
    """Return the motion on the unit circle.

    ::

        theta'' = -sin theta,   x = (sin theta, -cos theta),   s = sin(theta/2),   c = cos(theta/2),   k^2 = (theta'/2)^2 + s^2
        k < 1, oscillating:   s = k sn(tau + u0 | k^2),            c = dn,    theta'/2 = k cn
        k > 1, rotating:      s = +-sn(k tau + u0 | 1/k^2),        c = cn,    theta'/2 = +-k dn

    At k = 1, the separatrix, both are the hyperbolic motion to the upper equilibrium.
    """
    rate = (x[0] * v[1] - x[1] * v[0]) / 2
    # At an equilibrium the phase of the elliptic functions is not defined.
    if x[0] == 0 and rate == 0:
        return x, v
    half = mp.atan2(x[0], -x[1]) / 2
    k2 = rate**2 + mp.sin(half) ** 2
    if k2 <= 1:
        k = mp.sqrt(k2)
        u = tau + mp.ellipf(mp.atan2(mp.sin(half), rate), k2)
        sn, c, rate = k * mp.ellipfun("sn", u, m=k2), mp.ellipfun("dn", u, m=k2), k * mp.ellipfun("cn", u, m=k2)
    else:
        k = mp.sign(rate) * mp.sqrt(k2)
        u = k * tau + mp.ellipf(half, 1 / k2)
        sn, c, rate = mp.ellipfun("sn", u, m=1 / k2), mp.ellipfun("cn", u, m=1 / k2), k * mp.ellipfun("dn", u, m=1 / k2)
    sine, cosine = 2 * sn * c, c**2 - sn**2
    return [sine, -cosine], [2 * rate * cosine, 2 * rate * sine]


def spherical(tau: Any, x: Vector, v: Vector) -> tuple[Vector, Vector]:
    """Return the motion on the unit sphere.

    ::

        E = |v|^2/2 + z,   L = x1 v2 - x2 v1,   z'^2 = 2 (E - z)(1 - z^2) - L^2 = 2 (z - z1)(z - z2)(z - z3),   z1 <= z <= z2 < z3
        z(tau) = z1 + (z2 - z1) sn^2(u | k2),   u = w tau + u0,   w = sqrt((z3 - z1)/2),   k2 = (z2 - z1)/(z3 - z1)
        phi'   = L / (1 - z^2) = L/2 (1/(1 - z) + 1/(1 + z))
        phi    = phi0 + L/(2 w) [ Pi(n1; u)/(1 - z1) + Pi(n2; u)/(1 + z1) ] from u0 to u
        n1     = (z2 - z1)/(1 - z1),   n2 = -(z2 - z1)/(1 + z1)

    Without angular momentum the motion is planar, through the poles.
    """
    E, L = mp.fdot(v, v) / 2 + x[2], x[0] * v[1] - x[1] * v[0]
    # So small an angular momentum is lost in the rounding of 1 - z^2 near the poles, where phi turns.
    if abs(L) <= mp.eps ** mp.mpf("0.45"):
        return _through_the_poles(tau, x, v)
    z1, z2, z3 = _turning_heights(E, L)
    # 1 + z1 and 1 - z2 from the product of the roots: near a pole both are differences that lose their digits.
    below, above = L**2 / (2 * (1 + z2) * (1 + z3)), L**2 / (2 * (1 - z1) * (z3 - 1))
    width, w = z2 - z1, mp.sqrt((z3 - z1) / 2)
    k2 = width / (z3 - z1)
    u0 = mp.ellipf(_amplitude(x[2], v[2], [z1, z2, z3]), k2)
    u = w * tau + u0
    sn, cn, dn = (mp.ellipfun(name, u, m=k2) for name in ("sn", "cn", "dn"))
    precision = mp.mp.prec
    turned = (_Pi(width / (1 - z1), u, k2, precision) - _Pi(width / (1 - z1), u0, k2, precision)) / (1 - z1)
    turned += (_Pi(-width / below, u, k2, precision) - _Pi(-width / below, u0, k2, precision)) / below
    phi = mp.atan2(x[1], x[0]) + L / (2 * w) * turned
    z, z_rate = z1 + width * sn**2, 2 * width * w * sn * cn * dn
    rho = mp.sqrt((below + width * sn**2) * (above + width * cn**2))
    radial, around = -z * z_rate / rho, L / rho
    cos, sin = mp.cos(phi), mp.sin(phi)
    return [rho * cos, rho * sin, z], [radial * cos - around * sin, radial * sin + around * cos, z_rate]


def _turning_heights(E: Any, L: Any) -> Vector:
    """Return the real roots z1 <= z2 < z3 of 2 z^3 - 2 E z^2 - 2 z + 2 E - L^2, by Viete's formula."""
    shift = E / 3
    a, b = 1 + E**2 / 3, E - shift - 2 * shift**3 - L**2 / 2
    radius = 2 * mp.sqrt(a / 3)
    # Rounding may take the argument past 1 where two roots meet, as in a circular motion.
    angle = mp.acos(max(-1, min(1, -4 * b / radius**3))) / 3
    return sorted(shift + radius * mp.cos(angle - 2 * mp.pi * k / 3) for k in range(3))


def _amplitude(z: Any, z_rate: Any, roots: Vector) -> Any:
    """Return the phase phi in [0, pi] with z = z1 + (z2 - z1) sin^2 phi and cos phi of the sign of z'."""
    # At a turning point rounding may take the height past it.
    up, down = (mp.sqrt(max(height, 0)) for height in (z - roots[0], roots[1] - z))
    return mp.atan2(up, -down if z_rate < 0 else down)


@lru_cache(maxsize=64)
def _Pi(n: Any, u: Any, k2: Any, precision: int) -> Any:
    """Return the elliptic integral of the third kind as a function of u: the integral of 1/(1 - n sn^2) from 0 to u.

    Values are cached for the precision in which they are computed: the value at the start is the same for all times of a motion.
    """
    K = mp.ellipk(k2)
    # Whole half turns of the amplitude are taken off: mpmath's integral is evaluated between -pi/2 and pi/2 only.
    turns = mp.nint(u / (2 * K))
    rest = u - 2 * K * turns
    phi = mp.atan2(mp.ellipfun("sn", rest, m=k2), mp.ellipfun("cn", rest, m=k2))
    return 2 * turns * _complete_Pi(n, k2, precision) + mp.ellippi(n, phi, k2)


@lru_cache(maxsize=64)
def _complete_Pi(n: Any, k2: Any, precision: int) -> Any:
    """Return the complete elliptic integral of the third kind, the same for all times of a motion; see :func:`_Pi`."""
    return mp.ellippi(n, k2)


def _through_the_poles(tau: Any, x: Vector, v: Vector) -> tuple[Vector, Vector]:
    """Return the motion in a vertical plane, which contains the larger of the horizontal parts of x and v."""
    larger = max(x[:2], v[:2], key=mp.norm)
    size = mp.norm(larger)
    e = [a / size for a in larger] if size else [mp.mpf(1), mp.mpf(0)]
    (across, z), (across_rate, z_rate) = planar(tau, [mp.fdot(e, x[:2]), x[2]], [mp.fdot(e, v[:2]), v[2]])
    return [across * e[0], across * e[1], z], [across_rate * e[0], across_rate * e[1], z_rate]
