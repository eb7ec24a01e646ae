"""The starts of an ensemble: states of the same motion that round differently."""

import numpy as np

from daebench.diagnostics.consistency import projected
from daebench.runs.ivp import Ivp, PoissonIvp

ROUNDINGS = 1024.0
"""Size of the perturbations in roundings of the number type, relative to the largest coordinate: 2.3e-13 in double precision."""


def start_of(ivp: Ivp, member: int, precision: str) -> Ivp:
    """Return the initial value problem at the start of a member of an ensemble; member 0 has the initial value problem's own.

    The others have 1024 eps xi s added to each coordinate, those that are zero among them, and are projected back onto the manifold: xi is
    random in [-1, 1], and s the largest modulus of the positions or that of the momenta, or 1 where all of them are zero. That scrambles
    the last ten bits. What a product or a root rounds off depends on bits below the last one, which a change of a thousand roundings alters
    entirely, so that from the first step on the roundings of two members are as good as independent. The motion is the same: truncation,
    which may be larger than round-off by many orders, has means over windows that are common to all members up to about 1024 eps of
    themselves, and drops out of their spread. At single times it is not as common, for members run ahead of each other by a phase that
    grows with t. Starts spread over the energy surface, or along the motion, would each have a truncation error of its own; a change of
    1e-10 would leave 1e-10 of it. A motion in a plane leaves it by as little, and on a motion that is unstable there, or chaotic, members
    part after some time, as they must, and the spread then has truncation in it.

    The number of the member seeds the change. BadInput is raised if the start cannot be projected, as where vectors are arrays.
    """
    if member == 0:
        return ivp
    draw = np.random.default_rng(member)
    size = ROUNDINGS * float(np.finfo(precision).eps)
    moved = [x + size * (float(np.max(np.abs(x))) or 1.0) * draw.uniform(-1, 1, len(x)) for x in ivp.start]
    start = ivp.at(*moved)
    return start if isinstance(start, PoissonIvp) else projected(start)[0]
