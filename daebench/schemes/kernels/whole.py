"""The step of a scheme that gives its increments."""

from daebench.schemes.kernels.language import increment
from daebench.schemes.kernels.spaces import Number, Step, Vector


def step(p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1 = p0 + dp, q1 = q0 + dq, the raw multipliers and a report."""
    dp, dq, raw, report = increment(p0, q0, h)
    return p0 + dp, q0 + dq, raw, report
