"""The symplectic Euler method for Poisson systems in halves y = (u, v), HLW Example 4.7: implicit in u, explicit in v."""

from daebench.schemes.kernels.claims import PoissonClaims
from daebench.schemes.kernels.language import INF, norm, solve
from daebench.schemes.kernels.newton import newton
from daebench.schemes.kernels.poisson_language import DENSE, first_half, joined, rate_u, rate_v, second_half
from daebench.schemes.kernels.spaces import LENGTH, Half, I, Number, Report, Update, Vector

if DENSE:
    from daebench.schemes.kernels.poisson_language import rate_u_u

    def update(u: Half, data: tuple[Vector, Number]) -> Update:
        """One Newton update for u."""
        y0, h = data
        y = joined(u, second_half(y0), y0)
        r = u - h * rate_u(y) - first_half(y0)
        du, pivot = solve(I - h * rate_u_u(y), r)
        return u - du, norm(du), max(LENGTH, norm(u)), norm(r), pivot

else:

    def update(u: Half, data: tuple[Vector, Number]) -> Update:
        """One fixed-point update of u."""
        y0, h = data
        new = first_half(y0) + h * rate_u(joined(u, second_half(y0), y0))
        change = norm(new - u)
        return new, change, max(LENGTH, norm(new)), change, INF


CLAIMS = PoissonClaims(order=1, symmetric=False, poisson="bilinear", halves=True, source="HLW Example 4.7")


def step(y0: Vector, h: Number) -> tuple[Vector, Report]:
    """Return y1 and a report, for f = B grad H.

    ::

        u1 = u0 + h f_u(u1, v0)        v1 = v0 + h f_v(u1, v0)

    With u' = d(u, v) L'(v), v' = -d(u, v) K'(u) it is a Poisson map for uv, as in the book, and for every d that is linear in u and in v:
    then d(u0, v0) = d(u1, v0) (1 - h d_u L') and d(u1, v1) = d(u1, v0) (1 - h d_v K'), and their ratio is det Phi'.
    """
    u1, report = newton(update, first_half(y0), (y0, h))
    y = joined(u1, second_half(y0), y0)
    return joined(u1, second_half(y0) + h * rate_v(y), y0), report
