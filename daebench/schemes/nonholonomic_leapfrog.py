"""Reversible leapfrog for constraints on velocities: McLachlan and Perlmutter (2006)."""

from daebench.schemes.kernels.claims import Claims, Member
from daebench.schemes.kernels.eliminate import eliminate
from daebench.schemes.kernels.language import SEPARABLE, A_qv, G, H_p, H_pp, H_pq, H_q, H_qp, norm, rows, solve, zero
from daebench.schemes.kernels.newton import newton
from daebench.schemes.kernels.spaces import Jacobian, Multiplier, Number, Rows, Step, Update, Vector

CLAIMS = Claims(
    order=2,
    symmetric=True,
    symplectic=False,
    keeps_g=False,
    keeps_Gv=True,
    system="constrained",
    source="McLachlan and Perlmutter, J. Nonlinear Sci. 16 (2006) 283-328, (4.18)",
    nonholonomic=True,
)
MEMBERS = {"nonholonomic_leapfrog": Member(claims=CLAIMS, multipliers=lambda: {"lam_mid": 0.5})}


def constrained(q1: Vector, w: Vector) -> tuple[Multiplier, Rows]:
    """Return G(q1) w and its derivative as w and q1 change alike, which for constraints on positions is without g_qq."""
    G1 = G(q1)
    # Rows have no sums, only differences.
    return G1 @ w, G1 - A_qv(q1, -w)


if SEPARABLE:

    def update(x: tuple[Vector, Multiplier], data: tuple[Vector, Rows]) -> Update:
        """One Newton update of w = h/2 v1 and h/2 M^-1 G^T nu."""
        w, nu = x
        q_half, V = data
        value, slope = constrained(q_half + w, w)
        change, pivot = solve(slope @ V.T, value)
        back = V.T @ change
        # Against w: a velocity is what the constraint determines.
        return (w - back, nu + change), norm(back), norm(w), norm(value), pivot

    def solved(p0: Vector, q_half: Vector, G_half: Jacobian, h: Number) -> Step:
        """Return p1 - p0, h/2 v1, h lam and a report."""
        kick = -h * H_q(p0, q_half)
        V = rows(G_half, p0, q_half)
        (w, nu), report = newton(update, (h / 2 * H_p(p0 + kick, q_half), zero(q_half)), (q_half, h / 2 * V))
        return kick - G_half.T @ nu, w, nu, report

else:

    def update(x: tuple[Vector, Vector, Multiplier], data: tuple[Vector, Vector, Jacobian, Number]) -> Update:  # type: ignore[misc]
        """One Newton update of p1 - p0, w = h/2 v1 and nu = h lam."""
        dp, w, nu = x
        p0, q_half, G_half, h = data
        p1, q1 = p0 + dp, q_half + w
        value, slope = constrained(q1, w)
        r_p = dp + h / 2 * (H_q(p0, q_half) + H_q(p1, q_half)) + G_half.T @ nu
        r_q = w - h / 2 * H_p(p1, q1)
        mixed, by_mass = (H_qp(p1, q_half), H_pq(p1, q1)), H_pp(p1, q1)
        back_p, back_q, change, pivot = eliminate(h / 2, (r_p, r_q, value), mixed, by_mass, 0.0 * by_mass, G_half, slope)
        size = norm(back_q) + abs(h) * norm(by_mass @ back_p)
        return (dp - back_p, w - back_q, nu - change), size, norm(w), norm(r_p) + norm(r_q) + norm(value), pivot

    def solved(p0: Vector, q_half: Vector, G_half: Jacobian, h: Number) -> Step:
        """Return p1 - p0, h/2 v1, h lam and a report."""
        begin = (0 * p0, h / 2 * H_p(p0, q_half), zero(q_half))
        (dp, w, nu), report = newton(update, begin, (p0, q_half, G_half, h))
        return dp, w, nu, report


def increment(p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1 - p0, q1 - q0, lam in the middle of the step, and a report.

    The constraints hold at the ends, and their forces act in the middle; all of them are imposed as constraints on velocities::

        q_half = q0 + h/2 H_p(p0, q0)
        p1     = p0 - h/2 (H_q(p0, q_half) + H_q(p1, q_half)) - h G(q_half)^T lam
        q1     = q_half + h/2 H_p(p1, q1)                                            0 = G(q1) H_p(p1, q1)

    The source has constant M and forces of q; the mean of H_q keeps the step symmetric for any other H.
    """
    half = h / 2 * H_p(p0, q0)
    q_half = q0 + half
    dp, w, nu, report = solved(p0, q_half, G(q_half), h)
    return dp, half + w, (nu / h,), report
