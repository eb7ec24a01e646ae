"""Constrained implicit Euler: (1.19) with every argument at the new point, HLW Fig. 1.2; it loses energy at once."""

from typing import Any

from daebench.claims import Claims
from daebench.kernels.constrain import tangent
from daebench.kernels.eliminate import eliminate
from daebench.kernels.hole import (
    LENGTH,
    G,
    H_p,
    H_pp,
    H_q,
    H_qp,
    H_qq,
    Multiplier,
    Number,
    Report,
    Vector,
    apply,
    axpy,
    axpy_dd,
    axpy_m,
    curvature,
    g,
    mul_T,
    norm,
    norm_m,
    scale_md,
    zero_m,
)
from daebench.kernels.newton import both, newton

CLAIMS = Claims(
    order=1, symmetric=False, symplectic=False, keeps_g=True, keeps_Gv=True, system="constrained", source="HLW VII.1.3, below Fig. 1.2"
)


def improve(x: tuple[Vector, Vector, Multiplier], data: tuple[Vector, Vector, Number]) -> Any:
    """One Newton sweep for p, q and lam; q and then p are eliminated."""
    p, q, lam = x
    p0, q0, h = data
    G1 = G(q)
    force = axpy(1.0, mul_T(G1, lam), H_q(p, q))
    r_p = axpy(h, force, axpy(-1.0, p0, p))
    r_q = axpy(-h, H_p(p, q), axpy(-1.0, q0, q))
    value, by_mass = g(q), H_pp(p, q)
    stiffness = axpy_dd(1.0, curvature(q, lam), H_qq(p, q))
    dp, dq, change, pivot = eliminate(h, (r_p, r_q, value), H_qp(p, q), by_mass, stiffness, scale_md(h, G1), G1)
    x = (axpy(-1.0, dp, p), axpy(-1.0, dq, q), axpy_m(-1.0, change, lam))
    residual = norm(r_p) + norm(r_q) + norm_m(value)
    return x, norm(dq) + abs(h) * norm(apply(by_mass, dp)), max(LENGTH, norm(q)), residual, pivot


def step(p0: Vector, q0: Vector, h: Number) -> tuple[Vector, Vector, Any, Report]:
    """Return p1, q1, no raw multipliers, and a report.

    ::

        p_hat = p0 - h (H_q(p_hat, q1) + G(q1)^T lam)
        q1    = q0 + h H_p(p_hat, q1),             0 = g(q1)
        p1    = p_hat - h G(q1)^T mu,              0 = G(q1) H_p(p1, q1)
    """
    (p_hat, q1, _), found = newton(improve, (p0, q0, zero_m(q0)), (p0, q0, h))
    p1, _, settled = tangent(p_hat, q1)
    return p1, q1, (), both(found, settled)
