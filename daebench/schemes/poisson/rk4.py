"""The classical Runge-Kutta method on y' = B(y) grad H(y): explicit and accurate, without structure preservation."""

from daebench.schemes.kernels.claims import PoissonClaims
from daebench.schemes.kernels.language import INF, no_work
from daebench.schemes.kernels.newton import OK
from daebench.schemes.kernels.poisson_language import field
from daebench.schemes.kernels.spaces import Number, Report, Vector

CLAIMS = PoissonClaims(order=4, symmetric=False, poisson="", keeps="linear", source="HLW II.1.1")


def step(y0: Vector, h: Number) -> tuple[Vector, Report]:
    """Return y1 and a report.

    ::

        k1 = f(y0)        k2 = f(y0 + h/2 k1)        k3 = f(y0 + h/2 k2)        k4 = f(y0 + h k3)
        y1 = y0 + h/6 (k1 + 2 k2 + 2 k3 + k4)
    """
    k1 = field(y0)
    k2 = field(y0 + h / 2 * k1)
    k3 = field(y0 + h / 2 * k2)
    k4 = field(y0 + h * k3)
    y1 = y0 + h / 6 * (k1 + 2 * (k2 + k3) + k4)
    return y1, (OK, 0 * h, INF, no_work())
