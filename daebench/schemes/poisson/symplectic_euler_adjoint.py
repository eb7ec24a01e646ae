"""The adjoint of the symplectic Euler method for Poisson systems in halves y = (u, v), HLW Example 4.7: explicit in u, implicit in v."""

from dataclasses import replace
from typing import Any

from daebench.kernels.hole import LENGTH, Number, Report, Vector, axpy_m, norm_m
from daebench.kernels.newton import newton
from daebench.kernels.poisson_hole import DENSE, first_half, joined, rate_u, rate_v, second_half
from daebench.schemes.poisson.symplectic_euler import CLAIMS as SYMPLECTIC_EULER

if DENSE:
    from daebench.kernels.hole import solve
    from daebench.kernels.poisson_hole import identity_minus, rate_v_v

    def improve(v: Any, data: Any) -> Any:
        """One Newton sweep for v."""
        y0, h = data
        y = joined(first_half(y0), v, y0)
        r = axpy_m(-1.0, second_half(y0), axpy_m(-h, rate_v(y), v))
        dv, pivot = solve(identity_minus(h, rate_v_v(y)), r)
        return axpy_m(-1.0, dv, v), norm_m(dv), max(LENGTH, norm_m(v)), norm_m(r), pivot

else:
    from daebench.kernels.hole import INF

    def improve(v: Any, data: Any) -> Any:
        """One sweep of fixed-point iteration for v."""
        y0, h = data
        new = axpy_m(h, rate_v(joined(first_half(y0), v, y0)), second_half(y0))
        change = norm_m(axpy_m(-1.0, v, new))
        return new, change, max(LENGTH, norm_m(new)), change, INF


CLAIMS = replace(SYMPLECTIC_EULER)


def step(y0: Vector, h: Number) -> tuple[Vector, Report]:
    """Return y1 and a report, for f = B grad H.

    ::

        v1 = v0 + h f_v(u0, v1)        u1 = u0 + h f_u(u0, v1)
    """
    v1, report = newton(improve, second_half(y0), (y0, h))
    y = joined(first_half(y0), v1, y0)
    return joined(axpy_m(h, rate_u(y), first_half(y0)), v1, y0), report
