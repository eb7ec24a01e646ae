"""Constrained symplectic Euler, HLW (1.19) and (1.20): implicit in p, explicit in q."""

from daebench.schemes.kernels.claims import Claims
from daebench.schemes.kernels.constrain import project_momentum, project_position
from daebench.schemes.kernels.language import SEPARABLE, G, H_p, H_pp, H_q, H_qp, g, norm, rows, solve, zero
from daebench.schemes.kernels.newton import both, newton
from daebench.schemes.kernels.spaces import LENGTH, I, Jacobian, Multiplier, Number, Step, Update, Vector

CLAIMS = Claims(order=1, symmetric=False, symplectic=True, keeps_g=True, keeps_Gv=True, system="constrained", source="HLW (1.19), (1.20)")

if SEPARABLE:

    def step(p0: Vector, q0: Vector, h: Number) -> Step:
        """Return p1, q1, no stage multipliers, and a report.

        ::

            p_hat = p0 - h (U_q(q0) + G(q0)^T lam)
            q1    = q0 + h M^-1 p_hat,                 0 = g(q1)
            p1    = p_hat - h G(q1)^T mu,              0 = G(q1) M^-1 p1
        """
        G0 = G(q0)
        p_hat = p0 - h * H_q(p0, q0)
        dq, nu, position_report = project_position(q0, h * H_p(p_hat, q0), G0, rows(G0, p0, q0))
        q1 = q0 + dq
        p1, _, settled = project_momentum(p_hat - G0.T @ nu / h, q1)
        return p1, q1, (), both(position_report, settled)

else:

    def update(x: tuple[Vector, Multiplier], data: tuple[Vector, Vector, Jacobian, Number]) -> Update:
        """One Newton update for p_hat and lam."""
        p, lam = x
        p0, q0, G0, h = data
        force = H_q(p, q0) + G0.T @ lam
        r_p = p - p0 + h * force
        q1 = q0 + h * H_p(p, q0)
        value = g(q1)
        G1 = G(q1)
        S = h * H_pp(p, q0)
        by_p, P, pivot_p = solve(I + h * H_qp(p, q0), r_p, h * G0)
        change, pivot = solve(G1 @ (S @ P.T), G1 @ (S @ by_p) - value)
        dp = by_p - P.T @ change
        x = (p - dp, lam - change)
        return x, norm(S @ dp), max(LENGTH, norm(q1)), norm(r_p) + norm(value), min(pivot, pivot_p)

    def step(p0: Vector, q0: Vector, h: Number) -> Step:
        """Return p1, q1, no stage multipliers, and a report.

        ::

            p_hat = p0 - h (H_q(p_hat, q0) + G(q0)^T lam)
            q1    = q0 + h H_p(p_hat, q0),             0 = g(q1)
            p1    = p_hat - h G(q1)^T mu,              0 = G(q1) H_p(p1, q1)
        """
        (p_hat, _), newton_report = newton(update, (p0, zero(q0)), (p0, q0, G(q0), h))
        q1 = q0 + h * H_p(p_hat, q0)
        p1, _, settled = project_momentum(p_hat, q1)
        return p1, q1, (), both(newton_report, settled)
