"""Energy-momentum scheme of Gonzalez with constraints: the midpoint rule with discrete derivatives in place of H_q and G."""

from daebench.schemes.kernels.claims import Claims, Member
from daebench.schemes.kernels.eliminate import eliminate
from daebench.schemes.kernels.language import EPS, G, H, H_p, H_pp, H_q, H_qp, H_qq, curvature, dot, g, norm, zero
from daebench.schemes.kernels.mixed import by_position
from daebench.schemes.kernels.newton import newton
from daebench.schemes.kernels.spaces import LENGTH, Multiplier, Number, Rows, Step, Update, Vector

CLAIMS = Claims(
    order=2,
    symmetric=True,
    symplectic=False,
    keeps_g=True,
    keeps_Gv=False,
    system="constrained",
    source="Gonzalez, Physica D 132 (1999)",
    conserves_energy=True,
    quadratic_only=True,
)
MEMBERS = {"energy_momentum": Member(claims=CLAIMS, multipliers=lambda: {"lam_mid": 0.5})}


def along(dq: Vector, q: Vector) -> Vector:
    """Return dq/|dq|^2, the direction of the corrections of the discrete derivatives; it goes to zero with dq below sqrt(eps) |q|.

    There its factor, which is at least of first order in dq, is lost in the rounding of H and g, which 1/|dq| would amplify.
    """
    # The last term only prevents 0/0 where q and dq are zero; it is too small to change any other value.
    return dq / (dot(dq, dq) + EPS * dot(q, q) + EPS * EPS * EPS * EPS * LENGTH * LENGTH)


def forces(p0: Vector, q0: Vector, dp: Vector, dq: Vector) -> tuple[Vector, Rows, Multiplier]:
    """Return the discrete derivatives D_q H, shape(d,), and DG, shape(m, d), and g(q1)."""
    p, q, p1, q1 = p0 + dp / 2, q0 + dq / 2, p0 + dp, q0 + dq
    gradient, jacobian, direction, value = H_q(p, q), G(q), along(dq, q), g(q1)
    missing_H = (H(p1, q1) - H(p0, q0)) - dot(H_p(p, q), dp) - dot(gradient, dq)
    missing_g = value - g(q0) - jacobian @ dq
    return gradient + missing_H * direction, jacobian + missing_g @ direction.T, value


def update(x: tuple[Vector, Vector, Multiplier], data: tuple[Vector, Vector, Number]) -> Update:
    """One update of p1 - p0, q1 - q0 and lam, with the derivatives of the midpoint rule; q and then p are eliminated."""
    dp, dq, lam = x
    p0, q0, h = data
    p, q, half = p0 + dp / 2, q0 + dq / 2, h / 2
    gradient, DG, value = forces(p0, q0, dp, dq)
    r_p = dp + h * (gradient + DG.T @ lam)
    r_q = dq - h * H_p(p, q)
    by_mass, stiffness, G1 = H_pp(p, q), H_qq(p, q) + curvature(q, lam), G(q0 + dq)
    H_qp_ = H_qp(p, q)
    mixed = (H_qp_, by_position(p, q, H_qp_))
    back_p, back_q, change, pivot = eliminate(half, (r_p, r_q, value), mixed, by_mass, stiffness, h * DG, G1)
    x = (dp - back_p, dq - back_q, lam - change)
    residual = norm(r_p) + norm(r_q) + norm(value)
    return x, norm(back_q) + abs(half) * norm(by_mass @ back_p), max(LENGTH, norm(q)), residual, pivot


def increment(p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1 - p0, q1 - q0, lam in the middle of the step, and a report.

    H is conserved by construction, because H_p(zm).dp + D_q H.dq = H(z1) - H(z0) and DG dq = g(q1) - g(q0). If H and g are at most
    quadratic in q, both corrections vanish, and quadratic integrals such as angular momenta are conserved. Otherwise they are not, as a
    correction along dq does not respect the symmetry. Stage multipliers alternate about lam by h; the mean of two in a row is of second
    order. Below h about 1e-7 the rounding of g, eps/h in the momenta, dominates. With z = (p, q) and m for the mean of both ends::

        dq = h H_p(zm),      dp = -h (D_q H + DG^T lam),      0 = g(q1)
        D_q H = H_q(zm) + (H(z1) - H(z0) - H_p(zm).dp - H_q(zm).dq) dq/|dq|^2
        DG    = G(qm) + (g(q1) - g(q0) - G(qm) dq) dq^T/|dq|^2
    """
    still = 0 * p0
    (dp, dq, lam), report = newton(update, (still, still, zero(q0)), (p0, q0, h))
    return dp, dq, (lam,), report
