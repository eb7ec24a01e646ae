"""The implicit midpoint rule on y' = B(y) grad H(y): a Poisson map for constant B, but not for the B of HLW Example 4.7."""

from daebench.schemes.kernels.claims import PoissonClaims
from daebench.schemes.kernels.language import INF, norm, solve
from daebench.schemes.kernels.newton import newton
from daebench.schemes.kernels.poisson_language import DENSE, field
from daebench.schemes.kernels.spaces import LENGTH, I, Number, Report, Update, Vector

if DENSE:
    from daebench.schemes.kernels.poisson_language import field_y

    def update(y1: Vector, data: tuple[Vector, Number]) -> Update:
        """One Newton update for y1."""
        y0, h = data
        middle = y0 + (y1 - y0) / 2
        r = y1 - h * field(middle) - y0
        dy, pivot = solve(I - h / 2 * field_y(middle), r)
        return y1 - dy, norm(dy), max(LENGTH, norm(y0)), norm(r), pivot

else:

    def update(y1: Vector, data: tuple[Vector, Number]) -> Update:
        """One fixed-point update of y1, HLW VIII.6.2."""
        y0, h = data
        new = y0 + h * field(y0 + (y1 - y0) / 2)
        change = norm(new - y1)
        return new, change, max(LENGTH, norm(y0)), change, INF


CLAIMS = PoissonClaims(order=2, symmetric=True, poisson="constant", keeps="quadratic", source="HLW (I.1.7)")


def step(y0: Vector, h: Number) -> tuple[Vector, Report]:
    """Return y1 and a report, for f = B grad H.

    ::

        y1 = y0 + h f((y0 + y1)/2)
    """
    return newton(update, y0 + h * field(y0), (y0, h))
