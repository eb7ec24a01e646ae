"""Orthographic views of space, always from the same side."""

import numpy as np

from daebench.runs.ivp import Array

AZIMUTH, ELEVATION = 32.0, 24.0
"""Direction of the viewer from the origin, degrees."""


def seen(points: Array, azimuth: float = AZIMUTH, elevation: float = ELEVATION) -> Array:
    """Return the orthographic projection of points, shape(n, 3): coordinates to the right, up, and towards the viewer."""
    a, e = np.radians(azimuth), np.radians(elevation)
    ca, sa, ce, se = np.cos(a), np.sin(a), np.cos(e), np.sin(e)
    return np.asarray(points @ np.array([[-sa, ca, 0], [-se * ca, -se * sa, ce], [ce * ca, ce * sa, se]]).T)


def projected(points: Array) -> Array:
    """Return points of the plane unchanged, and points of space in orthographic projection; shape(..., 2)."""
    if points.shape[-1] == 2:
        return points
    return seen(points.reshape(-1, 3))[:, :2].reshape(*points.shape[:-1], 2)
