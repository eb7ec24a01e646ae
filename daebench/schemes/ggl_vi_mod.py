"""Variational integrator of the GGL principle, semi-explicit and symplectic, GGL_VI_mod in metis."""

from daebench.schemes.kernels.claims import Claims, Member
from daebench.schemes.kernels.language import G, Gv_q, H_p, H_q, curvature, g, mass, norm, rows, solve, solve_2m, zero
from daebench.schemes.kernels.newton import newton
from daebench.schemes.kernels.spaces import LENGTH, Jacobian, Matrix, Multiplier, Number, Step, Update, Vector

CLAIMS = Claims(
    order=1,
    symmetric=False,
    symplectic=True,
    keeps_g=True,
    keeps_Gv=False,
    system="constrained",
    source="Kinon, Betsch, Schneider, Multibody Syst. Dyn. 57 (2023); GGL_VI_mod of metis",
    separable_only=True,
    autonomous_only=True,
    imposes=True,
)
MEMBERS = {
    "ggl_vi_mod": Member(claims=CLAIMS, multipliers=lambda: {"lam_n": 0.0, "gam": 1.0}, vanishing=("gam",), simplified=True),
}


Predicted = tuple[Vector, Vector, Jacobian, Matrix]


def predicted(x: tuple[Multiplier, Multiplier], p0: Vector, q0: Vector, h: Number) -> Predicted:
    """Return M v, q_bar, G(q_bar), and the derivative h K of G(q_bar)^T h gam, for x = (h lam, h gam)."""
    a, b = x
    p_hat = p0 - h * H_q(p0, q0) - G(q0).T @ a
    q_bar = q0 + h * H_p(p_hat, q0)
    return p_hat, q_bar, G(q_bar), curvature(q_bar, b)


def update(x: tuple[Multiplier, Multiplier], data: tuple[Vector, Vector, Number]) -> Update:
    """One update of h lam and h gam: Newton's without third derivatives of g, which act on h gam, of second order in h."""
    a, b = x
    p0, q0, h = data
    p_hat, q_bar, G_bar, C = predicted(x, p0, q0, h)
    w, S, pivot_w = solve(mass(p0, q0) + C, p_hat, G_bar)
    G0, Q = G(q0), Gv_q(mass(p0, q0) @ w, q_bar)
    R0, R_bar = rows(G0, p0, q0), rows(G_bar, p0, q0)
    q1 = q_bar + R_bar.T @ b
    G1, value_g, value_v = G(q1), g(q1), G_bar @ w
    g_by_a = h * G1 @ R0.T + h * G1 @ rows(R0 @ C.T, p0, q0).T
    v_by_a = h * Q @ R0.T + S @ G0.T
    da, db, pivot = solve_2m(g_by_a, G1 @ R_bar.T, v_by_a, -S @ Q.T, value_g, value_v)
    by_v, by_q = R0.T @ da, R_bar.T @ db
    # The forces' part is added, because a motion that begins at rest has no velocity to compare with.
    scale_v, scale_q = norm(w) + abs(h) * norm(H_p(H_q(p0, q0), q0)), max(LENGTH, norm(q0))
    size = norm(by_v) * scale_q + (abs(h) * norm(by_v) + norm(by_q)) * scale_v
    return (a + da, b - db), size, scale_v * scale_q, norm(value_g) + norm(value_v), min(pivot, pivot_w)


def increment(p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1 - p0, q1 - q0, lam of q0 and gam, and a report.

    p1 and q1 follow from p0 and q0 by the discrete Hamiltonian F of a symplectic Euler step, q1 = q0 + h F_p(p1, q0) and
    p1 = p0 - h F_q(p1, q0), in which v and gam are stationary::

        F(p1, q0) = U(q0) + lam.g(q0) + v.p1 - 1/2 v^T M v + gam.G(q_bar) M^-1 p1,      q_bar = q0 + h v

    That is, with the symmetric matrix K = d/dq[G(q)^T gam] at q_bar::

        q1  = q_bar + h M^-1 G(q_bar)^T gam,                      0 = g(q1)
        p1  = p0 - h (U_q(q0) + G(q0)^T lam + K M^-1 p1),         0 = G(q_bar) M^-1 p1
        M v = p1 + h K M^-1 p1

    The velocity constraint holds at q_bar, which is off q1 by h^2: momenta satisfy G H_p = 0 to second order only, except on a sphere,
    where the error vanishes. The last two equations give M v = p0 - h (U_q(q0) + G(q0)^T lam), so that p1 solves a linear system.
    """
    x, report = newton(update, (zero(q0), zero(q0)), (p0, q0, h))
    a, b = x
    p_hat, _, G_bar, C = predicted(x, p0, q0, h)
    w, _ = solve(mass(p0, q0) + C, p_hat)
    dp = -(h * H_q(p0, q0) + G(q0).T @ a + C @ w)
    dq = h * H_p(p_hat, q0) + rows(G_bar, p0, q0).T @ b
    return dp, dq, (a / h, b / h), report
