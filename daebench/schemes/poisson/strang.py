"""Strang splitting of a Poisson system, HLW VII.4.2, (4.6) for two parts: half a step of each flow, and back in the opposite order."""

from dataclasses import replace

from daebench.schemes.kernels.language import INF, no_work
from daebench.schemes.kernels.newton import OK
from daebench.schemes.kernels.poisson_language import after, before, turn
from daebench.schemes.kernels.spaces import Number, Report, Vector
from daebench.schemes.poisson.lie import CLAIMS as LIE

CLAIMS = replace(LIE, order=2, symmetric=True, source="HLW VII.4.2; (4.6) for two parts")


def step(y0: Vector, h: Number) -> tuple[Vector, Report]:
    """Return y1 and a report; the two half steps of the last part in the middle are one.

    ::

        y1 = phi^[1]_{h/2} o ... o phi^[m]_h o ... o phi^[1]_{h/2} (y0)        H = H^[1] + ... + H^[m]
    """
    half = h / 2
    return after(turn(before(y0, (half,)), (h,)), (half,)), (OK, 0 * h, INF, no_work())
