"""A ball that rolls on a turning table: it circles at 2/7 of the table's rate, and its moving energy is constant in place of the energy."""

from collections.abc import Sequence
from typing import Any

import sympy as sp

from daebench.systems.constrained import Case, ConstrainedHamiltonian, Picture


def problem(*, mass: float = 1.0, radius: float = 1.0, share: float = 0.4, rate: float = 3.5) -> ConstrainedHamiltonian:
    """Return a ball on a horizontal table that turns about the origin, q = (x, y, e), with the unit quaternion e of its attitude.

    ::

        H = (p_x^2 + p_y^2) / (2 mass) + |p_e|^2 / (8 J)      J = share mass radius^2      g = |e|^2 - 1
        0 = x' - radius omega_2 + rate y      0 = y' + radius omega_1 - rate x      omega = 2 e' conj(e), in space

    The constraints are affine, so that the table gives and takes energy. Integrals: the moving energy H - rate L_3 (F. Fasso and N.
    Sansonetto, J. Nonlinear Sci. 26 (2016) 519-544), with the angular momentum L about the origin; ``spin``, the part J omega_3 of it; and
    the centre of the circle times k = rate share / (1 + share), the rate at which the ball goes round: 2/7 of the table's for a homogeneous
    ball, share = 2/5. The attitude has a closed form only where the centre is the table's.

    Parameters
    ----------
    mass : float
        Mass, kg.
    radius : float
        Radius, m.
    share : float
        Moment of inertia over mass radius^2.
    rate : float
        Rate of the table, rad/s.
    """
    m, r, s = sp.symbols("mass radius share", positive=True)
    table = sp.Symbol("rate", real=True)
    names = ("x", "y", "e0", "e1", "e2", "e3")
    q, p, v = (sp.symbols([f"{part}{name}" for name in names], real=True) for part in ("", "p_", "v_"))
    x, y, *e = q
    J, k = s * m * r**2, table * s / (1 + s)
    omega, spin = 2 * _vector(e, v[2:]), _vector(e, p[2:]) / 2
    H = (p[0] ** 2 + p[1] ** 2) / (2 * m) + sum(z**2 for z in p[2:]) / (8 * J)
    axes = [[(x, y, r), (x + r * n[0], y + r * n[1], r + r * n[2])] for n in _axes(e)]

    def rolling(speed: Any, about: str) -> Case:
        start = (table - speed) / r, 0, sp.Rational(1, 2)
        return Case(q=(1, 0, 1, 0, 0, 0), p=(0, m * speed, 0, *(2 * J * w for w in start)), about=about)

    return ConstrainedHamiltonian(
        q=q,
        p=p,
        v=v,
        M=sp.diag(m, m, *[4 * J] * 4),
        U=sp.S.Zero,
        g=[sum(z**2 for z in e) - 1],
        velocity=[v[0] - r * omega[1] + table * y, v[1] + r * omega[0] - table * x],
        parameters={m: mass, r: radius, s: share, table: rate},
        cases={
            "beside": rolling(sp.Rational(1, 2), "1 m from the middle, on a circle about a point halfway to it"),
            "round_the_middle": rolling(k, "the same place, on a circle about the middle"),
        },
        integrals={
            "moving_energy": H - table * (x * p[1] - y * p[0] + spin[2]),
            "spin": spin[2],
            "centre_x": k * x - p[1] / m,
            "centre_y": k * y + p[0] / m,
        },
        picture=Picture(rods=axes, masses=[(x, y, r)], fixed=[(0, 0, 0)]),
    )


def _vector(e: Sequence[Any], rate: Sequence[Any]) -> sp.Matrix:
    """Return the vector part of rate conj(e), shape(3,), for quaternions of shape(4,)."""
    w, u = sp.Matrix(e[1:]), sp.Matrix(rate[1:])
    return e[0] * u - rate[0] * w + w.cross(u)


def _axes(e: Sequence[Any]) -> list[sp.Matrix]:
    """Return the axes of the body in space, e_k + 2 w x (w x e_k) + 2 e0 w x e_k with the vector part w of e."""
    w, axes = sp.Matrix(e[1:]), [sp.eye(3)[:, k] for k in range(3)]
    return [n + 2 * w.cross(w.cross(n)) + 2 * e[0] * w.cross(n) for n in axes]
