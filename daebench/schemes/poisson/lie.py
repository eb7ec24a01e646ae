"""Lie-Trotter splitting of a Poisson system, HLW VII.4.2: the flows of all parts of H one after another."""

from daebench.schemes.kernels.claims import PoissonClaims
from daebench.schemes.kernels.language import INF, no_work
from daebench.schemes.kernels.newton import OK
from daebench.schemes.kernels.poisson_language import before, turn
from daebench.schemes.kernels.spaces import Number, Report, Vector

CLAIMS = PoissonClaims(order=1, symmetric=False, poisson="split", source="HLW VII.4.2")


def step(y0: Vector, h: Number) -> tuple[Vector, Report]:
    """Return y1 and a report.

    ::

        y1 = phi^[m]_h o ... o phi^[1]_h (y0)        H = H^[1] + ... + H^[m]
    """
    return turn(before(y0, (h,)), (h,)), (OK, 0 * h, INF, no_work())
