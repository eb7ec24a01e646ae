"""Sums over the stages of a Runge-Kutta method."""

from typing import Any

from daebench.kernels.hole import STAGES, Number, Vector, axpy, scale


def weighted(w: Number, weights: tuple[Number, ...], K: Any) -> Vector:
    """Return w sum_j weights_j K_j."""
    total = scale(w * weights[0], K[0])
    for j in range(1, STAGES):
        total = axpy(w * weights[j], K[j], total)
    return total


def weighted_but_last(x: Vector, w: Number, weights: tuple[Number, ...], K: Any) -> Vector:
    """Return x + w sum_j weights_j K_j over all stages but the last, which has no weight."""
    for j in range(STAGES - 1):
        x = axpy(w * weights[j], K[j], x)
    return x


def places(x0: Vector, dx: Any) -> Any:
    """Return x0 + dx_i at each stage i."""
    return tuple(axpy(1.0, dx[i], x0) for i in range(STAGES))
