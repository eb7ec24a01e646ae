"""The adjoint of constrained symplectic Euler, HLW (1.19) and (1.20): explicit in p, implicit in q."""

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
    transpose,
    zero_m,
)
from daebench.kernels.newton import both, newton

CLAIMS = Claims(
    order=1, symmetric=False, symplectic=True, keeps_g=True, keeps_Gv=True, system="constrained", source="adjoint of HLW (1.19), (1.20)"
)

if SEPARABLE:

    def step(p0: Vector, q0: Vector, h: Number) -> tuple[Vector, Vector, Any, Report]:
        """Return p1, q1, no raw multipliers, and a report.

        ::

            p_hat = p0 - h G(q0)^T mu,      q1 = q0 + h M^-1 p_hat,     0 = g(q1)
            p1    = p_hat - h (U_q(q1) + G(q1)^T lam),                  0 = G(q1) M^-1 p1
        """
        G0 = G(q0)
        dq, nu, found = reach(q0, scale(h, H_p(p0, q0)), rows(G0, p0, q0))
        q1 = axpy(1.0, dq, q0)
        p_hat = axpy(-1.0 / h, mul_T(G0, nu), p0)
        p1, _, settled = tangent(axpy(-h, H_q(p_hat, q1), p_hat), q1)
        return p1, q1, (), both(found, settled)

else:

    def improve(x: tuple[Vector, Multiplier], data: tuple[Vector, Vector, Matrix, Number]) -> Any:
        """One Newton sweep for q1 and mu."""
        q, mu = x
        p0, q0, G0, h = data
        p = axpy(-h, mul_T(G0, mu), p0)
        r_q = axpy(-h, H_p(p, q), axpy(-1.0, q0, q))
        value = g(q)
        G1 = G(q)
        from_mu = apply_md(scale_dd(h, H_pp(p, q)), scale_md(h, G0))
        by_q, Q, pivot_q = solve_dm(identity_plus(-h, transpose(H_qp(p, q))), r_q, from_mu)
        change, pivot = solve(gram(G1, Q), axpy_m(-1.0, value, mul(G1, by_q)))
        dq = axpy(-1.0, mul_full_T(Q, change), by_q)
        x = (axpy(-1.0, dq, q), axpy_m(-1.0, change, mu))
        return x, norm(dq), max(LENGTH, norm(q)), norm(r_q) + norm_m(value), min(pivot, pivot_q)

    def step(p0: Vector, q0: Vector, h: Number) -> tuple[Vector, Vector, Any, Report]:
        """Return p1, q1, no raw multipliers, and a report.

        ::

            p_hat = p0 - h G(q0)^T mu,      q1 = q0 + h H_p(p_hat, q1),     0 = g(q1)
            p1    = p_hat - h (H_q(p_hat, q1) + G(q1)^T lam),               0 = G(q1) H_p(p1, q1)
        """
        G0 = G(q0)
        (q1, mu), found = newton(improve, (q0, zero_m(q0)), (p0, q0, G0, h))
        p_hat = axpy(-h, mul_T(G0, mu), p0)
        p1, _, settled = tangent(axpy(-h, H_q(p_hat, q1), p_hat), q1)
        return p1, q1, (), both(found, settled)
