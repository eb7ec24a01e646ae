"""A random walk on manifolds {x: c(x) = 0} whose distribution tends to one that is given, Metropolis' rule with tangent proposals.

::

    v = sigma times a Gaussian in the tangent space at x,    y = x + v + C(x)^T a  with  c(y) = 0,     C = c_x
    v' in the tangent space at y, so that                    x = y + v' + C(y)^T a'
    y is accepted with probability min(1, f(y) exp(-|v'|^2 / (2 sigma^2)) / (f(x) exp(-|v|^2 / (2 sigma^2))))

f is the density with respect to the Euclidean surface measure. A step is refused where Newton's iteration for a fails, and where that from
y + v' does not lead back to x: without this check the walk is not reversible, and tends to another distribution. E. Zappa, M.
Holmes-Cerfon, J. Goodman, Monte Carlo on manifolds: sampling densities and integrating functions, Comm. Pure Appl. Math. 71 (2018),
2609-2647, Algorithm 1.

Steps longer than 2.5 sigma sqrt(k) or steeper than half a right angle are refused too, seen from either end: such a step may lead to
another piece of a manifold, and a walk that rarely finds one settles late.

All chains are taken a step at once, and none has a part in what another does.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from daebench.runs.ivp import Array
from daebench.starts.mechanics import Positions, Rows, gram, solved, times, transposed_times

ITERATIONS = 10
"""Most of Newton's iterations for a proposal."""

SMALL = 1e-10
"""Increment, relative to the largest coordinate, after which Newton's iteration, which converges quadratically, is at round-off."""

RETURNED = 1e-7
"""Distance from x, relative to the largest coordinate, within which the way back ends at x."""


SLOWEST = 0.5
"""Largest increment, relative to the one before, with which the iteration goes on."""

STEEP = 1.0
"""Largest distance of a proposal from the tangent space, relative to the tangent step."""

LONG = 2.5
"""Largest tangent step, in standard deviations of its length."""


class Manifolds(Protocol):
    """Manifolds {x: c(x) = 0}, one for each chain."""

    def conditions(self, x: Array, rows: Rows) -> tuple[Array, Array]:
        """Return c(x), shape(c, k), and C(x), shape(c, l, k), at points x, shape(l, k), of k of the chains."""


class LevelSet(Manifolds, Protocol):
    """Manifolds with a density that is wanted on them."""

    @property
    def noise(self) -> int:
        """Number of standard normal numbers that :meth:`weighed` takes."""

    def weighed(self, x: Array, C: Array, noise: Array, rows: Rows) -> tuple[Array, Array]:
        """Return the logarithm of a weight at points of some chains, shape(k,), and what is drawn there besides, shape(e, k).

        Without noise the weight is the density with respect to the Euclidean surface measure. With noise it is the density of point and
        what is drawn together, over that with which the latter is drawn.
        """


@dataclass(frozen=True)
class Chains:
    """States of chains.

    Parameters
    ----------
    x : ndarray, shape(l, n)
        Points on the manifolds.
    C : ndarray, shape(c, l, n)
        Jacobians there.
    weight : ndarray, shape(n,)
        Logarithms of their weights.
    drawn : ndarray, shape(e, n)
        What was drawn with each point.
    moved : ndarray of bool, shape(n,)
        Whether the last step was accepted.
    """

    x: Array
    C: Array
    weight: Array
    drawn: Array
    moved: NDArray[np.bool_]


def onto(manifold: Manifolds, y: Array, along: Array, size: Array, rows: Rows) -> tuple[Array, NDArray[np.bool_]]:
    """Return y + A^T a with c(y + A^T a) = 0 by Newton's iteration for a, and where that converged.

    Parameters
    ----------
    manifold : Manifolds
        The manifolds.
    y : ndarray, shape(l, k)
        Points.
    along : ndarray, shape(c, l, k)
        Directions A in rows.
    size : ndarray, shape(k,)
        What increments are small against.
    rows : ndarray of int, shape(k,)
        Chains that the points are of.
    """
    end, met, active = y.copy(), np.zeros(y.shape[1], dtype=bool), np.arange(y.shape[1])
    previous = 4 * size
    for _ in range(ITERATIONS):
        c, C = manifold.conditions(y, rows)
        change = transposed_times(along, solved(gram(C, along), c))
        y = y - change
        largest = np.max(np.abs(change), axis=0)
        done = largest <= SMALL * size
        end[:, active[done]], met[active[done]] = y[:, done], True
        going = ~done & (largest <= SLOWEST * previous)
        previous = largest
        if not np.any(going):
            break
        if not np.all(going):
            y, along, size, previous = y[:, going], along[:, :, going], size[going], previous[going]
            rows, active = rows[going], active[going]
    return end, met


