"""The manifold g = 0, G H_p = 0: its normals, the correction that leads to it, and the orthogonal projection onto it."""

from typing import Any

from daebench.kernels.hole import (
    LENGTH,
    G,
    Gv_p,
    Gv_q,
    H_p,
    H_pp,
    Matrix,
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
    plus_mm,
    scale_mm,
    solve_2m,
    zero_m,
)
from daebench.kernels.newton import newton


def normals(p: Vector, q: Vector, inverse_mass: Matrix, mass_: Matrix) -> tuple[Matrix, Matrix, Matrix]:
    """Return D^-1 C^T with C = (g, G H_p)', the normals of the manifold in the metric dq^T M dq + dp^T M^-1 dp.

    These are M Gv_p^T, the momenta of mu, and M^-1 G^T and M^-1 Gv_q^T, the positions of nu and mu; all as rows.
    """
    return apply_md(mass_, Gv_p(p, q)), apply_md(inverse_mass, G(q)), apply_md(inverse_mass, Gv_q(p, q))


def shift(down: tuple[Matrix, Matrix, Matrix], nu: Multiplier, mu: Multiplier) -> tuple[Vector, Vector]:
    """Return the normal vector D^-1 C^T (nu, mu), its momenta first."""
    return mul_full_T(down[0], mu), axpy(1.0, mul_full_T(down[1], nu), mul_full_T(down[2], mu))


def correction(w: Number, x: Any, p_free: Vector, q_free: Vector, inverse_mass: Matrix, mass_: Matrix) -> Any:
    """Return what to subtract from x = (p, q, nu, mu); and size, scale, residual and pivot, as Newton's iteration wants them.

    It leads to the point of the manifold that differs from the free one by a normal vector there; second derivatives of the
    constraints, which the small multipliers carry, are left out. The free point itself moves by w - 1 times that vector::

        dy - w D^-1 C^T (dnu, dmu) = y - y_free - D^-1 C^T (nu, mu)        C dy = (g, G H_p)        y = (p, q)
    """
    p, q, nu, mu = x
    G1, by_p, by_q = G(q), Gv_p(p, q), Gv_q(p, q)
    down_p, down_g, down_q = apply_md(mass_, by_p), apply_md(inverse_mass, G1), apply_md(inverse_mass, by_q)
    r_p = axpy(-1.0, mul_full_T(down_p, mu), axpy(-1.0, p_free, p))
    r_q = axpy(-1.0, axpy(1.0, mul_full_T(down_g, nu), mul_full_T(down_q, mu)), axpy(-1.0, q_free, q))
    value_g, value_v = g(q), mul(G1, H_p(p, q))
    dnu, dmu, pivot = solve_2m(
        scale_mm(w, gram(G1, down_g)),
        scale_mm(w, gram(G1, down_q)),
        scale_mm(w, gram_full(by_q, down_g)),
        scale_mm(w, plus_mm(gram_full(by_q, down_q), gram_full(by_p, down_p))),
        axpy_m(-1.0, mul(G1, r_q), value_g),
        axpy_m(-1.0, axpy_m(1.0, mul_full(by_p, r_p), mul_full(by_q, r_q)), value_v),
    )
    dp = axpy(w, mul_full_T(down_p, dmu), r_p)
    dq = axpy(w, axpy(1.0, mul_full_T(down_g, dnu), mul_full_T(down_q, dmu)), r_q)
    scale_v, scale_q = norm(apply(inverse_mass, p_free)) + norm(apply(inverse_mass, p)), max(LENGTH, norm(q))
    size = norm(apply(inverse_mass, dp)) * scale_q + norm(dq) * scale_v
    return (dp, dq, dnu, dmu), size, scale_v * scale_q, norm_m(value_g) + norm_m(value_v), pivot


def corrected(x: Any, due: Any) -> Any:
    """Return (p, q, nu, mu) less what is due."""
    return axpy(-1.0, due[0], x[0]), axpy(-1.0, due[1], x[1]), axpy_m(-1.0, due[2], x[2]), axpy_m(-1.0, due[3], x[3])


def improve_projection(x: Any, data: Any) -> Any:
    """One sweep for the point of the manifold."""
    p_free, q_free, inverse_mass, mass_ = data
    due, size, scale, residual, pivot = correction(1.0, x, p_free, q_free, inverse_mass, mass_)
    return corrected(x, due), size, scale, residual, pivot


def project(p: Vector, q: Vector) -> tuple[Vector, Vector, Report]:
    """Return the point of the manifold nearest to (p, q), and a report.

    Minimises dq^T M dq + dp^T M^-1 dp subject to the 2m conditions, with M frozen at the point given; Euclidean for M = I. The
    metric adds energies of positions to those of momenta by a unit of time, 1 s: in another unit another point is the nearest.
    """
    data = (p, q, H_pp(p, q), mass(p, q))
    (p, q, _, _), report = newton(improve_projection, (p, q, zero_m(q), zero_m(q)), data)
    return p, q, report
