"""The starts of an ensemble: states of the same motion that round differently."""

from dataclasses import replace

import numpy as np

from daebench.diagnostics.consistency import projected
from daebench.scene import PoissonScene, Scene

ROUNDINGS = 1024.0
"""Size of the perturbations in roundings of the number type, relative to each coordinate: 2.3e-13 in double precision."""


def start_of(scene: Scene | PoissonScene, member: int, precision: str) -> Scene | PoissonScene:
    """Return the scene at the start of a member of an ensemble; member 0 has the scene's own.

    The others have each coordinate changed by a random factor 1 + 1024 eps xi, xi in [-1, 1], and are projected back onto the manifold.
    That scrambles the last ten bits. What a product or a root rounds off depends on bits below the last one, which a change of a thousand
    roundings alters entirely, so that from the first step on the roundings of two members are as good as independent. The
    motion is the same: truncation, which may be larger than round-off by many orders, is common to all members up to 1024 eps of itself,
    and drops out of their spread. Starts spread over the energy surface, or along the motion, would each have a truncation
    error of its own there; a change of 1e-10 would leave 1e-10 of it. Zeros stay zeros, so that a planar motion stays in its plane.
    On a chaotic motion members part after some time, as they must, and the spread then has truncation in it.

    Parameters
    ----------
    scene : Scene or PoissonScene
        The problem with its numbers.
    member : int
        Number of the member, which seeds the change.
    precision : str
        Number type of the run.

    Raises
    ------
    BadInput
        If the start cannot be projected, as where vectors are arrays.
    """
    if member == 0:
        return scene
    draw = np.random.default_rng(member)
    size = ROUNDINGS * float(np.finfo(precision).eps)
    moved = [x * (1 + size * draw.uniform(-1, 1, len(x))) for x in scene.start]
    if isinstance(scene, PoissonScene):
        return replace(scene, y0=moved[0])
    return projected(replace(scene, p0=moved[0], q0=moved[1]))[0]