def tangent(C: Array, z: Array) -> Array:
    """Return the parts of vectors z, shape(l, k), in the null spaces of C, shape(c, l, k)."""
    return z - transposed_times(C, solved(gram(C, C), times(C, z)))


def begun(manifold: LevelSet, x: Array, noise: Array) -> Chains:
    """Return chains at points of their manifolds."""
    rows = np.arange(x.shape[1])
    _, C = manifold.conditions(x, rows)
    weight, drawn = manifold.weighed(x, C, noise, rows)
    return Chains(x, C, weight, drawn, np.zeros(len(rows), dtype=bool))


def step(manifold: LevelSet, chains: Chains, sigma: float, random: np.random.Generator, reverse: bool = True) -> Chains:
    """Return all chains after one step.

    Parameters
    ----------
    manifold : LevelSet
        Manifolds and density.
    chains : Chains
        Where they are; a weight of -inf is left at the first step that can be taken.
    sigma : float
        Standard deviation of each component of a proposal.
    random : Generator
        What is drawn for a chain does not depend on how many there are.
    reverse : bool
        Whether the way back is checked; for tests, which see what becomes of a walk without the check.
    """
    x = chains.x
    dimension, n = x.shape
    # Streams of their own are filled chain by chain, so that more chains leave the numbers of the first ones as they are.
    normal, others, uniform = random.spawn(3)
    v = tangent(chains.C, sigma * normal.standard_normal((n, dimension)).T)
    noise, chance = others.standard_normal((n, manifold.noise)).T, np.log(uniform.random(n))
    size, longest = np.maximum(np.max(np.abs(x), axis=0), sigma), LONG * sigma * np.sqrt(dimension - len(chains.C))
    y, met = onto(manifold, x + v, chains.C, size, np.arange(n))
    rows = np.flatnonzero(met & _short(v, y - x - v, longest))
    x, y, v, size = x[:, rows], y[:, rows], v[:, rows], size[rows]
    _, C = manifold.conditions(y, rows)
    weight, drawn = manifold.weighed(y, C, noise[:, rows], rows)
    back = tangent(C, x - y)
    log_ratio = weight - chains.weight[rows] + (np.sum(v**2, axis=0) - np.sum(back**2, axis=0)) / (2 * sigma**2)
    likely = _short(back, x - y - back, longest) & (weight > -np.inf) & (chance[rows] < log_ratio)
    if reverse:
        some = np.flatnonzero(likely)
        end, met = onto(manifold, (y + back)[:, some], C[:, :, some], size[some], rows[some])
        likely[some] = met & (np.max(np.abs(end - x[:, some]), axis=0) <= RETURNED * size[some])
    return _replaced(chains, rows[likely], (y[:, likely], C[:, :, likely], weight[likely], drawn[:, likely]))


def _short(v: Array, normal: Array, longest: float) -> NDArray[np.bool_]:
    """Return which steps, of these tangent and normal parts, are neither too long nor too steep."""
    square = np.sum(v**2, axis=0)
    return np.asarray((square <= longest**2) & (np.sum(normal**2, axis=0) <= STEEP**2 * square), dtype=bool)


def _replaced(chains: Chains, moved: Rows, states: tuple[Array, Array, Array, Array]) -> Chains:
    """Return chains of which some are elsewhere."""
    parts = []
    for before, after in zip((chains.x, chains.C, chains.weight, chains.drawn), states, strict=True):
        part = before.copy()
        part[..., moved] = after
        parts.append(part)
    flags = np.zeros(chains.x.shape[1], dtype=bool)
    flags[moved] = True
    return Chains(parts[0], parts[1], parts[2], parts[3], flags)


STEPS = 2000
"""Steps after which the search is given up."""

DECADES = 6.0
"""Lengths of steps are drawn from so many powers of ten up to the largest coordinate, so that the way ends as near to a bound as needed."""

PATIENCE, FREELY = 60, 10
"""Steps without a smaller violation after which a chain is taken to be in a local minimum, and steps in which it then goes anywhere."""

Violation = Callable[[Array, Rows], Array]
"""How far positions of some chains are from what is wanted: not positive where they are in it."""


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
