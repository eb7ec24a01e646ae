"""The right side of Baumgarte's equation: (1.18) with the hidden constraint drawn back to the manifold."""

from daebench.kernels.hole import (
    FORM_DATA,
    G,
    Gv_q,
    H_p,
    H_q,
    Number,
    Vector,
    axpy,
    axpy_m,
    g,
    gram,
    mul,
    mul_full,
    mul_T,
    rows,
    scale,
    solve,
)


def f(p: Vector, q: Vector) -> tuple[Vector, Vector, Number]:
    """Return p', q' and the smallest relative pivot of G H_pp G^T.

    ::

        q' = H_p        p' = -H_q - G^T lam        0 = (1.12) + 2 alpha G H_p + beta^2 g
    """
    alpha, beta = FORM_DATA
    v, gradient, G0 = H_p(p, q), H_q(p, q), G(q)
    by_mass = rows(G0, p, q)
    hidden = axpy_m(-1.0, mul_full(by_mass, gradient), mul_full(Gv_q(p, q), v))
    value = axpy_m(2.0 * alpha, mul(G0, v), axpy_m(beta * beta, g(q), hidden))
    lam, pivot = solve(gram(G0, by_mass), value)
    return scale(-1.0, axpy(1.0, mul_T(G0, lam), gradient)), v, pivot
