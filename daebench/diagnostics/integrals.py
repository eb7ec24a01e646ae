"""Errors of conserved quantities along a trajectory: the difference from their value at its start."""

import numpy as np
from numpy.typing import NDArray

from daebench.scene import Scene
from daebench.trajectory import Trajectory

Array = NDArray[np.float64]


def energy_error(scene: Scene, trajectory: Trajectory) -> Array:
    """Return H(x(t)) - H(x0) at the outputs, shape(n,), in the unit of H."""
    H = scene.along("H", trajectory.p, trajectory.q)
    return np.asarray(H - H[0], dtype=float)


def integral_errors(scene: Scene, trajectory: Trajectory) -> dict[str, Array]:
    """Return the error of each first integral that the problem declares besides H, by name, each shape(n,) over the outputs."""
    if not scene.integrals:
        return {}
    values = scene.along("integrals", trajectory.p, trajectory.q)
    return dict(zip(scene.integrals, (values - values[0]).T, strict=True))
