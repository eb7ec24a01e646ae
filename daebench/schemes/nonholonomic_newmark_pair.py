"""Composition of Newmark's method for constraints on velocities with its adjoint: symmetric, while each of them is not."""

from dataclasses import replace

from daebench.schemes.kernels.claims import Member
from daebench.schemes.kernels.newton import both
from daebench.schemes.kernels.spaces import Number, Step, Vector
from daebench.schemes.nonholonomic_newmark import CLAIMS as NEWMARK
from daebench.schemes.nonholonomic_newmark import OPTIONS, adjoint, numbers
from daebench.schemes.nonholonomic_newmark import increment as newmark

CLAIMS = replace(NEWMARK, symmetric=True)
MEMBERS = {"nonholonomic_newmark_pair": Member(claims=CLAIMS, numbers=numbers, options=OPTIONS, simplified=True)}


def increment(p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1 - p0, q1 - q0, no stage multipliers, and a report.

    ::

        (p_half, q_half) = Phi_{h/2}(p0, q0)                       Newmark's method
        (p1, q1)         = Phi_{-h/2}^-1(p_half, q_half)           its adjoint

    At q_half both half steps have multipliers of their own, and at q0 and q1 that of (1.18).
    """
    dp, dq, _, first = newmark(p0, q0, h / 2)
    more_p, more_q, _, second = adjoint(p0 + dp, q0 + dq, h / 2)
    return dp + more_p, dq + more_q, (), both(first, second)
