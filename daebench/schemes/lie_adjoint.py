"""Adjoint of the Lie-Trotter splitting of H = T + U, HLW (1.45): the flow of the potential energy, then that of the kinetic energy."""

from daebench.schemes.kernels.language import kinetic_increment
from daebench.schemes.kernels.potential import potential_increment
from daebench.schemes.kernels.spaces import Number, Step, Vector
from daebench.schemes.lie import CLAIMS as LIE

CLAIMS = LIE


def increment(p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1 - p0, q1 - q0, no stage multipliers, and a report.

    ::

        p^       = p0 - h (U_q(q0) + G(q0)^T lam),      0 = G(q0) M^-1 p^
        (p1, q1) = phi^T_h(p^, q0)
    """
    kick, report = potential_increment(p0, q0, h)
    dp, dq = kinetic_increment(p0 + kick, q0, (h,))
    return dp + kick, dq, (), report
