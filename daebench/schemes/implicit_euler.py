"""Constrained implicit Euler: (1.19) with every argument at the new point, HLW Fig. 1.2; it dissipates energy from the first step."""

from daebench.schemes.kernels.claims import Claims
from daebench.schemes.kernels.constrain import project_momentum
from daebench.schemes.kernels.eliminate import eliminate
from daebench.schemes.kernels.language import G, H_p, H_pp, H_q, H_qp, H_qq, curvature, g, norm, zero
from daebench.schemes.kernels.mixed import by_position
from daebench.schemes.kernels.newton import both, newton
from daebench.schemes.kernels.spaces import LENGTH, Multiplier, Number, Step, Update, Vector

CLAIMS = Claims(
    order=1, symmetric=False, symplectic=False, keeps_g=True, keeps_Gv=True, system="constrained", source="HLW VII.1.3, below Fig. 1.2"
)


def update(x: tuple[Vector, Vector, Multiplier], data: tuple[Vector, Vector, Number]) -> Update:
    """One Newton update for p, q and lam; q and then p are eliminated."""
    p, q, lam = x
    p0, q0, h = data
    G1 = G(q)
    force = H_q(p, q) + G1.T @ lam
    r_p = p - p0 + h * force
    r_q = q - q0 - h * H_p(p, q)
    value, by_mass = g(q), H_pp(p, q)
    stiffness, H_qp_ = H_qq(p, q) + curvature(q, lam), H_qp(p, q)
    mixed = (H_qp_, by_position(p, q, H_qp_))
    dp, dq, change, pivot = eliminate(h, (r_p, r_q, value), mixed, by_mass, stiffness, h * G1, G1)
    x = (p - dp, q - dq, lam - change)
    residual = norm(r_p) + norm(r_q) + norm(value)
    return x, norm(dq) + abs(h) * norm(by_mass @ dp), max(LENGTH, norm(q)), residual, pivot


def step(p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1, q1, no stage multipliers, and a report.

    ::

        p_hat = p0 - h (H_q(p_hat, q1) + G(q1)^T lam)
        q1    = q0 + h H_p(p_hat, q1),             0 = g(q1)
        p1    = p_hat - h G(q1)^T mu,              0 = G(q1) H_p(p1, q1)
    """
    (p_hat, q1, _), newton_report = newton(update, (p0, q0, zero(q0)), (p0, q0, h))
    # p_hat meets no condition on velocities; the projection is (1.20), as after constrained symplectic Euler.
    p1, _, settled = project_momentum(p_hat, q1)
    return p1, q1, (), both(newton_report, settled)
