"""Starts in a box, distributed by the Liouville measure on the constraint manifold."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from daebench.diagnostics.projected_members import project_members, require_projected
from daebench.errors import BadInput
from daebench.runs.ivp import Array, Ivp
from daebench.runs.members import Members
from daebench.starts.box import Bounds, box_of, excess, in_words, require_bounded
from daebench.starts.convergence import settled
from daebench.starts.mechanics import Mechanics, Positions, Rows, gram, log_det, mechanics_of, product, solved, times, transposed_times
from daebench.starts.members import Starts, casimirs, copies, differing, of_case, require_inside
from daebench.starts.walk import searched

INVARIANT = 1e-10
"""Largest divergence of a vector field, relative to the sum of the moduli of its derivatives, that is rounding."""

WIDE = 0.6
"""Variance of proposed momenta, in squares of half the width of the box."""

ALTERNATIONS = 50
"""Projections in turns onto the plane of momenta and onto the box."""

INNER = 0.99
"""Part of the box that they are projected onto, so that they end inside."""


@dataclass(frozen=True)
class StatesInBox(Positions):
    """Positions with g = 0 and momenta with A (p - a) = 0, A = G M^-1, in a box.

    Momenta are drawn from the Gaussian whose mean c is the middle of the box and whose covariance S is a part of its size, restricted to
    the plane; with mu the point of the plane that is nearest to c in the metric S^-1 ::

        p = z - S A^T (A S A^T)^-1 A (z - a),     z normal with mean c and covariance S
        weight = det(G M^-1 G^T) / sqrt( det(G G^T) det(A S A^T) ) exp( (p - mu)^T S^-1 (p - mu) / 2 )     in the box
    """

    of_p: tuple[Array, Array]
    of_q: tuple[Array, Array]
    """Bounds of momenta and of positions; shape (d,)."""

    @property
    def noise(self) -> int:
        """Number of standard normal numbers that momenta are made of."""
        return self.mechanics.d

    def some(self, rows: Rows) -> "StatesInBox":
        """Return those of some of the members, by their numbers."""
        return replace(self, mechanics=self.mechanics.some(rows))

    @property
    def _middle(self) -> tuple[Array, Array]:
        lo, hi = self.of_p
        return ((lo + hi) / 2)[:, None], (WIDE * ((hi - lo) / 2) ** 2)[:, None]

    def weighed(self, x: Array, C: Array, noise: Array, rows: Rows) -> tuple[Array, Array]:
        """Return the logarithm of the weight, and momenta."""
        c, S = self._middle
        inverse, shift = self.mechanics.inverse(x, rows), self.mechanics.shift(x, rows)
        A = product(C, inverse)
        mu, deviation = self._in_plane(A, c - shift) + shift, self._in_plane(A, np.sqrt(S) * noise)
        p = mu + deviation
        inside = (excess(x, self.of_q) <= 0) & (excess(p, self.of_p) <= 0)
        weight = log_det(gram(A, C)) - (log_det(gram(C, C)) + log_det(gram(A * S, A))) / 2 + np.sum(deviation**2 / S, axis=0) / 2
        return np.where(inside, weight, -np.inf), p

    def _in_plane(self, A: Array, z: Array) -> Array:
        """Return the point of the plane A z = 0 nearest to z in the metric S^-1."""
        _, S = self._middle
        return z - S * transposed_times(A, solved(gram(A * S, A), times(A, z)))

    def momenta_within(self, q: Array, rows: Rows) -> Array:
        """Return momenta on the manifold that are in the box where there are such, or nearly so."""
        c, _ = self._middle
        lo, hi = ((bound[:, None] - c) * INNER + c for bound in self.of_p)
        A, shift = product(self.mechanics.value("G", q, rows=rows), self.mechanics.inverse(q, rows)), self.mechanics.shift(q, rows)
        p = self._in_plane(A, c - shift) + shift
        for _ in range(ALTERNATIONS):
            if np.all((lo <= p) & (p <= hi)):
                break
            p = self._in_plane(A, np.clip(p, lo, hi) - shift) + shift
        return p


@dataclass(frozen=True)
class Liouville:
    """The Liouville measure in a box.

    ::

        det(G M^-1 G^T) delta(g(q)) delta(G M^-1 p) dq dp  for  lo <= (p, q) <= hi

    The flow of the problem preserves the measure, though not the box. It is the product of the surface measure of {g = 0} in the metric M
    and, for each q, of the volume in the plane G M^-1 p = 0 in the metric M^-1: T. Lelièvre, M. Rousset, G. Stoltz, Langevin dynamics with
    constraints and computation of free energy differences, Math. Comp. 81 (2012), 2071-2125. Where the box cuts less out of the plane at
    one q than at another, positions are rarer there: on a sphere they are not uniform with a cube of momenta. Momenta have to be bounded,
    and positions on a manifold that goes to infinity. States are drawn by random walks, one for each member, see
    :mod:`daebench.starts.walk`, with momenta drawn anew in each step.

    What a walk does not reach is not drawn: of a manifold, or of what the box cuts out of it, in several pieces, only that in which the
    start of the problem lies, but for pieces so near to each other that a step goes from one to the other. Where that start is not in the
    box, walks begin where a search has come to, and may begin in several pieces, which then weigh as often as they were found.

    States of a Poisson system are uniform in y, in the box, of which each coordinate needs bounds. The flow preserves dy if the divergence
    of B grad H vanishes, which is measured and stated; it does not mix values of the Casimir functions.

    Parameters
    ----------
    box : mapping of str to (float, float)
        Bounds of coordinates, by the names p1, q1, ... or y1, ...
    """

    box: Bounds = field(default_factory=dict)

    def draw(self, ivp: Ivp, n: int | None, h: Any, parameters: Mapping[str, Any] | None = None, seed: int = 0) -> Starts:
        """Return n members with starts in the box, each the same however many there are.

        Raises
        ------
        BadInput
            If a coordinate that needs bounds has none, H of a constrained problem is not quadratic in p, no start in the box was found, or
            the walk does not settle.
        """
        some = copies(ivp, n, h, parameters, seed)
        if not ivp.on_manifold:
            return self._uniform(some, seed)
        mechanics_of(some, "liouville")
        of_p, of_q = box_of(ivp, self.box, "pq")
        require_bounded(ivp, of_p, "p", "momenta can have any size")
        what = f"the Liouville measure of {of_case(ivp)}, in {in_words(self.box)}"
        mechanics = Mechanics(require_projected(project_members(some), "the manifold"))
        states = StatesInBox(mechanics, of_p, of_q)
        walk = settled(lambda rows: states.some(rows), self._first(states, seed, what), [seed, 2], what)
        start = np.ascontiguousarray(walk.drawn.T), np.ascontiguousarray(walk.x.T)
        some = require_projected(project_members(replace(some, start=start)), "the manifold")
        return Starts(some, f"{what}{differing(some)}; {walk.in_words}; seed {seed}.", walk.measured)

    def _first(self, states: StatesInBox, seed: int, what: str) -> Array:
        """Return positions of all members from which there are momenta in the box."""
        q0 = states.mechanics.members.start[1].T

        def outside(q: Array, rows: Rows) -> Array:
            return excess(q, states.of_q) + excess(states.momenta_within(q, rows), states.of_p)

        q, _, lost = searched(states, q0, outside, [seed, 3])
        if np.any(lost):
            raise BadInput(
                f"no start of {what} was found in {np.sum(lost)} of {len(lost)} searches: the box is empty, or hard to find; enlarge it.",
                "box-empty",
            )
        return q

    def _uniform(self, some: Members, seed: int) -> Starts:
        """Return members of a Poisson system with states uniform in the box."""
        ivp = some.ivp
        ((lo, hi),) = box_of(ivp, self.box, "y")
        require_bounded(ivp, (lo, hi), "y", "states of a Poisson system can have any size")
        y = np.random.default_rng([seed, 2]).uniform(lo, hi, (len(some), len(lo)))
        what = f"a box, {in_words(self.box)}"
        some = require_inside(replace(some, start=(y,)), what)
        ends, measured = casimirs(some)
        divergence = largest_divergence(some)
        accepted = (
            "the flow preserves"
            if divergence <= INVARIANT
            else f"the flow does not preserve (its divergence is up to {divergence:.2g} of its rate)"
        )
        about = f"{what}, of {of_case(ivp)}, uniform in dy, which {accepted}{ends}{differing(some)}; seed {seed}."
        return Starts(some, about, measured | {"divergence": divergence})


def largest_divergence(some: Members) -> float:
    """Return the largest divergence of B grad H at the starts of members, relative to the largest entries of its derivative."""
    derivative = some.along("field_y", *some.start)
    trace = np.abs(np.trace(derivative, axis1=1, axis2=2))
    size = np.sum(np.abs(derivative), axis=(1, 2))
    return float(np.max(np.where(size > 0, trace / np.where(size > 0, size, 1.0), 0.0)))
