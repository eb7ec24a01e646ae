"""The right side of Baumgarte's equation: (1.18) with feedback of the constraint residuals."""

from daebench.schemes.kernels.language import g
from daebench.schemes.kernels.reduced import force, hidden
from daebench.schemes.kernels.spaces import FORM_DATA, Number, Vector


def f(p: Vector, q: Vector) -> tuple[Vector, Vector, Number]:
    """Return p', q' and the smallest relative pivot of G H_pp G^T.

    ::

        q' = H_p        p' = -H_q - G^T lam        0 = (1.12) + 2 alpha G H_p + beta^2 g
    """
    alpha, beta = FORM_DATA
    v, gradient, G0, by_mass, value = hidden(p, q)
    drawn = value + beta**2 * g(q) + 2 * alpha * G0 @ v
    change, pivot = force(gradient, G0, by_mass, drawn)
    return change, v, pivot
