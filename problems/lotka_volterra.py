"""Predator and prey, HLW (2.13): a Poisson system in the plane, whose orbits are closed curves; with many methods they are not."""

import sympy as sp

from daebench.systems.picture import Picture
from daebench.systems.poisson import DarbouxMap, Part, PoissonCase, PoissonSystem


def problem(*, a: float = 1.0, b: float = 2.0) -> PoissonSystem:
    """Return the Lotka-Volterra equations, HLW (2.13) with its numbers 1 and 2 as parameters.

    ::

        u' = u (v - b)      v' = v (a - u)
        B = [[0, u v], [-u v, 0]]      H = u - a ln u + v - b ln v      u, v > 0

    In the logarithms Q = ln u, P = ln v the structure matrix is the canonical one, which is the basis of (4.9). The parts are
    L = v - b ln v, which moves u, and K = u - a ln u, which moves v; L first makes ``strang`` the method (4.6).

    Parameters
    ----------
    a : float
        Stationary population u, positive.
    b : float
        Stationary population v, positive.
    """
    u, v, a_, b_ = sp.symbols("u v a b", positive=True)
    t, Q, P = sp.symbols("t Q P", real=True)
    L, K = v - b_ * sp.log(v), u - a_ * sp.log(u)
    return PoissonSystem(
        y=(u, v),
        B=sp.Matrix([[0, u * v], [-u * v, 0]]),
        H=K + L,
        domain=(u, v),
        parameters={a_: a, b_: b},
        cases={
            "4,2": PoissonCase(y=(4, 2), about="HLW Fig. 4.1, the inner orbit"),
            "6,2": PoissonCase(y=(6, 2), about="HLW Fig. 4.1, the outer orbit"),
        },
        parts={
            "L": Part(H=L, t=t, y=(u * sp.exp(t * (v - b_)), v)),
            "K": Part(H=K, t=t, y=(u, v * sp.exp(t * (a_ - u)))),
        },
        splittings={"LK": ("L", "K")},
        darboux=DarbouxMap(q=(Q,), p=(P,), Q=(sp.log(u),), P=(sp.log(v),), y=(sp.exp(Q), sp.exp(P))),
        picture=Picture(masses=[(u, v)], fixed=[(a_, b_)], axes=("predators u", "prey v")),
    )
