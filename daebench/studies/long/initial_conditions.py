"""The starts of an ensemble: states of the same motion that round differently."""

import numpy as np

from daebench.runs.ivp import Ivp
from daebench.studies.initial_conditions import neighbour

ROUNDINGS = 1024.0
"""Size of the perturbations in roundings of the number type, relative to the largest coordinate: 2.3e-13 in double precision."""


def start_of(ivp: Ivp, member: int, precision: str) -> Ivp:
    """Return the initial value problem at the start of a member of an ensemble; member 0 has the initial value problem's own.

    The others are neighbours, see :func:`daebench.studies.initial_conditions.neighbour`, by 1024 eps, seeded by their numbers. That
    scrambles the last ten bits. What a product or a root rounds off depends on bits below the last one, which a change of a thousand
    roundings alters entirely, so that from the first step on the roundings of two members are as good as independent. The motion is the
    same: truncation, which may be larger than round-off by many orders, has means over windows that are common to all members up to about
    1024 eps of themselves, and drops out of their spread. At single times it is not as common, for members run ahead of each other by a
    phase that grows with t. Starts spread over the energy surface, or along the motion, would each have a truncation error of its own; a
    change of 1e-10 would leave 1e-10 of it. A motion in a plane leaves it by as little, and on a motion that is unstable there, or chaotic,
    members part after some time, as they must, and the spread then has truncation in it.

    BadInput is raised if the start cannot be projected, as where vectors are arrays.
    """
    return ivp if member == 0 else neighbour(ivp, ROUNDINGS * float(np.finfo(precision).eps), member)
