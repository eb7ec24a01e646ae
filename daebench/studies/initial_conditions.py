"""Initial conditions beside those of a case."""

import numpy as np

from daebench.diagnostics.consistency import projected
from daebench.runs.ivp import Ivp, PoissonIvp


def neighbour(ivp: Ivp, size: float, seed: int) -> Ivp:
    """Return the initial value problem at a random start nearby, on the manifold.

    Each coordinate is changed by size xi s, those that are zero among them, and the start projected back onto the manifold: xi is random
    in [-1, 1], and s the largest modulus of the positions or that of the momenta, or 1 where all of them are zero.

    Parameters
    ----------
    ivp : ConstrainedIvp, PoissonIvp
        The initial value problem.
    size : float
        Relative size of the change, before it is projected.
    seed : int
        Seeds the change.

    Raises
    ------
    BadInput
        If the start cannot be projected, as where vectors are arrays.
    """
    draw = np.random.default_rng(seed)
    moved = [x + size * (float(np.max(np.abs(x))) or 1.0) * draw.uniform(-1, 1, len(x)) for x in ivp.start]
    start = ivp.at(*moved)
    return start if isinstance(start, PoissonIvp) else projected(start)[0]
