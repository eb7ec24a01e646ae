"""Explicit Euler on y' = B(y) grad H(y): the simplest method there is, for comparison; its orbits spiral outwards."""

from daebench.schemes.kernels.claims import PoissonClaims
from daebench.schemes.kernels.language import INF, no_work
from daebench.schemes.kernels.newton import OK
from daebench.schemes.kernels.poisson_language import field
from daebench.schemes.kernels.spaces import Number, Report, Vector

CLAIMS = PoissonClaims(order=1, symmetric=False, poisson="", keeps="linear", source="HLW I.1.2, (1.5)")


def step(y0: Vector, h: Number) -> tuple[Vector, Report]:
    """Return y1 and a report.

    ::

        y1 = y0 + h f(y0)
    """
    return y0 + h * field(y0), (OK, 0 * h, INF, no_work())
