"""The space of a mechanism: all of it, or the plane in which all bodies of a model move."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from daebench.joints.models.links import Array, Link
from daebench.systems.lazily import mujoco

ROUNDED = 1e-9
"""Sine of the largest angle between directions that are the same."""

DIGITS = 14
"""Digits of the numbers of a mechanism: fewer than those of MuJoCo's, so that 0.30000000000000004 is written 0.3."""


@dataclass(frozen=True)
class Space:
    """Orthonormal axes of a mechanism's space."""

    axes: Array
    """One in each row, shape(2, 3) or shape(3, 3)."""

    @property
    def plane(self) -> bool:
        """Whether it is a plane."""
        return len(self.axes) == 2

    @property
    def normal(self) -> Array:
        """Normal of the plane, about which angles are positive; shape(3,)."""
        return np.cross(*self.axes)

    def vector(self, x: Array, size: float = 1.0) -> tuple[float, ...]:
        """Return a place or vector in these axes; components that are rounding errors of numbers of this size are 0."""
        return tuple(rounded(float(component), size) for component in self.axes @ x)

    def inertia(self, tensor: Array) -> Any:
        """Return a tensor of inertia, shape(3, 3), as a body has it: a number in the plane, three if it is diagonal, or three rows."""
        if self.plane:
            return rounded(float(self.normal @ tensor @ self.normal))
        rows = [self.vector(row, float(np.abs(tensor).max())) for row in (tensor + tensor.T) / 2]
        if all(rows[i][j] == 0 for i in range(3) for j in range(3) if i != j):
            return tuple(rows[k][k] for k in range(3))
        return tuple(rows)


def rounded(x: float, size: float = 0.0) -> float:
    """Return a number with :data:`DIGITS` digits, as an int if it is one; 0 if it is a rounding error of numbers of this size."""
    number = 0.0 if abs(x) < size * 1e-14 else float(f"{x:.{DIGITS}g}")
    return int(number) if number == int(number) and abs(number) < 1e6 else number


def parallel(u: Array, v: Array) -> bool:
    """Return whether two unit vectors are along one line."""
    return bool(np.linalg.norm(np.cross(u, v)) < ROUNDED)


def space_of(model: Any, data: Any, links: Sequence[Link]) -> Space:
    """Return the plane in which all links move, or space."""
    joints = [k for link in links for k in link.joints]
    hinges = [k for k in joints if model.jnt_type[k] == mujoco.mjtJoint.mjJNT_HINGE]
    slides = [k for k in joints if model.jnt_type[k] == mujoco.mjtJoint.mjJNT_SLIDE]
    if not hinges or len(hinges) + len(slides) < len(joints):
        return Space(np.eye(3))
    normal = data.xaxis[hinges[0]]
    flat = all(parallel(normal, data.xaxis[k]) for k in hinges) and all(abs(normal @ data.xaxis[k]) < ROUNDED for k in slides)
    return Space(_across(normal) if flat else np.eye(3))


def _across(normal: Array) -> Array:
    """Return two axes across a direction: those of the world, in their order, if it is along one."""
    for k in range(3):
        if parallel(normal, np.eye(3)[k]):
            return np.delete(np.eye(3), k, axis=0)
    return np.linalg.svd(normal[None])[2][1:]
