"""Strang splitting of H = T + U, HLW (1.45): half the flow of the kinetic energy on either side of that of the potential energy.

This is variational splitting, HLW (4.7)-(4.8), with H^[1] = T and H^[2] = U: both flows are flows of the restrictions of T and of U to the
manifold, and thus Poisson flows in every chart of it.
"""

from dataclasses import replace

from daebench.schemes.kernels.language import kinetic_increment
from daebench.schemes.kernels.potential import potential_increment
from daebench.schemes.kernels.spaces import Number, Step, Vector
from daebench.schemes.lie import CLAIMS as LIE

CLAIMS = replace(LIE, order=2, symmetric=True)


def increment(p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1 - p0, q1 - q0, no stage multipliers, and a report.

    ::

        (p-, q_half) = phi^T_{h/2}(p0, q0)
        p+           = p- - h (U_q(q_half) + G(q_half)^T lam),      0 = G(q_half) M^-1 p+
        (p1, q1)     = phi^T_{h/2}(p+, q_half)
    """
    # With the kinetic flow outside, forces are evaluated once in a step.
    dp, dq = kinetic_increment(p0, q0, (h / 2,))
    p, q_half = p0 + dp, q0 + dq
    kick, report = potential_increment(p, q_half, h)
    more_p, more_q = kinetic_increment(p + kick, q_half, (h / 2,))
    return dp + (kick + more_p), dq + more_q, (), report
