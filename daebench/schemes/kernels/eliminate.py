"""The linear system of one Newton update for p, q and lam together: q, then p, are eliminated."""

from daebench.schemes.kernels.language import solve
from daebench.schemes.kernels.spaces import I, Matrix, Multiplier, Number, Rows, Vector


def eliminate(
    w: Number,
    residuals: tuple[Vector, Vector, Multiplier],
    mixed: tuple[Matrix, Matrix],
    by_mass: Matrix,
    stiffness: Matrix,
    down: Rows,
    G1: Rows,
) -> tuple[Vector, Vector, Multiplier, Number]:
    """Return dp, dq, dlam and the smallest relative pivot; ``mixed`` is (H_qp, H_pq).

    ::

        (I + w H_qp) dp + w stiffness dq + down^T dlam = r_p
        (I - w H_pq) dq - w H_pp dp                  = r_q
        G1 dq                                          = r_g
    """
    r_p, r_q, r_g = residuals
    K = w * stiffness
    by_q, S_T, pivot_q = solve(I - w * mixed[1], r_q, w * by_mass)
    S = S_T.T
    A = I + w * mixed[0] + K @ S
    by_p, P, pivot_p = solve(A, r_p - K @ by_q, down)
    change, pivot = solve(G1 @ (S @ P.T), G1 @ (by_q + S @ by_p) - r_g)
    dp = by_p - P.T @ change
    return dp, by_q + S @ dp, change, min(pivot, min(pivot_p, pivot_q))
