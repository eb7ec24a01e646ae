"""The symmetric projection of a step onto the manifold, HLW V.4.1."""

from typing import Any

from daebench.kernels.hole import (
    INF,
    G,
    Gv_p,
    Gv_q,
    H_p,
    H_pp,
    Multiplier,
    Number,
    Report,
    Vector,
    apply,
    apply_md,
    axpy,
    axpy_m,
    g,
    gram,
    gram_full,
    mass,
    mul,
    mul_full,
    mul_full_T,
    norm,
    norm_m,
    plain_step,
    plus_mm,
    plus_work,
    scale_mm,
    solve_2m,
    zero_m,
)
from daebench.kernels.newton import OK, newton


def shift(p: Vector, q: Vector, nu: Multiplier, mu: Multiplier) -> tuple[Vector, Vector]:
    """Return the normal vector of the manifold at (p, q) that (nu, mu) stand for, in the metric of :func:`project`."""
    normal = axpy(1.0, mul_full_T(G(q), nu), mul_full_T(Gv_q(p, q), mu))
    return apply(mass(p, q), mul_full_T(Gv_p(p, q), mu)), apply(H_pp(p, q), normal)


def correction(p: Vector, q: Vector, nu: Multiplier, mu: Multiplier, p_free: Vector, q_free: Vector) -> Any:
    """Return what to subtract from p, q, nu and mu, given the step from the shifted start; and size, scale, residual and pivot.

    With the matrix 2 C D^-1 C^T, HLW V.4.1: the step's own derivative is taken as that of the identity.
    """
    inverse_mass, G1 = H_pp(p, q), G(q)
    by_p, by_q = Gv_p(p, q), Gv_q(p, q)
    back_p, back_q = shift(p, q, nu, mu)
    r_p, r_q = axpy(-1.0, back_p, axpy(-1.0, p_free, p)), axpy(-1.0, back_q, axpy(-1.0, q_free, q))
    down_p, down_g, down_q = apply_md(mass(p, q), by_p), apply_md(inverse_mass, G1), apply_md(inverse_mass, by_q)
    value_g, value_v = g(q), mul(G1, H_p(p, q))
    dnu, dmu, pivot = solve_2m(
        scale_mm(2.0, gram(G1, down_g)),
        scale_mm(2.0, gram(G1, down_q)),
        scale_mm(2.0, gram_full(by_q, down_g)),
        scale_mm(2.0, plus_mm(gram_full(by_q, down_q), gram_full(by_p, down_p))),
        axpy_m(-1.0, mul(G1, r_q), value_g),
        axpy_m(-1.0, axpy_m(1.0, mul_full(by_p, r_p), mul_full(by_q, r_q)), value_v),
    )
    dp = axpy(2.0, mul_full_T(down_p, dmu), r_p)
    dq = axpy(2.0, axpy(1.0, mul_full_T(down_g, dnu), mul_full_T(down_q, dmu)), r_q)
    scale_v, scale_q = norm(apply(inverse_mass, p_free)) + norm(apply(inverse_mass, p)), max(1.0, norm(q))
    size = norm(apply(inverse_mass, dp)) * scale_q + norm(dq) * scale_v
    return (dp, dq, dnu, dmu), size, scale_v * scale_q, norm_m(value_g) + norm_m(value_v), pivot


def improve_symmetric(x: Any, data: Any) -> Any:
    """One sweep: the correction that is due, the step from the start that follows from it, and the correction that is due then.

    No step is thus done in vain: the sweep after which nothing is left to correct is the last.
    """
    p, q, nu, mu, due, work, pivot, _ = x
    p0, q0, h = data
    p, q, nu, mu = axpy(-1.0, due[0], p), axpy(-1.0, due[1], q), axpy_m(-1.0, due[2], nu), axpy_m(-1.0, due[3], mu)
    by_p, by_q = shift(p0, q0, nu, mu)
    p_free, q_free, raw, inner = plain_step(axpy(1.0, by_p, p0), axpy(1.0, by_q, q0), h)
    due, size, scale, residual, own = correction(p, q, nu, mu, p_free, q_free)
    x = (p, q, nu, mu, due, plus_work(work, inner[3]), min(pivot, inner[2]), (raw, inner[0], inner[1]))
    return x, size, scale, residual if inner[0] == OK else INF, own


def step(p0: Vector, q0: Vector, h: Number) -> tuple[Vector, Vector, Any, Report]:
    """Return p1, q1, the raw multipliers of the step inside, and a report.

    ::

        x~ = x0 + N(x0) (nu, mu),      x1 = Phi_h(x~) + N(x1) (nu, mu),      g(q1) = 0,      G(q1) H_p(p1, q1) = 0

    where the columns of N(x) span the normal space of the manifold at x.
    """
    p_free, q_free, raw, inner = plain_step(p0, q0, h)
    none = zero_m(q0)
    due, _, _, _, own = correction(p_free, q_free, none, none, p_free, q_free)
    start = (p_free, q_free, none, none, due, inner[3], min(own, inner[2]), (raw, inner[0], inner[1]))
    (p1, q1, _, _, _, work, pivot, last), report = newton(improve_symmetric, start, (p0, q0, h))
    status = report[0] if last[1] == OK else last[1]
    residual = report[1] if last[1] == OK else last[2]
    return p1, q1, last[0], (status, residual, min(pivot, report[2]), plus_work(work, report[3]))
