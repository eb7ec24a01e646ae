"""The right side in local coordinates of the manifold, HLW (2.22); eta stands for p here, and xi for q."""

from daebench.schemes.kernels.language import K_y, solve_2d, two_form
from daebench.schemes.kernels.spaces import Number, Vector


def f(p: Vector, q: Vector) -> tuple[Vector, Vector, Number]:
    """Return eta', xi' and the smallest relative pivot of X^T J X, which is singular if the chart is.

    ::

        X^T J X y' = grad K(y)        y = (eta, xi)        K(y) = H(chi(y))        X = chi'(y)
    """
    return solve_2d(two_form(p, q), K_y(p, q))
