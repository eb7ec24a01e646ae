"""RATTLE, HLW (1.25), and its extension to any Hamiltonian, (1.26)."""

from daebench.schemes.kernels.branch import PART, doubt, floor, settled_on, walked
from daebench.schemes.kernels.claims import Claims, Member
from daebench.schemes.kernels.constrain import momentum_correction, project_position
from daebench.schemes.kernels.language import SEPARABLE, G, H_p, H_pp, H_pq, H_q, H_qp, g, norm, rows, solve, zero
from daebench.schemes.kernels.newton import both, newton, once
from daebench.schemes.kernels.spaces import LENGTH, I, Jacobian, Multiplier, Number, Step, Update, Vector

CLAIMS = Claims(order=2, symmetric=True, symplectic=True, keeps_g=True, keeps_Gv=True, system="constrained", source="HLW (1.25), (1.26)")
MEMBERS = {"rattle": Member(claims=CLAIMS, multipliers=lambda: {"lam_n": 0.0, "mu_n": 1.0})}

if SEPARABLE:

    def increment(p0: Vector, q0: Vector, h: Number) -> Step:
        """Return p1 - p0, q1 - q0, lam and mu, and a report, with explicit half steps.

        ::

            p_half = p0 - h/2 (U_q(q0) + G(q0)^T lam)
            q1     = q0 + h M^-1 p_half,                      0 = g(q1)
            p1     = p_half - h/2 (U_q(q1) + G(q1)^T mu),     0 = G(q1) M^-1 p1
        """
        G0 = G(q0)
        kick = -h / 2 * H_q(p0, q0)
        dq, nu, position_report = project_position(q0, h * H_p(p0 + kick, q0), G0, rows(G0, p0, q0))
        q1 = q0 + dq
        # From the forces, never as M (q1 - q0) / h: the rounding of q1, divided by h, biases momenta, and the energy drifts.
        # The next step evaluates H_q at q1 again, because a step is a map of (p, q) and carries nothing else.
        dp = kick - G0.T @ nu / h - h / 2 * H_q(p0, q1)
        n, mu, settled = momentum_correction(p0 + dp, q1)
        return dp - n, dq, (2 / h**2 * nu, 2 / h * mu), both(position_report, settled)

else:

    def update(x: tuple[Vector, Vector, Multiplier], data: tuple[Vector, Vector, Jacobian, Number]) -> Update:
        """One Newton update for p_half - p0, q1 - q0 and lam; the first two are eliminated block by block."""
        dp, dq, lam = x
        p0, q0, G0, half = data
        p, q = p0 + dp, q0 + dq
        r_p = dp + half * (H_q(p, q0) + G0.T @ lam)
        r_q = dq - half * (H_p(p, q) + H_p(p, q0))
        value = g(q)
        G1 = G(q)
        by_p, P, pivot_p = solve(I + half * H_qp(p, q0), r_p, half * G0)
        S = H_pp(p, q) + H_pp(p, q0)
        r_q = r_q + half * S @ by_p
        by_q, Q, pivot_q = solve(I - half * H_pq(p, q), r_q, half * P @ S.T)
        # Eliminated in the order p, q, lam: the last system has only m unknowns, and its pivots show the rank of G.
        change, pivot = solve(G1 @ Q.T, G1 @ by_q - value)
        back_p = by_p - P.T @ change
        back_q = by_q - Q.T @ change
        x = (dp - back_p, dq - back_q, lam - change)
        residual = norm(r_p) + norm(r_q) + norm(value)
        size = norm(back_q) + abs(half) * norm(S @ back_p)
        return x, size, max(LENGTH, norm(q)), residual, min(pivot, min(pivot_p, pivot_q))

    def update_walk(
        x: tuple[tuple[Vector, Vector, Multiplier], Number], data: tuple[Vector, Vector, Jacobian, Number]
    ) -> tuple[tuple[tuple[Vector, Vector, Multiplier], Number], Number, Number, Number, Number]:
        """One Newton update for a step size that has grown by a part of h."""
        p0, q0, G0, half = data
        share = x[1] + PART
        iterate, size, scale, residual, pivot = update(x[0], (p0, q0, G0, share * half))
        return (iterate, share), size, scale, residual, pivot

    def increment(p0: Vector, q0: Vector, h: Number) -> Step:
        """Return p1 - p0, q1 - q0, lam and mu, and a report.

        ::

            p_half = p0 - h/2 (H_q(p_half, q0) + G(q0)^T lam)
            q1     = q0 + h/2 (H_p(p_half, q0) + H_p(p_half, q1)),     0 = g(q1)
            p1     = p_half - h/2 (H_q(p_half, q1) + G(q1)^T mu),      0 = G(q1) H_p(p1, q1)

        The first update is linearised at (p0, q0): it ends where the linearised constraint puts the step, as in (1.25).
        """
        still, G0 = 0 * p0, G(q0)
        data, begin = (p0, q0, G0, h / 2), (still, still, zero(q0))
        first, first_report = once(update, begin, data)
        (half, dq, lam), newton_report = newton(update, first, data)
        unsure = doubt(q0, G0, first[1], dq, lam - first[2], floor(q0))
        (end, _), walk = walked(update_walk, (begin, 0 * h), data, unsure)
        report = settled_on(first[1], dq, end[1], unsure, walk, both(first_report, newton_report), floor(q0))
        q1 = q0 + dq
        dp = half - h / 2 * H_q(p0 + half, q1)
        n, mu, settled = momentum_correction(p0 + dp, q1)
        return dp - n, dq, (lam, 2 / h * mu), both(report, settled)
