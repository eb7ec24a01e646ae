"""The adjoint of constrained symplectic Euler, HLW (1.19) and (1.20): explicit in p, implicit in q."""

from daebench.schemes.kernels.branch import PART, doubt, floor, settled_on, walked
from daebench.schemes.kernels.claims import Claims
from daebench.schemes.kernels.constrain import project_momentum, project_position
from daebench.schemes.kernels.language import SEPARABLE, G, H_p, H_pp, H_pq, H_q, g, norm, rows, solve, zero
from daebench.schemes.kernels.newton import both, newton, once
from daebench.schemes.kernels.spaces import LENGTH, I, Jacobian, Multiplier, Number, Step, Update, Vector

CLAIMS = Claims(
    order=1, symmetric=False, symplectic=True, keeps_g=True, keeps_Gv=True, system="constrained", source="adjoint of HLW (1.19), (1.20)"
)

if SEPARABLE:

    def step(p0: Vector, q0: Vector, h: Number) -> Step:
        """Return p1, q1, no stage multipliers, and a report.

        ::

            p_hat = p0 - h G(q0)^T mu,      q1 = q0 + h M^-1 p_hat,     0 = g(q1)
            p1    = p_hat - h (U_q(q1) + G(q1)^T lam),                  0 = G(q1) M^-1 p1
        """
        G0 = G(q0)
        dq, nu, position_report = project_position(q0, h * H_p(p0, q0), G0, rows(G0, p0, q0))
        q1 = q0 + dq
        p_hat = p0 - G0.T @ nu / h
        p1, _, settled = project_momentum(p_hat - h * H_q(p_hat, q1), q1)
        return p1, q1, (), both(position_report, settled)

else:

    def update(x: tuple[Vector, Multiplier], data: tuple[Vector, Vector, Jacobian, Number]) -> Update:
        """One Newton update for q1 and mu."""
        q, mu = x
        p0, q0, G0, h = data
        p = p0 - h * G0.T @ mu
        r_q = q - q0 - h * H_p(p, q)
        value = g(q)
        G1 = G(q)
        S, down = h * H_pp(p, q), h * G0
        by_q, Q, pivot_q = solve(I - h * H_pq(p, q), r_q, down @ S.T)
        change, pivot = solve(G1 @ Q.T, G1 @ by_q - value)
        dq = by_q - Q.T @ change
        x = (q - dq, mu - change)
        return x, norm(dq), max(LENGTH, norm(q)), norm(r_q) + norm(value), min(pivot, pivot_q)

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

            p_hat = p0 - h G(q0)^T mu,      q1 = q0 + h H_p(p_hat, q1),     0 = g(q1)
            p1    = p_hat - h (H_q(p_hat, q1) + G(q1)^T lam),               0 = G(q1) H_p(p1, q1)

        The first update is linearised at (p0, q0): it ends where the linearised constraint puts the step.
        """
        G0 = G(q0)
        data, begin = (p0, q0, G0, h), (q0, zero(q0))
        first, first_report = once(update, begin, data)
        (q1, mu), newton_report = newton(update, first, data)
        tangent, dq = first[0] - q0, q1 - q0
        unsure = doubt(q0, G0, tangent, dq, mu - first[1], floor(q0))
        (end, _), walk = walked(update_walk, (begin, 0 * h), data, unsure)
        report = settled_on(tangent, dq, end[0] - q0, unsure, walk, both(first_report, newton_report), floor(q0))
        p_hat = p0 - h * G0.T @ mu
        p1, _, settled = project_momentum(p_hat - h * H_q(p_hat, q1), q1)
        return p1, q1, (), both(report, settled)
