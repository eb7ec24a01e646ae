"""First points of chains: from a start towards the set that is to be drawn from, until each chain is in it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daebench.runs.ivp import Array
from daebench.studies.ensemble.distributions.linear import Rows
from daebench.studies.ensemble.distributions.mechanics import Mechanics
from daebench.studies.ensemble.distributions.walk import onto, tangent

STEPS = 2000
"""Steps after which the search is given up."""

DECADES = 6.0
"""Lengths of steps are drawn from so many powers of ten up to the largest coordinate, so that the way ends as near to a bound as needed."""

PATIENCE, FREELY = 60, 10
"""Steps without a smaller violation after which a chain is taken to be in a local minimum, and steps in which it then goes anywhere."""

Violation = Callable[[Array, Rows], Array]
"""How far positions of some chains are from what is wanted: not positive where they are in it."""


@dataclass(frozen=True)
class Positions:
    """The manifolds {q: g(q) = 0} of all members.

    Parameters
    ----------
    mechanics : Mechanics
        The problem.
    """

    mechanics: Mechanics

    def conditions(self, x: Array, rows: Rows) -> tuple[Array, Array]:
        """Return g and G at positions of some members."""
        return self.mechanics.value("g", x, rows=rows), self.mechanics.value("G", x, rows=rows)


def searched(positions: Positions, x: Array, violation: Violation, key: Sequence[int]) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return points where a violation is not positive, the least violation of each chain, and which chains have not come to such a point.

    Each chain goes to a proposal where that is no worse, and stops in the set that is looked for; it does as it would by itself.

    Parameters
    ----------
    positions : Positions
        The manifolds.
    x : ndarray, shape(l, n)
        Where chains start.
    violation : callable
        See :data:`Violation`.
    key : sequence of int
        Seeds the random numbers.
    """
    x, size = x.copy(), np.maximum(np.max(np.abs(x), axis=0), 1e-300)
    n = x.shape[1]
    worst = violation(x, np.arange(n))
    least, idle = worst.copy(), np.zeros(n, dtype=int)
    with np.errstate(all="ignore"):
        for k in range(STEPS):
            rows = np.flatnonzero(~(worst <= 0))
            if not len(rows):
                break
            normal, uniform = np.random.default_rng([*key, k]).spawn(2)
            z, decades = normal.standard_normal((n, len(x)))[rows].T, np.asarray(uniform.random(n))[rows]
            length = size[rows] * 10.0 ** -np.where(idle[rows] < PATIENCE, DECADES * decades, decades)
            _, C = positions.conditions(x[:, rows], rows)
            y, met = onto(positions, x[:, rows] + tangent(C, length * z), C, size[rows], rows)
            new = violation(y, rows)
            taken = met & (~(new > worst[rows]) | ((idle[rows] >= PATIENCE) & np.isfinite(new)))
            idle[rows] = np.where(taken & (new < least[rows]) | (idle[rows] >= PATIENCE + FREELY), 0, idle[rows] + 1)
            x[:, rows[taken]], worst[rows[taken]] = y[:, taken], new[taken]
            least = np.fmin(least, worst)
    return x, least, ~(worst <= 0)
