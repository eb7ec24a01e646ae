"""Lie-Trotter splitting of H = T + U, HLW (1.45): the flow of the kinetic energy, then that of the potential energy."""

from daebench.schemes.kernels.claims import Claims
from daebench.schemes.kernels.language import kinetic_increment
from daebench.schemes.kernels.potential import potential_increment
from daebench.schemes.kernels.spaces import Number, Step, Vector

CLAIMS = Claims(
    order=1,
    symmetric=False,
    symplectic=True,
    keeps_g=True,
    keeps_Gv=True,
    system="constrained",
    source="HLW VII.1.6, (1.45)",
    separable_only=True,
    needs_kinetic_flow=True,
)


def increment(p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1 - p0, q1 - q0, no stage multipliers, and a report.

    ::

        (p^, q1) = phi^T_h(p0, q0)
        p1       = p^ - h (U_q(q1) + G(q1)^T lam),      0 = G(q1) M^-1 p1
    """
    dp, dq = kinetic_increment(p0, q0, (h,))
    kick, report = potential_increment(p0 + dp, q0 + dq, h)
    return dp + kick, dq, (), report
