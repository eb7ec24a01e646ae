"""The starts of an ensemble: states of the same motion that round differently."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from daebench.compiler.number_types import number_type
from daebench.diagnostics.projected_members import project_members, require_projected
from daebench.runs.ivp import Ivp
from daebench.runs.members import Members, members
from daebench.starts.members import beside, neighbour

ROUNDINGS = 1024.0
"""Size of the perturbations in roundings of the number type, relative to the largest coordinate: 2.3e-13 in double precision."""


def start_of(ivp: Ivp, member: int, precision: str) -> Ivp:
    """Return the initial value problem at the start of a member of an ensemble; member 0 has the initial value problem's own.

    The others are neighbours, see :func:`daebench.starts.members.neighbour`, by 1024 eps of the coarsest numbers, seeded by
    their numbers. That scrambles the last ten bits. What a product or a root rounds off depends on bits below the last one, which a change
    of a thousand roundings alters entirely, so that from the first step on the roundings of two members are as good as independent. The
    motion is the same: truncation, which may be larger than round-off by many orders, has means over windows that are common to all members
    up to about 1024 eps of themselves, and drops out of their spread. At single times it is not as common, for members run ahead of each
    other by a phase that grows with t. Starts spread over the energy surface, or along the motion, would each have a truncation error of
    its own; a change of 1e-10 would leave 1e-10 of it. A motion in a plane leaves it by as little, and on a motion that is unstable there,
    or chaotic, members part after some time, as they must, and the spread then has truncation in it.

    BadInput is raised if the start cannot be projected, as where vectors are arrays.
    """
    return ivp if member == 0 else neighbour(ivp, ROUNDINGS * number_type(precision).coarsest_spacing, member)


def starts_of(ivp: Ivp, numbers: Sequence[int], h: float) -> Members:
    """Return members of an ensemble by their numbers, each to the bit where :func:`start_of` has it begin in double precision.

    BadInput is raised if a start cannot be projected, as where vectors are arrays.
    """
    size = ROUNDINGS * float(np.finfo(float).eps)
    xi = np.array([np.random.default_rng(number).uniform(-1, 1, ivp.size) for number in numbers])
    moved = members(ivp, beside(ivp, size, xi), h, {})
    some = require_projected(project_members(moved), f"a neighbourhood of size {size:.2g}") if ivp.on_manifold else moved
    unmoved = np.equal(numbers, 0)[:, None]
    return replace(some, start=tuple(np.where(unmoved, x, vectors) for x, vectors in zip(ivp.start, some.start, strict=True)))
