"""The right side of the penalised system: the constraint replaced by a stiff spring of energy g^T g / (2 eps^2)."""

from daebench.kernels.hole import FORM_DATA, INF, G, H_p, H_q, Number, Vector, axpy, g, mul_T, scale


def f(p: Vector, q: Vector) -> tuple[Vector, Vector, Number]:
    """Return p', q', and infinity in place of a pivot, for nothing is solved.

    ::

        q' = H_p        p' = -H_q - G^T g / eps^2
    """
    (eps,) = FORM_DATA
    return scale(-1.0, axpy(1.0 / (eps * eps), mul_T(G(q), g(q)), H_q(p, q))), H_p(p, q), INF
