"""RATTLE, HLW (1.25), and its extension to any Hamiltonian, (1.26)."""

from typing import Any

from daebench.claims import Claims, Member
from daebench.kernels.constrain import normal, reach
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
    axpy_dd,
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
    scale_m,
    scale_md,
    solve,
    solve_dm,
    transpose,
    zero_m,
)
from daebench.kernels.newton import both, newton

CLAIMS = Claims(order=2, symmetric=True, symplectic=True, keeps_g=True, keeps_Gv=True, system="constrained", source="HLW (1.25), (1.26)")
MEMBERS = {"rattle": Member(claims=CLAIMS, multipliers=lambda: {"lam_n": 0.0, "mu_n": 1.0})}

if SEPARABLE:

    def increment(p0: Vector, q0: Vector, h: Number) -> tuple[Vector, Vector, Any, Report]:
        """Return p1 - p0, q1 - q0, lam and mu, and a report, with explicit half steps.

        ::

            p_half = p0 - h/2 (U_q(q0) + G(q0)^T lam)
            q1     = q0 + h M^-1 p_half,                      0 = g(q1)
            p1     = p_half - h/2 (U_q(q1) + G(q1)^T mu),     0 = G(q1) M^-1 p1
        """
        G0 = G(q0)
        kick = scale(-0.5 * h, H_q(p0, q0))
        dq, nu, found = reach(q0, scale(h, H_p(axpy(1.0, kick, p0), q0)), rows(G0, p0, q0))
        q1 = axpy(1.0, dq, q0)
        dp = axpy(-0.5 * h, H_q(p0, q1), axpy(-1.0 / h, mul_T(G0, nu), kick))
        n, mu, settled = normal(axpy(1.0, dp, p0), q1)
        return axpy(-1.0, n, dp), dq, (scale_m(2.0 / (h * h), nu), scale_m(2.0 / h, mu)), both(found, settled)

else:

    def improve(x: tuple[Vector, Vector, Multiplier], data: tuple[Vector, Vector, Matrix, Number]) -> Any:
        """One Newton sweep for p_half - p0, q1 - q0 and lam; the first two are eliminated block by block."""
        dp, dq, lam = x
        p0, q0, G0, half = data
        p, q = axpy(1.0, dp, p0), axpy(1.0, dq, q0)
        r_p = axpy(half, axpy(1.0, mul_T(G0, lam), H_q(p, q0)), dp)
        r_q = axpy(-half, axpy(1.0, H_p(p, q0), H_p(p, q)), dq)
        value = g(q)
        G1 = G(q)
        by_p, P, pivot_p = solve_dm(identity_plus(half, H_qp(p, q0)), r_p, scale_md(half, G0))
        S = axpy_dd(1.0, H_pp(p, q0), H_pp(p, q))
        r_q = axpy(half, apply(S, by_p), r_q)
        by_q, Q, pivot_q = solve_dm(identity_plus(-half, transpose(H_qp(p, q))), r_q, scale_md(half, apply_md(S, P)))
        change, pivot = solve(gram(G1, Q), axpy_m(-1.0, value, mul(G1, by_q)))
        back_p = axpy(-1.0, mul_full_T(P, change), by_p)
        back_q = axpy(-1.0, mul_full_T(Q, change), by_q)
        x = (axpy(-1.0, back_p, dp), axpy(-1.0, back_q, dq), axpy_m(-1.0, change, lam))
        residual = norm(r_p) + norm(r_q) + norm_m(value)
        size = norm(back_q) + abs(half) * norm(apply(S, back_p))
        return x, size, max(LENGTH, norm(q)), residual, min(pivot, min(pivot_p, pivot_q))

    def increment(p0: Vector, q0: Vector, h: Number) -> tuple[Vector, Vector, Any, Report]:
        """Return p1 - p0, q1 - q0, lam and mu, and a report.

        ::

            p_half = p0 - h/2 (H_q(p_half, q0) + G(q0)^T lam)
            q1     = q0 + h/2 (H_p(p_half, q0) + H_p(p_half, q1)),     0 = g(q1)
            p1     = p_half - h/2 (H_q(p_half, q1) + G(q1)^T mu),      0 = G(q1) H_p(p1, q1)
        """
        still = scale(0.0, p0)
        (half, dq, lam), found = newton(improve, (still, still, zero_m(q0)), (p0, q0, G(q0), 0.5 * h))
        q1 = axpy(1.0, dq, q0)
        dp = axpy(-0.5 * h, H_q(axpy(1.0, half, p0), q1), half)
        n, mu, settled = normal(axpy(1.0, dp, p0), q1)
        return axpy(-1.0, n, dp), dq, (lam, scale_m(2.0 / h, mu)), both(found, settled)
