"""Constrained symplectic Euler, HLW (1.19) and (1.20): implicit in p, explicit in q."""

from typing import Any

from daebench.claims import Claims
from daebench.kernels.constrain import reach, tangent
from daebench.kernels.hole import (
    LENGTH,
    SEPARABLE,
    G,
    H_p,
    H_pp,
    H_q,
    H_qp,
    Matrix,
    Multiplier,
    Number,
    Report,
    Vector,
    apply,
    apply_md,
    axpy,
    axpy_m,
    g,
    gram,
    identity_plus,
    mul,
    mul_full_T,
    mul_T,
    norm,
    norm_m,
    rows,
    scale,
    scale_dd,
    scale_md,
    solve,
    solve_dm,
    zero_m,
)
from daebench.kernels.newton import both, newton

CLAIMS = Claims(order=1, symmetric=False, symplectic=True, keeps_g=True, keeps_Gv=True, system="constrained", source="HLW (1.19), (1.20)")

if SEPARABLE:

    def step(p0: Vector, q0: Vector, h: Number) -> tuple[Vector, Vector, Any, Report]:
        """Return p1, q1, no raw multipliers, and a report.

        ::

            p_hat = p0 - h (U_q(q0) + G(q0)^T lam)
            q1    = q0 + h M^-1 p_hat,                 0 = g(q1)
            p1    = p_hat - h G(q1)^T mu,              0 = G(q1) M^-1 p1
        """
        G0 = G(q0)
        p_hat = axpy(-h, H_q(p0, q0), p0)
        dq, nu, found = reach(q0, scale(h, H_p(p_hat, q0)), rows(G0, p0, q0))
        q1 = axpy(1.0, dq, q0)
        p1, _, settled = tangent(axpy(-1.0 / h, mul_T(G0, nu), p_hat), q1)
        return p1, q1, (), both(found, settled)

else:

    def improve(x: tuple[Vector, Multiplier], data: tuple[Vector, Vector, Matrix, Number]) -> Any:
        """One Newton sweep for p_hat and lam."""
        p, lam = x
        p0, q0, G0, h = data
        force = axpy(1.0, mul_T(G0, lam), H_q(p, q0))
        r_p = axpy(h, force, axpy(-1.0, p0, p))
        q1 = axpy(h, H_p(p, q0), q0)
        value = g(q1)
        G1 = G(q1)
        S = scale_dd(h, H_pp(p, q0))
        by_p, P, pivot_p = solve_dm(identity_plus(h, H_qp(p, q0)), r_p, scale_md(h, G0))
        change, pivot = solve(gram(G1, apply_md(S, P)), axpy_m(-1.0, value, mul(G1, apply(S, by_p))))
        dp = axpy(-1.0, mul_full_T(P, change), by_p)
        x = (axpy(-1.0, dp, p), axpy_m(-1.0, change, lam))
        return x, norm(apply(S, dp)), max(LENGTH, norm(q1)), norm(r_p) + norm_m(value), min(pivot, pivot_p)

    def step(p0: Vector, q0: Vector, h: Number) -> tuple[Vector, Vector, Any, Report]:
        """Return p1, q1, no raw multipliers, and a report.

        ::

            p_hat = p0 - h (H_q(p_hat, q0) + G(q0)^T lam)
            q1    = q0 + h H_p(p_hat, q0),             0 = g(q1)
            p1    = p_hat - h G(q1)^T mu,              0 = G(q1) H_p(p1, q1)
        """
        (p_hat, _), found = newton(improve, (p0, zero_m(q0)), (p0, q0, G(q0), h))
        q1 = axpy(h, H_p(p_hat, q0), q0)
        p1, _, settled = tangent(p_hat, q1)
        return p1, q1, (), both(found, settled)
