"""Lie-Trotter splitting of H = T + U, HLW (1.45): the flow of the kinetic energy, then that of the potential energy."""

from typing import Any

from daebench.claims import Claims
from daebench.kernels.hole import Number, Vector, axpy, kinetic_increment
from daebench.kernels.potential import potential_increment

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


def increment(p0: Vector, q0: Vector, h: Number) -> Any:
    """Return p1 - p0, q1 - q0, no raw multipliers, and a report.

    ::

        (p^, q1) = phi^T_h(p0, q0)
        p1       = p^ - h (U_q(q1) + G(q1)^T lam),      0 = G(q1) M^-1 p1
    """
    dp, dq = kinetic_increment(p0, q0, (h,))
    kick, report = potential_increment(axpy(1.0, dp, p0), axpy(1.0, dq, q0), h)
    return axpy(1.0, kick, dp), dq, (), report
