"""The classical Runge-Kutta method on y' = B(y) grad H(y): explicit, accurate, and blind to all structure."""

from daebench.claims import PoissonClaims
from daebench.kernels.hole import INF, Number, Report, Vector, axpy, no_work
from daebench.kernels.newton import OK
from daebench.kernels.poisson_hole import field

CLAIMS = PoissonClaims(order=4, symmetric=False, poisson="", keeps="linear", source="HLW II.1.1")


def step(y0: Vector, h: Number) -> tuple[Vector, Report]:
    """Return y1 and a report.

    ::

        k1 = f(y0)        k2 = f(y0 + h/2 k1)        k3 = f(y0 + h/2 k2)        k4 = f(y0 + h k3)
        y1 = y0 + h/6 (k1 + 2 k2 + 2 k3 + k4)
    """
    k1 = field(y0)
    k2 = field(axpy(0.5 * h, k1, y0))
    k3 = field(axpy(0.5 * h, k2, y0))
    k4 = field(axpy(h, k3, y0))
    y1 = axpy(h / 6.0, axpy(1.0, k4, axpy(2.0, axpy(1.0, k2, k3), k1)), y0)
    return y1, (OK, 0.0 * h, INF, no_work())
