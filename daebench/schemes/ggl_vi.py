"""First variational integrator of the GGL principle, explicit in p: GGL_VI in metis, which describes it as not symplectic."""

from daebench.schemes.kernels.claims import Claims, Member
from daebench.schemes.kernels.language import G, Gv_q, H_p, H_q, curvature, g, mass, norm, rows, solve, solve_2m, zero
from daebench.schemes.kernels.newton import linear, newton
from daebench.schemes.kernels.spaces import LENGTH, Multiplier, Number, Report, Update, Vector

CLAIMS = Claims(
    order=1,
    symmetric=False,
    symplectic=False,
    keeps_g=True,
    keeps_Gv=True,
    system="constrained",
    source="GGL_VI of metis, after Kinon, Betsch, Schneider (2023)",
    separable_only=True,
    autonomous_only=True,
    imposes=True,
)
MEMBERS = {
    "ggl_vi": Member(claims=CLAIMS, multipliers=lambda: {"lam_n": 0.0, "gam": 1.0}, vanishing=("gam",)),
}

Unknowns = tuple[Vector, Multiplier, Multiplier]


def update(x: Unknowns, data: tuple[Vector, Vector, Vector, Number]) -> Update:
    """One Newton update of q1 - q0, h lam and h gam1, given p_free, the value of p1 for lam = 0."""
    dq, a, b = x
    p_free, p0, q0, h = data
    G0, q1 = G(q0), q0 + dq
    G1 = G(q1)
    p1 = p_free - G0.T @ a
    v1 = H_p(p1, q0)
    R1, Q = rows(G1, p0, q0), Gv_q(p1, q1)
    inertia = mass(p0, q0)
    A = inertia - curvature(q1, b)
    r_q, value_g, value_v = dq - h * v1 - R1.T @ b, g(q1), G1 @ v1
    by_r, S0, pivot_q = solve(A, inertia @ r_q, G0)
    _, S1, _ = solve(A, r_q, G1)
    g_by_a, v_by_a = h * G1 @ S0.T, h * Q @ S0.T + R1 @ G0.T
    da, db, pivot = solve_2m(g_by_a, G1 @ S1.T, v_by_a, Q @ S1.T, value_g - G1 @ by_r, value_v - Q @ by_r)
    change = by_r + h * S0.T @ da + S1.T @ db
    # p_free has the kick of the forces, so that the scale is not zero where a motion begins at rest.
    scale_v, scale_q = norm(H_p(p_free, q0)) + norm(v1), max(LENGTH, norm(q1))
    size = norm(rows(G0, p0, q0).T @ da) * scale_q + norm(change) * scale_v
    residual = norm(r_q) + norm(value_g) + norm(value_v)
    return (dq - change, a + da, b - db), size, scale_v * scale_q, residual, min(pivot, pivot_q)


def start(p0: Vector, q0: Vector, h: Number) -> tuple[Multiplier, Report]:
    """Return h gam at the start, which is zero, and a report."""
    return zero(q0), linear(1.0, 0.0)


def step(p0: Vector, q0: Vector, b0: Multiplier, h: Number) -> tuple[Vector, Vector, Multiplier, tuple[Multiplier, Multiplier], Report]:
    """Return p1, q1, h gam1, the multipliers lam of q0 and gam1, and a report.

    With the augmented Hamiltonian of the GGL principle, H + lam.g + gam.G M^-1 p, the step of p uses the old values and the step of q the
    new ones; gam is carried from step to step and begins at zero::

        p1 = p0 - h (U_q(q0) + G(q0)^T lam0 + K0 M^-1 p0),        K = d/dq[G(q)^T gam]
        q1 = q0 + h M^-1 (p1 + G(q1)^T gam1)
        0  = g(q1),        0 = G(q1) M^-1 p1

    The map (p1, q0) -> (p2, q1) is a symplectic Euler step of the augmented Hamiltonian, and preserves dp1 ^ dq0 exactly. It differs from
    dp1 ^ dq1 by h dp1 ^ d(M^-1 G(q1)^T gam1), of second order in h: the defect of the two-form of a state does not grow with the number of
    steps.
    """
    p_free = p0 - h * H_q(p0, q0) - curvature(q0, b0) @ H_p(p0, q0)
    guess = h * H_p(p0, q0)
    (dq, a, b), report = newton(update, (guess, zero(q0), zero(q0)), (p_free, p0, q0, h))
    return p_free - G(q0).T @ a, q0 + dq, b, (a / h, b / h), report
