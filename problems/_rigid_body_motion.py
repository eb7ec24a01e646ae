"""Exact motion of the free rigid body by Jacobi's elliptic functions, in mpmath numbers."""

from collections.abc import Sequence
from typing import Any

import mpmath as mp

Vector = list[Any]


def euler(t: Any, y0: Sequence[Any], moments: Sequence[Any]) -> Vector:
    """Return the solution of y' = y x I^-1 y at time t, correct to mpmath's working precision, from any state and for any moments.

    The axes are sorted by their moments; an odd permutation reverses the cross product, and thus time. The distance from the separatrix is
    computed with enough digits to be exact. The computation uses more than twice the digits, and as many more as that distance has leading
    zeros.

    Parameters
    ----------
    t : number
        Time, of either sign.
    y0 : sequence of number, shape(3,)
        Angular momentum at time 0, in the body.
    moments : sequence of number, shape(3,)
        Moments of inertia, positive.
    """
    J, y = ([mp.mpmathify(number) for number in numbers] for numbers in (moments, y0))
    order = sorted(range(3), key=lambda i: J[i])
    sense = 1 if order in ([0, 1, 2], [1, 2, 0], [2, 0, 1]) else -1
    J, y = [J[i] for i in order], [y[i] for i in order]
    S, zeros = _from_the_separatrix(J, y)
    with mp.workdps(2 * mp.mp.dps + 25 + zeros):
        after = _ordered(sense * mp.mpmathify(t), y, [1 / moment for moment in J], S)
        components = [after[order.index(i)] for i in range(3)]
    return [+component for component in components]  # rounded to the precision of the caller


def _from_the_separatrix(J: Vector, y: Vector) -> tuple[Any, int]:
    """Return S of ``_ordered`` up to a positive factor, and the number of leading zeros of its relative size."""
    with mp.workdps(8 * mp.mp.dps + 100):
        first, third = J[2] * (J[1] - J[0]), J[0] * (J[2] - J[1])
        S = first * y[0] ** 2 - third * y[2] ** 2
        size = (first + third) * mp.fdot(y, y)
        # Near the separatrix S is a small difference, and the period depends on its logarithm: its leading zeros are digits lost.
        return S, int(mp.ceil(mp.log10(size / abs(S)))) if S else 0


def _ordered(t: Any, y: Vector, e: Vector, S: Any) -> Vector:
    """Return the motion for e1 >= e2 >= e3, the reciprocals of the moments.

    ::

        y1' = -(e2 - e3) y2 y3      y2' = (e1 - e3) y3 y1      y3' = -(e1 - e2) y1 y2
        S   = (e1 - e2) y1^2 - (e2 - e3) y3^2      constant: > 0 about axis 1, < 0 about axis 3, = 0 on the separatrix

    Steady rotations are constant, as is every motion for three equal moments. A motion about axis 3 is a motion about axis 1 of a body with
    the axes in reverse order and -e for e.
    """
    if _rates(y, e) == [0, 0, 0]:
        return y
    if S < 0:
        return _about_the_first(t, y[::-1], [-x for x in e[::-1]], separatrix=S == 0)[::-1]
    return _about_the_first(t, y, e, separatrix=S == 0)


def _rates(y: Vector, e: Vector) -> Vector:
    return [(e[2] - e[1]) * y[1] * y[2], (e[0] - e[2]) * y[2] * y[0], (e[1] - e[0]) * y[0] * y[1]]


def _about_the_first(t: Any, y: Vector, e: Vector, *, separatrix: bool) -> Vector:
    """Return a motion with S >= 0 that is not steady; then y1 keeps its sign, e1 > e2 and p > 0.

    ::

        p = (e1 - e3) y1^2 + (e2 - e3) y2^2      r = (e1 - e2) y2^2 + (e1 - e3) y3^2      k^2 = (e2 - e3) r / ((e1 - e2) p) <= 1
        y1 = +-sqrt(p/(e1 - e3)) dn      y2 = sqrt(r/(e1 - e2)) sn      y3 = +-sqrt(r/(e1 - e3)) cn      of u = +-sqrt((e1 - e2) p) t + u0

    The sign of y3 is that of the start, which keeps the phase at the start within a quarter of the period; the sign of u is the product of
    the signs of y1 and y3. On the separatrix k = 1, and sn, cn, dn are tanh, sech, sech.
    """
    a, b, c = e[0] - e[1], e[1] - e[2], e[0] - e[2]
    p, r = c * y[0] ** 2 + b * y[1] ** 2, a * y[1] ** 2 + c * y[2] ** 2
    m = mp.mpf(1) if separatrix else b * r / (a * p)
    first, third = (-1 if component < 0 else 1 for component in (y[0], y[2]))
    u = first * third * mp.sqrt(a * p) * t + mp.ellipf(mp.atan2(mp.sqrt(a) * y[1], mp.sqrt(c) * abs(y[2])), m)
    sn, cn, dn = (mp.ellipfun(name, u, m=m) for name in ("sn", "cn", "dn"))
    return [first * mp.sqrt(p / c) * dn, mp.sqrt(r / a) * sn, third * mp.sqrt(r / c) * cn]
