"""The classical Runge-Kutta method on the index-reduced ODE, HLW (1.18): explicit, accurate, and blind to all structure."""

from typing import Any

from daebench.claims import Claims
from daebench.kernels.hole import Number, Vector, axpy, f, norm, scale
from daebench.kernels.newton import linear

CLAIMS = Claims(order=4, symmetric=False, symplectic=False, keeps_g=False, keeps_Gv=False, system="ode", source="HLW II.1.1", any_form=True)


def increment(p0: Vector, q0: Vector, h: Number) -> Any:
    """Return p1 - p0, q1 - q0, no raw multipliers, and a report.

    ::

        k1 = f(x0)        k2 = f(x0 + h/2 k1)        k3 = f(x0 + h/2 k2)        k4 = f(x0 + h k3)
        x1 = x0 + h/6 (k1 + 2 k2 + 2 k3 + k4)
    """
    F1, v1, pivot1 = f(p0, q0)
    F2, v2, pivot2 = f(axpy(0.5 * h, F1, p0), axpy(0.5 * h, v1, q0))
    F3, v3, pivot3 = f(axpy(0.5 * h, F2, p0), axpy(0.5 * h, v2, q0))
    F4, v4, pivot4 = f(axpy(h, F3, p0), axpy(h, v3, q0))
    dp = scale(h / 6.0, axpy(1.0, F4, axpy(2.0, axpy(1.0, F2, F3), F1)))
    dq = scale(h / 6.0, axpy(1.0, v4, axpy(2.0, axpy(1.0, v2, v3), v1)))
    pivot = min(min(pivot1, pivot2), min(pivot3, pivot4))
    return dp, dq, (), linear(pivot, 0.0 * (norm(dp) + norm(dq)))
