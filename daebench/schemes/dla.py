"""Discrete Lagrange-d'Alembert equations at the midpoint: Cortés and Martínez (2001) with alpha = 1/2."""

from daebench.schemes.kernels.claims import Claims, Member
from daebench.schemes.kernels.constrain import momentum_correction
from daebench.schemes.kernels.eliminate import eliminate
from daebench.schemes.kernels.language import A, A_qv, G, H_p, H_pp, H_pq, H_q, H_qp, H_qq, g, norm, zero
from daebench.schemes.kernels.newton import both, newton
from daebench.schemes.kernels.spaces import LENGTH, Jacobian, Multiplier, Number, Step, Update, Vector

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
MEMBERS = {"dla": Member(claims=CLAIMS, multipliers=lambda: {"lam_n": 0.0, "mu_n": 1.0})}

Unknowns = tuple[Vector, Vector, Multiplier]


def update(x: Unknowns, data: tuple[Vector, Vector, Jacobian, Number]) -> Update:
    """One Newton update of p - p0, q1 - q0 and nu = h/2 lam, with exact derivatives."""
    dp, dq, nu = x
    p0, q0, G0, h = data
    p, q, q1 = p0 + dp, q0 + dq / 2, q0 + dq
    A_mid, by_mass = A(q), H_pp(p, q)
    r_p = dp + h / 2 * H_q(p, q) + G0.T @ nu
    r_q = dq - h * H_p(p, q)
    value = g(q1) + A_mid @ dq
    # G(q1) - A(q1) has the rows of positions. Rows have no sums, only differences.
    G1 = G(q1) - (A(q1) - (A_mid - A_qv(q, -dq / 2)))
    mixed, stiffness = (H_qp(p, q), H_pq(p, q)), H_qq(p, q) / 2
    back_p, back_q, change, pivot = eliminate(h / 2, (r_p, r_q, value), mixed, 2 * by_mass, stiffness, G0, G1)
    residual = norm(r_p) + norm(r_q) + norm(value)
    size = norm(back_q) + abs(h) * norm(by_mass @ back_p)
    return (dp - back_p, dq - back_q, nu - change), size, max(LENGTH, norm(q1)), residual, pivot


def increment(p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1 - p0, q1 - q0, lam and mu, and a report.

    With q = (q0 + q1)/2 and momenta p in the middle of the step::

        p  = p0 - h/2 (H_q(p, q) + G(q0)^T lam)        q1 = q0 + h H_p(p, q)        0 = A(q) (q1 - q0),    0 = g(q1)
        p1 = p - h/2 (H_q(p, q) + G(q1)^T mu)          0 = G(q1) H_p(p1, q1)

    G has the rows of g_q and of A. The positions are those of the discrete Lagrangian h L(q, (q1 - q0)/h) under the forces of G(q_n)^T;
    mu belongs to the same force as lam of the next step, as in RATTLE.
    """
    (dp, dq, nu), report = newton(update, (0 * p0, h * H_p(p0, q0), zero(q0)), (p0, q0, G(q0), h))
    half = dp - h / 2 * H_q(p0 + dp, q0 + dq / 2)
    n, mu, settled = momentum_correction(p0 + half, q0 + dq)
    return half - n, dq, (2 / h * nu, 2 / h * mu), both(report, settled)
