"""The right side of a system whose constraints are soft: springs and dampers in accelerations, as in physics engines."""

from daebench.schemes.kernels.language import g
from daebench.schemes.kernels.reduced import force, hidden
from daebench.schemes.kernels.spaces import FORM_DATA, Number, Vector


def f(p: Vector, q: Vector) -> tuple[Vector, Vector, Number]:
    """Return p', q' and the smallest relative pivot of G H_pp G^T.

    ::

        q' = H_p        p' = -H_q - G^T lam        g'' = (1 - r) a - r (c g' + k g)

    a is g'' without lam; k, c and r are stiffness, damping and impedance. With r = 1 it is Baumgarte's equation, with
    2 alpha = c and beta^2 = k. With r < 1, a constraint force displaces it from g = 0 by (1/r - 1) a / k.
    """
    k, c, r = FORM_DATA
    v, gradient, G0, by_mass, value = hidden(p, q)
    change, pivot = force(gradient, G0, by_mass, r * (value + k * g(q) + c * G0 @ v))
    return change, v, pivot
