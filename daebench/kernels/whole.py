"""The step of a scheme that gives its increments."""

from daebench.kernels.hole import Number, Report, Vector, axpy, increment


def step(p0: Vector, q0: Vector, h: Number) -> tuple[Vector, Vector, tuple[Vector, ...], Report]:
    """Return p1 = p0 + dp, q1 = q0 + dq, the raw multipliers and a report."""
    dp, dq, raw, report = increment(p0, q0, h)
    return axpy(1.0, dp, p0), axpy(1.0, dq, q0), raw, report
