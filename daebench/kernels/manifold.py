"""The orthogonal projection of a state onto the manifold g = 0, G H_p = 0."""

from typing import Any

from daebench.kernels.hole import (
    G,
    Gv_p,
    Gv_q,
    H_p,
    H_pp,
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
    plus_mm,
    solve_2m,
    zero_m,
)
from daebench.kernels.newton import newton


def improve_projection(x: Any, data: Any) -> Any:
    """One sweep of Newton's iteration without the second derivatives of the constraints, which the small multipliers carry."""
    p, q, nu, mu = x
    p_free, q_free, inverse_mass, mass_ = data
    G1, by_p, by_q = G(q), Gv_p(p, q), Gv_q(p, q)
    down_p, down_g, down_q = apply_md(mass_, by_p), apply_md(inverse_mass, G1), apply_md(inverse_mass, by_q)
    r_p = axpy(1.0, mul_full_T(down_p, mu), axpy(-1.0, p_free, p))
    r_q = axpy(1.0, axpy(1.0, mul_full_T(down_g, nu), mul_full_T(down_q, mu)), axpy(-1.0, q_free, q))
    value_g, value_v = g(q), mul(G1, H_p(p, q))
    dnu, dmu, pivot = solve_2m(
        gram(G1, down_g),
        gram(G1, down_q),
        gram_full(by_q, down_g),
        plus_mm(gram_full(by_q, down_q), gram_full(by_p, down_p)),
        axpy_m(-1.0, value_g, mul(G1, r_q)),
        axpy_m(-1.0, value_v, axpy_m(1.0, mul_full(by_p, r_p), mul_full(by_q, r_q))),
    )
    dp = axpy(-1.0, mul_full_T(down_p, dmu), r_p)
    dq = axpy(-1.0, axpy(1.0, mul_full_T(down_g, dnu), mul_full_T(down_q, dmu)), r_q)
    x = (axpy(-1.0, dp, p), axpy(-1.0, dq, q), axpy_m(-1.0, dnu, nu), axpy_m(-1.0, dmu, mu))
    scale_v, scale_q = norm(apply(inverse_mass, p_free)) + norm(apply(inverse_mass, p)), max(1.0, norm(q))
    return x, norm(apply(inverse_mass, dp)) * scale_q + norm(dq) * scale_v, scale_v * scale_q, norm_m(value_g) + norm_m(value_v), pivot


def project(p: Vector, q: Vector) -> tuple[Vector, Vector, Report]:
    """Return the point of the manifold nearest to (p, q), and a report.

    Minimises dq^T M dq + dp^T M^-1 dp subject to the 2m conditions, with M frozen at the point given; Euclidean for M = I.
    """
    data = (p, q, H_pp(p, q), mass(p, q))
    (p, q, _, _), report = newton(improve_projection, (p, q, zero_m(q), zero_m(q)), data)
    return p, q, report
