"""The adjoint of Lie-Trotter splitting of a Poisson system, HLW VII.4.2: the same flows in the opposite order."""

from dataclasses import replace

from daebench.schemes.kernels.language import INF, no_work
from daebench.schemes.kernels.newton import OK
from daebench.schemes.kernels.poisson_language import after, turn
from daebench.schemes.kernels.spaces import Number, Report, Vector
from daebench.schemes.poisson.lie import CLAIMS as LIE

CLAIMS = replace(LIE)


def step(y0: Vector, h: Number) -> tuple[Vector, Report]:
    """Return y1 and a report.

    ::

        y1 = phi^[1]_h o ... o phi^[m]_h (y0)        H = H^[1] + ... + H^[m]
    """
    return after(turn(y0, (h,)), (h,)), (OK, 0 * h, INF, no_work())
