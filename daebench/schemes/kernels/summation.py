"""Compensated summation, HLW VIII.5: what rounding takes from a sum is kept and put back into the next."""

from daebench.schemes.kernels.spaces import Vector


def add(x: Vector, low: Vector, dx: Vector) -> tuple[Vector, Vector]:
    """Return x + (dx + low) and what rounding left of it; exact as long as the increment is smaller than x.

    ::

        a = dx + low,      y = x + a,      low = (x - y) + a
    """
    a = dx + low
    y = x + a
    return y, a + (x - y)
