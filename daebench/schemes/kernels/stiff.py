"""The right side of the penalised system: the constraint replaced by a stiff spring of energy g^T g / (2 eps^2)."""

from daebench.schemes.kernels.language import INF, G, H_p, H_q, g
from daebench.schemes.kernels.spaces import FORM_DATA, Number, Vector


def f(p: Vector, q: Vector) -> tuple[Vector, Vector, Number]:
    """Return p', q', and infinity in place of a pivot, because no linear system is solved.

    ::

        q' = H_p        p' = -H_q - G^T g / eps^2
    """
    (eps,) = FORM_DATA
    return -(H_q(p, q) + G(q).T @ g(q) / eps**2), H_p(p, q), INF
