"""The linear system of one Newton sweep for p, q and lam together: q, then p, are eliminated."""

from typing import Any

from daebench.kernels.hole import (
    Matrix,
    Multiplier,
    Number,
    Vector,
    apply,
    apply_md,
    axpy,
    axpy_dd,
    axpy_m,
    gram,
    identity_plus,
    mul,
    mul_full_T,
    product,
    scale_dd,
    solve,
    solve_dd,
    solve_dm,
    transpose,
)


def eliminate(
    w: Number, residuals: tuple[Vector, Vector, Multiplier], mixed: Matrix, by_mass: Matrix, stiffness: Matrix, down: Matrix, G1: Matrix
) -> Any:
    """Return dp, dq, dlam and the smallest relative pivot.

    ::

        (I + w H_qp) dp + w stiffness dq + down^T dlam = r_p
        (I - w H_qp^T) dq - w H_pp dp                  = r_q
        G1 dq                                          = r_g
    """
    r_p, r_q, r_g = residuals
    K = scale_dd(w, stiffness)
    by_q, S_T, pivot_q = solve_dd(identity_plus(-w, transpose(mixed)), r_q, scale_dd(w, by_mass))
    S = transpose(S_T)
    A = axpy_dd(1.0, product(K, S), identity_plus(w, mixed))
    by_p, P, pivot_p = solve_dm(A, axpy(-1.0, apply(K, by_q), r_p), down)
    change, pivot = solve(gram(G1, apply_md(S, P)), axpy_m(-1.0, r_g, mul(G1, axpy(1.0, apply(S, by_p), by_q))))
    dp = axpy(-1.0, mul_full_T(P, change), by_p)
    return dp, axpy(1.0, apply(S, dp), by_q), change, min(pivot, min(pivot_p, pivot_q))
