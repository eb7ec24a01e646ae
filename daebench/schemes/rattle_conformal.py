"""Conformal RATTLE: the damping F = -c p by its exact flow, half a step on either side of a step of RATTLE for all other forces.

The flow of the damping contracts the two-form by exp(-c h), and RATTLE preserves it: together they contract it exactly like the motion,
McLachlan and Perlmutter, J. Geom. Phys. 39 (2001), and for RATTLE Bhatt, Floyd and Moore, J. Sci. Comput. 66 (2016).
"""

from daebench.schemes.kernels.claims import Claims, Member
from daebench.schemes.kernels.constrain import momentum_correction, project_position
from daebench.schemes.kernels.language import G, H_p, H_q, damping, dot, norm, rate_of_time, rows, solve
from daebench.schemes.kernels.newton import both, linear
from daebench.schemes.kernels.spaces import Number, Report, Step, Vector

CLAIMS = Claims(
    order=2,
    symmetric=True,
    symplectic=False,
    keeps_g=True,
    keeps_Gv=True,
    system="constrained",
    source="McLachlan and Perlmutter, J. Geom. Phys. 39 (2001); Bhatt, Floyd and Moore, J. Sci. Comput. 66 (2016)",
    quadratic_only=True,
    conformal=True,
)
MEMBERS = {"rattle_conformal": Member(claims=CLAIMS, multipliers=lambda: {"lam_n": 0.0, "mu_n": 1.0})}


def damped(p: Vector, q: Vector, t: Number) -> tuple[Vector, Report]:
    """Return the change of p by the damping alone in a time t, p(t) - p, and a report; q and the time are constant.

    ::

        p' = -c p - G^T lam,      0 = G M^-1 p + g_t        so that the tangent part p_T of p decays as exp(-c t) p_T
        p_t' = -g_t^T lam + c p.v                           so that K is conserved
    """
    e, G0 = rate_of_time(q), G(q)
    momenta = p - dot(p, e) * e
    by_mass = rows(G0, p, q)
    mu, pivot = solve(G0 @ by_mass.T, by_mass @ momenta)
    normal = G0.T @ mu
    tangent = momenta - (normal - dot(normal, e) * e)
    _, shrunk = damping(q, (t,))
    dp = shrunk * tangent
    # At the mean momentum the work dp . v is exactly the change of a kinetic energy that is quadratic in p.
    v = H_p(p + dp / 2, q) - e
    return dp - dot(dp, v) * e, linear(pivot, norm(v))


def undamped(p: Vector, q: Vector) -> Vector:
    """Return minus the forces other than the damping."""
    e = rate_of_time(q)
    c, _ = damping(q, (0,))
    momenta = p - dot(p, e) * e
    return H_q(p, q) - c * momenta + c * dot(momenta, H_p(p, q) - e) * e


def increment(p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1 - p0, q1 - q0, lam and mu, and a report.

    ::

        p-     = phi^D_{h/2}(p0)
        p_half = p- - h/2 (U_q(q0) + G(q0)^T lam)
        q1     = q0 + h M^-1 p_half,                   0 = g(q1)
        p+     = p_half - h/2 (U_q(q1) + G(q1)^T mu),  0 = G(q1) M^-1 p+
        p1     = phi^D_{h/2}(p+)

    The work of forces that do not depend on the velocity is computed with p_half, so that the step is also symmetric in p_t.
    """
    before, first = damped(p0, q0, h / 2)
    p = p0 + before
    G0 = G(q0)
    kick = -h / 2 * undamped(p, q0)
    dq, nu, position_report = project_position(q0, h * H_p(p + kick, q0), G0, rows(G0, p, q0))
    q1 = q0 + dq
    half = kick - G0.T @ nu / h
    # With constant M the difference is zero except in p_t: it replaces the work at the velocity of p by that at the velocity of p_half.
    dp = half - h / 2 * (undamped(p + half, q0) - undamped(p, q0)) - h / 2 * undamped(p + half, q1)
    n, mu, settled = momentum_correction(p + dp, q1)
    after, last = damped(p + (dp - n), q1, h / 2)
    report = both(both(first, position_report), both(settled, last))
    return before + (dp - n) + after, dq, (2 / h**2 * nu, 2 / h * mu), report
