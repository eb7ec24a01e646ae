"""The classical Runge-Kutta method on the index-reduced ODE, HLW (1.18): explicit and accurate, without structure preservation."""

from daebench.schemes.kernels.claims import Claims
from daebench.schemes.kernels.language import f, norm
from daebench.schemes.kernels.newton import linear
from daebench.schemes.kernels.spaces import Number, Step, Vector

CLAIMS = Claims(order=4, symmetric=False, symplectic=False, keeps_g=False, keeps_Gv=False, system="ode", source="HLW II.1.1", any_form=True)


def increment(p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1 - p0, q1 - q0, no stage multipliers, and a report.

    ::

        k1 = f(x0)        k2 = f(x0 + h/2 k1)        k3 = f(x0 + h/2 k2)        k4 = f(x0 + h k3)
        x1 = x0 + h/6 (k1 + 2 k2 + 2 k3 + k4)
    """
    F1, v1, pivot1 = f(p0, q0)
    F2, v2, pivot2 = f(p0 + h / 2 * F1, q0 + h / 2 * v1)
    F3, v3, pivot3 = f(p0 + h / 2 * F2, q0 + h / 2 * v2)
    F4, v4, pivot4 = f(p0 + h * F3, q0 + h * v3)
    dp = h / 6 * (F1 + 2 * (F2 + F3) + F4)
    dq = h / 6 * (v1 + 2 * (v2 + v3) + v4)
    pivot = min(min(pivot1, pivot2), min(pivot3, pivot4))
    return dp, dq, (), linear(pivot, 0 * (norm(dp) + norm(dq)))
