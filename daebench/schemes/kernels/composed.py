"""Functions that are composed of the problem's own functions: velocity constraint, hidden constraint, multiplier, mass."""

from daebench.schemes.kernels.language import EXTENDED, G, Gv_p, Gv_q, H_p, H_pp, H_pp_and_time, H_q, H_qp, identity_d, solve, zero
from daebench.schemes.kernels.spaces import Gram, Matrix, Multiplier, Number, Rows, Vector


def Gv(p: Vector, q: Vector) -> Multiplier:
    """Velocity constraint G H_p, HLW (1.11)."""
    return G(q) @ H_p(p, q)


def a(p: Vector, q: Vector, lam: Multiplier) -> Multiplier:
    """Right side of HLW (1.12), the second derivative of g along the solution.

    ::

        a = d/dq[G H_p] H_p - G H_pp (H_q + G^T lam)
    """
    force = H_q(p, q) + G(q).T @ lam
    return Gv_q(p, q) @ H_p(p, q) - Gv_p(p, q) @ force


def W(p: Vector, q: Vector) -> Gram:
    """Matrix G H_pp G^T, HLW (1.13), shape(m, m)."""
    return G(q) @ Gv_p(p, q).T


def lam_and_pivot(p: Vector, q: Vector) -> tuple[Multiplier, Number]:
    """Multiplier lam(p, q) that (1.12) determines, and the smallest relative pivot of G H_pp G^T."""
    return solve(W(p, q), a(p, q, zero(q)))


def lam(p: Vector, q: Vector) -> Multiplier:
    """Multiplier lam(p, q) that (1.12) determines, also off the manifold, where g = 0 must not be used to simplify it."""
    return lam_and_pivot(p, q)[0]


if EXTENDED:

    def mass(p: Vector, q: Vector) -> Matrix:
        """Mass matrix, the inverse of H_pp, with a 1 in place of the time."""
        return solve(H_pp_and_time(p, q), p, identity_d(q))[1]

else:

    def mass(p: Vector, q: Vector) -> Matrix:
        """Mass matrix, the inverse of H_pp, shape(d, d)."""
        return solve(H_pp(p, q), p, identity_d(q))[1]


def H_pq(p: Vector, q: Vector) -> Matrix:
    """Derivative of H_p with respect to q, of a Hamiltonian system."""
    return H_qp(p, q).T


def rows(X: Rows, p: Vector, q: Vector) -> Rows:
    """X H_pp: the inverse mass applied to each row of X."""
    return X @ H_pp(p, q)
