"""Initial conditions near those of a case."""

import numpy as np

from daebench.diagnostics.consistency import projected
from daebench.runs.ivp import Array, InitialValueProblem, Ivp


def neighbour(ivp: Ivp, size: float, seed: int | list[int]) -> Ivp:
    """Return the initial value problem at a random start nearby, on the manifold.

    Each coordinate is changed by size xi s, those that are zero among them, and the start projected back onto the manifold: xi is random
    in [-1, 1], and s the largest modulus of the positions or that of the momenta, or 1 where all of them are zero.

    Parameters
    ----------
    ivp : ConstrainedIvp, PoissonIvp
        The initial value problem.
    size : float
        Relative size of the change, before it is projected.
    seed : int or list of int
        Seeds the change.

    Raises
    ------
    BadInput
        If the start cannot be projected, as where vectors are arrays.
    """
    moved = beside(ivp, size, np.random.default_rng(seed).uniform(-1, 1, (1, ivp.size)))
    start = ivp.at(*(rows[0] for rows in moved))
    return projected(start)[0] if start.on_manifold else start


def beside(ivp: InitialValueProblem, size: float, xi: Array) -> tuple[Array, ...]:
    """Return initial values beside that of a problem, off the manifold: each coordinate changed by size xi s, as :func:`neighbour` has it.

    Parameters
    ----------
    ivp : InitialValueProblem
        The problem.
    size : float
        Relative size of the change.
    xi : ndarray, shape(n, N)
        Changes of all N coordinates of a start, in the order in which a state is stored, a row for each start.

    Returns
    -------
    tuple of ndarray, each shape(n, d)
    """
    return tuple(x + size * (float(np.max(np.abs(x))) or 1.0) * part for x, part in zip(ivp.start, ivp.vectors(xi), strict=True))
