"""Symplectic Euler on the index-reduced ODE, HLW (1.18), the negative example of Fig. 1.1; in canonical coordinates it is symplectic."""

from daebench.schemes.kernels.canonical import rates
from daebench.schemes.kernels.claims import Claims
from daebench.schemes.kernels.language import CANONICAL, SEPARABLE, G, H_p, H_pp, H_q, H_qp, L_q, L_qv, M, a, a_p, norm, rows, solve, zero
from daebench.schemes.kernels.newton import newton
from daebench.schemes.kernels.spaces import I, Jacobian, Multiplier, Number, Rows, Step, Update, Vector

CLAIMS = Claims(
    order=1,
    symmetric=False,
    symplectic=False,
    keeps_g=False,
    keeps_Gv=False,
    system="ode",
    source="HLW (1.18), Fig. 1.1 se",
    canonical=True,
)

if SEPARABLE:

    def respond(p: Vector, q: Vector, h: Number, r_p: Vector, by_lam: Rows) -> tuple[Vector, Rows, Number]:
        """Return r_p and by_lam: H_q does not depend on p."""
        return r_p, by_lam, 1.0

else:

    def respond(p: Vector, q: Vector, h: Number, r_p: Vector, by_lam: Rows) -> tuple[Vector, Rows, Number]:
        """Return (I + h H_qp)^-1 applied to r_p and to the rows of by_lam."""
        return solve(I + h * H_qp(p, q), r_p, by_lam)


def update(x: tuple[Vector, Multiplier], data: tuple[Vector, Vector, Jacobian, Number]) -> Update:
    """One Newton update for p1 and lam(p1, q0)."""
    p, lam = x
    p0, q0, G0, h = data
    force = H_q(p, q0) + G0.T @ lam
    r_p = p - p0 + h * force
    value = a(p, q0, lam)
    a_by_p = a_p(p, q0, lam)
    by_p, P, pivot_p = respond(p, q0, h, r_p, h * G0)
    matrix = a_by_p @ P.T + G0 @ rows(G0, p, q0).T
    change, pivot = solve(matrix, a_by_p @ by_p - value)
    dp = by_p - P.T @ change
    by_mass = H_pp(p, q0)
    x = (p - dp, lam - change)
    # The forces' part is added, because a motion that begins at rest has no velocity to compare with.
    scale_v = norm(by_mass @ p) + abs(h) * norm(by_mass @ force)
    return x, norm(by_mass @ dp), scale_v, norm(r_p) + norm(value), min(pivot, pivot_p)


def update_in_chart(p: Vector, data: tuple[Vector, Vector, Number]) -> Update:
    """One Newton update for p1 in canonical coordinates, whose rates follow from p1 and q0."""
    p0, q0, h = data
    velocity, pivot_v = rates(p, q0)
    force = L_q(q0, velocity)
    r = p - p0 - h * force
    _, by_p, _ = solve(M(q0), p, L_qv(q0, velocity))
    change, pivot = solve(I - h * by_p, r)
    return p - change, norm(change), norm(p0) + abs(h) * norm(force), norm(r), min(pivot, pivot_v)


if CANONICAL:

    def step(p0: Vector, q0: Vector, h: Number) -> Step:
        """Return p1, q1, no stage multipliers, and a report: p1 = p0 - h K_q(p1, q0), q1 = q0 + h K_p(p1, q0), for K(p, q) = H."""
        p1, report = newton(update_in_chart, p0, (p0, q0, h))
        return p1, q0 + h * rates(p1, q0)[0], (), report

else:

    def step(p0: Vector, q0: Vector, h: Number) -> Step:
        """Return p1, q1, no stage multipliers, and a report.

        ::

            p1 = p0 - h (H_q(p1, q0) + G(q0)^T lam(p1, q0)),     lam(p, q) from (1.12)
            q1 = q0 + h H_p(p1, q0)

        lam is evaluated in full, also off the manifold, which the solution soon leaves.
        """
        (p1, _), report = newton(update, (p0, zero(q0)), (p0, q0, G(q0), h))
        return p1, q0 + h * H_p(p1, q0), (), report
