"""The adjoint of the symplectic Euler method for Poisson systems in halves y = (u, v), HLW Example 4.7: explicit in u, implicit in v."""

from dataclasses import replace

from daebench.schemes.kernels.language import INF, norm, solve
from daebench.schemes.kernels.newton import newton
from daebench.schemes.kernels.poisson_language import DENSE, first_half, joined, rate_u, rate_v, second_half
from daebench.schemes.kernels.spaces import LENGTH, Half, I, Number, Report, Update, Vector
from daebench.schemes.poisson.symplectic_euler import CLAIMS as SYMPLECTIC_EULER

if DENSE:
    from daebench.schemes.kernels.poisson_language import rate_v_v

    def update(v: Half, data: tuple[Vector, Number]) -> Update:
        """One Newton update for v."""
        y0, h = data
        y = joined(first_half(y0), v, y0)
        r = v - h * rate_v(y) - second_half(y0)
        dv, pivot = solve(I - h * rate_v_v(y), r)
        return v - dv, norm(dv), max(LENGTH, norm(v)), norm(r), pivot

else:

    def update(v: Half, data: tuple[Vector, Number]) -> Update:
        """One fixed-point update of v."""
        y0, h = data
        new = second_half(y0) + h * rate_v(joined(first_half(y0), v, y0))
        change = norm(new - v)
        return new, change, max(LENGTH, norm(new)), change, INF


CLAIMS = replace(SYMPLECTIC_EULER)


def step(y0: Vector, h: Number) -> tuple[Vector, Report]:
    """Return y1 and a report, for f = B grad H.

    ::

        v1 = v0 + h f_v(u0, v1)        u1 = u0 + h f_u(u0, v1)
    """
    v1, report = newton(update, second_half(y0), (y0, h))
    y = joined(first_half(y0), v1, y0)
    return joined(first_half(y0) + h * rate_u(y), v1, y0), report
