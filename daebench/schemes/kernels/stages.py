"""Sums over the stages of a Runge-Kutta method."""

from daebench.schemes.kernels.language import STAGES
from daebench.schemes.kernels.spaces import Data, Number, Vector


def weighted(w: Number, weights: Data, K: tuple[Vector, ...]) -> Vector:
    """Return w sum_j weights_j K_j."""
    total = w * weights[0] * K[0]
    for j in range(1, STAGES):
        total = total + w * weights[j] * K[j]
    return total


def weighted_but_last(x: Vector, w: Number, weights: Data, K: tuple[Vector, ...]) -> Vector:
    """Return x + w sum_j weights_j K_j over all stages but the last, which has no weight."""
    for j in range(STAGES - 1):
        x = x + w * weights[j] * K[j]
    return x


def places(x0: Vector, dx: tuple[Vector, ...]) -> tuple[Vector, ...]:
    """Return x0 + dx_i at each stage i."""
    return tuple(x0 + dx[i] for i in range(STAGES))
