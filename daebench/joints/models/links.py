"""The rigid bodies of a compiled model at one position: bodies without joints between them are one."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.joints.models.names import Names
from daebench.systems.lazily import mujoco

Array = NDArray[np.float64]

FIXED = 0
"""Number of the body that does not move."""


@dataclass(frozen=True)
class Link:
    """A rigid body: one that has joints, with all that are fixed to it."""

    number: int
    """Number of the body of MuJoCo that has the joints."""
    name: str
    parent: int
    """Number of the link to which its joints lead."""
    joints: tuple[int, ...]
    mass: float
    centre: Array
    """Centre of mass at the reference position, shape(3,)."""
    inertia: Array
    """Tensor of inertia about the centre at the reference position, shape(3, 3)."""


def links_of(model: Any, data: Any, names: Names) -> list[Link]:
    """Return the links of a model, parents first, at the position of the data."""
    links = []
    for number in range(1, model.nbody):
        # A body that is welded to another has no joint of its own.
        if model.body_weldid[number] != number:
            continue
        parts = [k for k in range(number, model.nbody) if model.body_weldid[k] == number]
        first, count = model.body_jntadr[number], model.body_jntnum[number]
        parent = int(model.body_weldid[model.body_parentid[number]])
        name = names.body(number)
        links.append(Link(number, name, parent, tuple(range(first, first + count)), *_inertia(model, data, parts)))
    return links


def _inertia(model: Any, data: Any, parts: list[int]) -> tuple[float, Array, Array]:
    """Return mass, centre and tensor about it of bodies that are fixed to each other."""
    masses = model.body_mass[parts]
    mass = float(masses.sum())
    centre = masses @ data.xipos[parts] / mass
    tensor = np.zeros((3, 3))
    for k in parts:
        R, r = data.ximat[k].reshape(3, 3), data.xipos[k] - centre
        tensor += R @ np.diag(model.body_inertia[k]) @ R.T + model.body_mass[k] * (r @ r * np.eye(3) - np.outer(r, r))
    return mass, centre, tensor


def turned(data: Any, number: int) -> tuple[Array, Array]:
    """Return the place of a body's frame, shape(3,), and its rotation, shape(3, 3)."""
    return data.xpos[number].copy(), data.xmat[number].reshape(3, 3).copy()


def at(model: Any, qpos: Array) -> Any:
    """Return data of a model at a position, with the places of its bodies."""
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    return data
