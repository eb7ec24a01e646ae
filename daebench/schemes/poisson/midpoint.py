"""The implicit midpoint rule on y' = B(y) grad H(y): a Poisson map for constant B, and none for that of HLW Example 4.7."""

from typing import Any

from daebench.claims import PoissonClaims
from daebench.kernels.hole import LENGTH, Number, Report, Vector, axpy, norm
from daebench.kernels.newton import newton
from daebench.kernels.poisson_hole import DENSE, field

if DENSE:
    from daebench.kernels.hole import identity_plus, solve_d
    from daebench.kernels.poisson_hole import field_y

    def improve(y1: Any, data: Any) -> Any:
        """One Newton sweep for y1."""
        y0, h = data
        middle = axpy(0.5, axpy(-1.0, y0, y1), y0)
        r = axpy(-1.0, y0, axpy(-h, field(middle), y1))
        dy, pivot = solve_d(identity_plus(-0.5 * h, field_y(middle)), r)
        return axpy(-1.0, dy, y1), norm(dy), max(LENGTH, norm(y0)), norm(r), pivot

else:
    from daebench.kernels.hole import INF

    def improve(y1: Any, data: Any) -> Any:
        """One sweep of fixed-point iteration for y1, HLW VIII.6.2."""
        y0, h = data
        new = axpy(h, field(axpy(0.5, axpy(-1.0, y0, y1), y0)), y0)
        change = norm(axpy(-1.0, y1, new))
        return new, change, max(LENGTH, norm(y0)), change, INF


CLAIMS = PoissonClaims(order=2, symmetric=True, poisson="constant", keeps="quadratic", source="HLW (I.1.7)")


def step(y0: Vector, h: Number) -> tuple[Vector, Report]:
    """Return y1 and a report, for f = B grad H.

    ::

        y1 = y0 + h f((y0 + y1)/2)
    """
    return newton(improve, axpy(h, field(y0), y0), (y0, h))
