"""Starts beside the start of a problem, moved back onto the manifold."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from daebench.diagnostics.projected_members import project_members, require_projected
from daebench.errors import positive
from daebench.runs.ivp import Ivp
from daebench.studies.ensemble.distributions.starts import Starts, casimirs, copies, differing, of_case, require_inside
from daebench.studies.initial_conditions import beside


@dataclass(frozen=True)
class Neighbourhood:
    """Random starts beside that of the problem, each projected onto its manifold.

    Each coordinate is changed by size xi s, xi uniform in [-1, 1], s the largest modulus of positions or of momenta, see
    :func:`daebench.studies.initial_conditions.neighbour`, and the start then moved to the nearest consistent one in the metric M, by
    :func:`daebench.diagnostics.projected_members.project_members`. It is no measure that the flow preserves. Where parameters differ from
    member to member, the problem's start is moved onto the manifold of each. A start that cannot be projected is an error, and is not drawn
    again: what is left would be another distribution. States of a Poisson system are not projected; their Casimir functions then differ.

    Parameters
    ----------
    size : float
        Relative size of the change, before it is projected.
    """

    size: float = 0.01

    def draw(self, ivp: Ivp, n: int | None, h: Any, parameters: Mapping[str, Any] | None = None, seed: int = 0) -> Starts:
        """Return n members with such starts, each the same however many there are.

        Raises
        ------
        BadInput
            If starts cannot be projected, or are outside of the domain of a Poisson system.
        """
        size = positive("size", self.size)
        some = copies(ivp, n, h, parameters, seed)
        xi = np.random.default_rng(seed).uniform(-1, 1, (len(some), ivp.size))
        some = replace(some, start=beside(ivp, size, xi))
        what = f"a neighbourhood of size {size:g}"
        words = f"{what} of {of_case(ivp)}, uniform in every coordinate"
        if not ivp.on_manifold:
            ends, measured = casimirs(require_inside(some, what))
        else:
            projected = project_members(some)
            some = require_projected(projected, what)
            measured = {"moved_q": float(np.max(projected.moved_q)), "moved_p": float(np.max(projected.moved_p))}
            ends = f", moved onto the manifold by at most {measured['moved_q']:.2g} in q and {measured['moved_p']:.2g} in p"
        return Starts(some, f"{words}{ends}{differing(some)}; seed {seed}.", measured)
