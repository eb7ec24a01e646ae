"""The symplectic Euler method for Poisson systems in halves y = (u, v), HLW Example 4.7: implicit in u, explicit in v."""

from typing import Any

from daebench.claims import PoissonClaims
from daebench.kernels.hole import LENGTH, Number, Report, Vector, axpy_m, norm_m
from daebench.kernels.newton import newton
from daebench.kernels.poisson_hole import DENSE, first_half, joined, rate_u, rate_v, second_half

if DENSE:
    from daebench.kernels.hole import solve
    from daebench.kernels.poisson_hole import identity_minus, rate_u_u

    def improve(u: Any, data: Any) -> Any:
        """One Newton sweep for u."""
        y0, h = data
        y = joined(u, second_half(y0), y0)
        r = axpy_m(-1.0, first_half(y0), axpy_m(-h, rate_u(y), u))
        du, pivot = solve(identity_minus(h, rate_u_u(y)), r)
        return axpy_m(-1.0, du, u), norm_m(du), max(LENGTH, norm_m(u)), norm_m(r), pivot

else:
    from daebench.kernels.hole import INF

    def improve(u: Any, data: Any) -> Any:
        """One sweep of fixed-point iteration for u."""
        y0, h = data
        new = axpy_m(h, rate_u(joined(u, second_half(y0), y0)), first_half(y0))
        change = norm_m(axpy_m(-1.0, u, new))
        return new, change, max(LENGTH, norm_m(new)), change, INF


CLAIMS = PoissonClaims(order=1, symmetric=False, poisson="bilinear", halves=True, source="HLW Example 4.7")


def step(y0: Vector, h: Number) -> tuple[Vector, Report]:
    """Return y1 and a report, for f = B grad H.

    ::

        u1 = u0 + h f_u(u1, v0)        v1 = v0 + h f_v(u1, v0)

    With u' = d(u, v) L'(v), v' = -d(u, v) K'(u) it is a Poisson map for uv, as in the book, and for every d that is linear in u and in v:
    then d(u0, v0) = d(u1, v0) (1 - h d_u L') and d(u1, v1) = d(u1, v0) (1 - h d_v K'), and their ratio is det Phi'.
    """
    u1, report = newton(improve, first_half(y0), (y0, h))
    y = joined(u1, second_half(y0), y0)
    return joined(u1, axpy_m(h, rate_v(y), second_half(y0)), y0), report
