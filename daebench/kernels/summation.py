"""Compensated summation, HLW VIII.5: what rounding takes from a sum is kept and put back into the next."""

from daebench.kernels.hole import Vector, axpy


def add(x: Vector, low: Vector, dx: Vector) -> tuple[Vector, Vector]:
    """Return x + (dx + low) and what rounding left of it; exact as long as the increment is smaller than x.

    ::

        a = dx + low,      y = x + a,      low = (x - y) + a
    """
    a = axpy(1.0, low, dx)
    y = axpy(1.0, a, x)
    return y, axpy(1.0, axpy(-1.0, y, x), a)
