"""The right side of the index-reduced equation, HLW (1.18)."""

from daebench.schemes.kernels.language import G, Gv_q, H_p, H_q, rows, solve
from daebench.schemes.kernels.spaces import Jacobian, Multiplier, Number, Rows, Vector


def hidden(p: Vector, q: Vector) -> tuple[Vector, Vector, Jacobian, Rows, Multiplier]:
    """Return H_p, H_q, G, G H_pp, and (1.12) without its multiplier: d/dq[G H_p] H_p - G H_pp H_q."""
    v, gradient, G0 = H_p(p, q), H_q(p, q), G(q)
    by_mass = rows(G0, p, q)
    # Never simplified by g = 0: states leave the manifold, where that would change the drift, of ``se`` by a factor of 400.
    return v, gradient, G0, by_mass, Gv_q(p, q) @ v - by_mass @ gradient


def force(gradient: Vector, G0: Jacobian, by_mass: Rows, value: Multiplier) -> tuple[Vector, Number]:
    """Return p' = -H_q - G^T lam with G H_pp G^T lam = value, and the smallest relative pivot of G H_pp G^T."""
    lam, pivot = solve(G0 @ by_mass.T, value)
    return -(gradient + G0.T @ lam), pivot


def f(p: Vector, q: Vector) -> tuple[Vector, Vector, Number]:
    """Return p', q' and the smallest relative pivot of G H_pp G^T.

    ::

        q' = H_p        p' = -H_q - G^T lam(p, q)        G H_pp G^T lam = d/dq[G H_p] H_p - G H_pp H_q
    """
    v, gradient, G0, by_mass, value = hidden(p, q)
    change, pivot = force(gradient, G0, by_mass, value)
    return change, v, pivot
