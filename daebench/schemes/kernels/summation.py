"""Compensated summation, HLW VIII.5: the rounding error of a sum is stored and added to the next sum."""

from daebench.schemes.kernels.spaces import Vector


def add(x: Vector, low: Vector, dx: Vector) -> tuple[Vector, Vector]:
    """Return x + (dx + low) and its rounding error; exact as long as the increment is smaller than x.

    ::

        a = dx + low,      y = x + a,      low = (x - y) + a
    """
    a = dx + low
    y = x + a
    # x - y comes first: it is exact if the increment is smaller than x, whereas (a + x) - y would be zero.
    return y, a + (x - y)
