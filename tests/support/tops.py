"""A heavy top by its quaternion, and Euler's equations for it."""

import numpy as np
from scipy.spatial.transform import Rotation

from daebench.joints import Mechanism, QuaternionBody, Start

INERTIA = ("0.8", "0.9", "1.3")
"""Moments about the centre."""

SPUN = {"at": ("0.8", "0.6", 0, 0), "spin": ("0.4", -3, "2.5")}
"""Quaternion and angular velocity of the start."""


def top(gauge=None, **more):
    """Return a heavy top of unequal moments about a point O of the ground, 1 m below its centre, tilted and spun."""
    return Mechanism(
        ground={"O": (0, 0, 0)},
        points={"C": (0, 0, 1)},
        bodies={"top": QuaternionBody("O", "C", mass="0.5", centre="C", inertia=INERTIA, gauge=gauge)},
        gravity=(0, 0, "-9.81"),
        cases={"spun": Start(at={"top.quaternion": SPUN["at"]}, spin={"top": SPUN["spin"]})},
        **more,
    ).problem()


def rotation(q):
    """Return the matrix of a quaternion with the real part first."""
    return Rotation.from_quat(q, scalar_first=True).as_matrix()


def turning(w, q):
    """Return the rate of a quaternion by the angular velocity in axes of the body."""
    return np.array([-q[1:] @ w, *(q[0] * w + np.cross(q[1:], w))]) / 2
