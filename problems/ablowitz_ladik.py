"""The Ablowitz-Ladik lattice, HLW Example 4.12: an integrable discretisation of the nonlinear Schrödinger equation."""

import sympy as sp

from daebench.systems.lattice import LatticeDarboux, LatticePart, PoissonLattice
from daebench.systems.poisson import PoissonCase

LEAST = sp.Rational(1, 10**40)
"""Added to the arguments of sigma and tau of (4.11), which divide by them: it avoids 0/0 and changes no other value."""


def problem(*, sites: int = 16) -> PoissonLattice:
    """Return the Ablowitz-Ladik equations, HLW (4.10), for y_k = u_k + i v_k on a circle of length 1, dx = 1/sites.

    ::

        i y_k' + (y_{k+1} - 2 y_k + y_{k-1})/dx^2 + |y_k|^2 (y_{k+1} + y_{k-1}) = 0
        u' = -D H_v      v' = D H_u      D = diag(d_k)      d_k = 1 + dx^2 (u_k^2 + v_k^2)
        H = dx^-2 sum (u_k u_{k-1} + v_k v_{k-1}) - dx^-4 sum ln d_k

    In the coordinates (4.11) the bracket is canonical. The parts are D, the logarithms, whose flow rotates every y_k, and U and V, the
    products of one field, which move the other field: each site obeys a Riccati equation, whose solution is a tangent. All parts couple
    neighbours only, so a step of a splitting is explicit, and its cost is linear in the number of sites. The flows of U and V reach
    infinity in finite time, where the formulas below cease to be real.

    Parameters
    ----------
    sites : int
        Number of sites, at least 3.
    """
    u, v, u_left, v_left, u_right, v_right = sp.symbols("u v u_left v_left u_right v_right", real=True)
    q, p, t = sp.symbols("q p t", real=True)
    k = sp.Symbol("k", integer=True, positive=True)
    dx = sp.Rational(1, sites)
    d = 1 + dx**2 * (u**2 + v**2)
    by_u, by_v, logarithms = u * u_left / dx**2, v * v_left / dx**2, -sp.log(d) / dx**4
    # The factors d_k cancel in this flow: it is a rotation with one speed for all sites.
    angle = 2 * t / dx**2
    x, z = dx**2 * (u**2 + v**2) + LEAST, dx**2 * (q**2 + p**2) + LEAST
    sigma, tau = sp.sqrt(sp.log(1 + x) / x), sp.sqrt((sp.exp(z) - 1) / z)
    return PoissonLattice(
        sites=sites,
        here=(u, v),
        left=(u_left, v_left),
        right=(u_right, v_right),
        b=sp.Matrix([[0, -d], [d, 0]]),
        h=by_u + by_v + logarithms,
        integrals={
            "norm": sp.log(d) / dx**2,
            "coupling": u * u_left + v * v_left,
            "momentum": u_left * v - v_left * u,
        },
        site=k,
        cases={
            "hlw16": PoissonCase(
                y=(
                    sp.Rational(6, 10) + sp.Rational(2, 10) * sp.cos(2 * sp.pi * k / sites),
                    sp.Rational(3, 10) * sp.sin(4 * sp.pi * k / sites) + sp.Rational(1, 10) * sp.sin(2 * sp.pi * k / sites),
                ),
                about="a smooth wave",
            ),
        },
        parts={
            "D": LatticePart(h=logarithms, t=t, here=(u * sp.cos(angle) + v * sp.sin(angle), v * sp.cos(angle) - u * sp.sin(angle))),
            "U": LatticePart(h=by_u, t=t, here=(u, _riccati(v, u, (u_left + u_right) / dx**2, dx, t))),
            "V": LatticePart(h=by_v, t=t, here=(_riccati(u, v, -(v_left + v_right) / dx**2, dx, t), v)),
        },
        splittings={"DUV": ("D", "U", "V"), "UVD": ("U", "V", "D")},
        darboux=LatticeDarboux(q=q, p=p, Q=v * sigma, P=u * sigma, here=(p * tau, q * tau)),
        point=(k * dx, sp.sqrt(u**2 + v**2)),
        axes=("place on the circle", "amplitude |y_k|"),
    )


def _riccati(x: sp.Expr, other: sp.Expr, rate: sp.Expr, dx: sp.Expr, t: sp.Expr) -> sp.Expr:
    """Return x after time t under x' = rate (1 + dx^2 (other^2 + x^2)).

    The denominator, 1 at the start, is written as two roots: past infinity, where it is negative, the flow has no value. Infinity lies
    within half a turn of theta; the second term makes the value undefined beyond half a turn, too.
    """
    a = sp.sqrt(1 + dx**2 * other**2)
    turn = dx * a * rate * t
    theta = turn + LEAST * sp.sqrt(sp.pi**2 - turn**2)
    c, s = sp.cos(theta), sp.sin(theta)
    return sp.sqrt(a) * (x * c + a / dx * s) / (sp.sqrt(c - dx * x * s / a) * sp.sqrt(a * c - dx * x * s))
