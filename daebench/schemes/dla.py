"""Discrete Lagrange-d'Alembert equations at the midpoint: Cortés and Martínez (2001) with alpha = 1/2."""

from daebench.schemes.kernels.claims import Claims, Member
from daebench.schemes.kernels.constrain import momentum_correction
from daebench.schemes.kernels.language import A, G, H_p, H_pp, H_pq, H_q, H_qp, H_qq, g, norm, solve, zero
from daebench.schemes.kernels.newton import both, newton
from daebench.schemes.kernels.spaces import LENGTH, I, Jacobian, Multiplier, Number, Step, Update, Vector

CLAIMS = Claims(
    order=2,
    symmetric=True,
    symplectic=False,
    keeps_g=True,
    keeps_Gv=True,
    system="constrained",
    source="Cortés and Martínez, Nonlinearity 14 (2001) 1365-1392, alpha = 1/2",
    nonholonomic=True,
)
MEMBERS = {"dla": Member(claims=CLAIMS, multipliers=lambda: {"lam_n": 0.0, "mu_n": 1.0}, simplified=True)}

Unknowns = tuple[Vector, Vector, Multiplier]


def update(x: Unknowns, data: tuple[Vector, Vector, Jacobian, Number]) -> Update:
    """One update of p_mid - p0, q1 - q0 and nu, with derivatives of the motion and without that of A."""
    dp, dq, nu = x
    p0, q0, G0, h = data
    p, q, q1 = p0 + dp, q0 + dq / 2, q0 + dq
    v, A_mid = H_p(p, q), A(q)
    r_p = dp + h / 2 * H_q(p, q) + G0.T @ nu
    r_q = dq - h * v
    value = g(q1) + A_mid @ dq
    rows_now = G(q1) - (A(q1) - A_mid)
    # Block by block: p from the first row, then q, so that the last system has m unknowns.
    by_p, P, pivot_p = solve(I + h / 2 * H_qp(p, q), r_p, G0)
    S = H_pp(p, q)
    stiff = H_qq(p, q)
    _, by_q, _ = solve(I + h / 2 * H_qp(p, q), r_p, stiff.T)
    matrix = I - h / 2 * H_pq(p, q) + h**2 / 4 * S @ by_q.T
    change_q, Q, pivot_q = solve(matrix, r_q + h * S @ by_p, h * P @ S.T)
    change, pivot = solve(rows_now @ Q.T, rows_now @ change_q - value)
    back_q = change_q - Q.T @ change
    back_p = by_p - P.T @ change - h / 4 * by_q.T @ back_q
    residual = norm(r_p) + norm(r_q) + norm(value)
    return (dp - back_p, dq - back_q, nu - change), norm(back_q), max(LENGTH, norm(q1)), residual, min(pivot, min(pivot_p, pivot_q))


def increment(p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1 - p0, q1 - q0, lam and mu, and a report.

    With q = (q0 + q1)/2 and momenta p in the middle of the step::

        p  = p0 - h/2 (H_q(p, q) + G(q0)^T lam)        q1 = q0 + h H_p(p, q)        0 = A(q) (q1 - q0),    0 = g(q1)
        p1 = p - h/2 (H_q(p, q) + G(q1)^T mu)          0 = G(q1) H_p(p1, q1)

    G has the rows of g_q and of A. The positions are those of the discrete Lagrangian h L(q, (q1 - q0)/h) under the forces of G(q_n)^T;
    mu belongs to the same force as lam of the next step, as in RATTLE.
    """
    v0 = H_p(p0, q0)
    (dp, dq, nu), report = newton(update, (0 * p0, h * v0, zero(q0)), (p0, q0, G(q0), h))
    half = dp - h / 2 * H_q(p0 + dp, q0 + dq / 2)
    n, mu, settled = momentum_correction(p0 + half, q0 + dq)
    return half - n, dq, (2 / h * nu, 2 / h * mu), both(report, settled)
