"""Momenta and velocities of a system that may depend on time: its last position is the time, which has no mass."""

from daebench.schemes.kernels.language import EXTENDED, H_p, dot, rate_of_time
from daebench.schemes.kernels.spaces import Vector

if EXTENDED:

    def by_mass_alone(dp: Vector, q: Vector) -> Vector:
        """Return M^-1 p', without the rate of the time."""
        return H_p(dp, q) - rate_of_time(q)

    def but_for_time(x: Vector, q: Vector) -> Vector:
        """Return a vector with 0 in place of the time."""
        e = rate_of_time(q)
        return x - dot(e, x) * e

else:

    def by_mass_alone(dp: Vector, q: Vector) -> Vector:
        """Return M^-1 p'."""
        return H_p(dp, q)

    def but_for_time(x: Vector, q: Vector) -> Vector:
        """Return a vector unchanged."""
        return x


def with_p_t(p: Vector, p0: Vector, change: Vector, q: Vector) -> Vector:
    """Return momenta with the p_t of p0 plus its change as the last entry."""
    e = rate_of_time(q)
    return p + (dot(e, p0) + dot(e, change) - dot(e, p)) * e
