"""Constrained symplectic Euler, HLW (1.19) and (1.20): implicit in p, explicit in q."""

from daebench.schemes.kernels.branch import PART, doubt, floor, settled_on, walked
from daebench.schemes.kernels.claims import Claims
from daebench.schemes.kernels.constrain import project_momentum, project_position
from daebench.schemes.kernels.language import SEPARABLE, G, H_p, H_pp, H_q, H_qp, g, norm, rows, solve, zero
from daebench.schemes.kernels.newton import both, linear, newton
from daebench.schemes.kernels.spaces import LENGTH, I, Jacobian, Multiplier, Number, Report, Step, Update, Vector

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

    def tangential_start(p0: Vector, q0: Vector, G0: Jacobian, h: Number) -> tuple[tuple[Vector, Multiplier], Vector, Report]:
        """Return p_hat, lam and q1 - q0 of the equations linearised at (p0, q0), and a report."""
        S, flight = h * H_pp(p0, q0), h * H_p(p0, q0)
        by_p, P, pivot_p = solve(I + h * H_qp(p0, q0), h * H_q(p0, q0), h * G0)
        value = G0 @ (S @ by_p - flight)
        change, pivot = solve(G0 @ (S @ P.T), value)
        dp = by_p - P.T @ change
        return (p0 - dp, -change), flight - S @ dp, linear(min(pivot, pivot_p), norm(value))

    def update_walk(
        x: tuple[tuple[Vector, Multiplier], Number], data: tuple[Vector, Vector, Jacobian, Number]
    ) -> tuple[tuple[tuple[Vector, Multiplier], Number], Number, Number, Number, Number]:
        """One Newton update for a step size that has grown by a part of h."""
        p0, q0, G0, h = data
        share = x[1] + PART
        iterate, size, scale, residual, pivot = update(x[0], (p0, q0, G0, share * h))
        return (iterate, share), size, scale, residual, pivot

    def step(p0: Vector, q0: Vector, h: Number) -> Step:
        """Return p1, q1, no stage multipliers, and a report.

        ::

            p_hat = p0 - h (H_q(p_hat, q0) + G(q0)^T lam)
            q1    = q0 + h H_p(p_hat, q0),             0 = g(q1)
            p1    = p_hat - h G(q1)^T mu,              0 = G(q1) H_p(p1, q1)
        """
        G0 = G(q0)
        data = (p0, q0, G0, h)
        # Not one update from p0: that would be linearised at the end of the free flight, which may be near another branch.
        first, tangent, first_report = tangential_start(p0, q0, G0, h)
        (p_hat, lam), newton_report = newton(update, first, data)
        dq = h * H_p(p_hat, q0)
        unsure = doubt(q0, G0, tangent, dq, lam - first[1], floor(q0))
        (end, _), walk = walked(update_walk, ((p0, zero(q0)), 0 * h), data, unsure)
        report = settled_on(tangent, dq, h * H_p(end[0], q0), unsure, walk, both(first_report, newton_report), floor(q0))
        q1 = q0 + dq
        p1, _, settled = project_momentum(p_hat, q1)
        return p1, q1, (), both(report, settled)
