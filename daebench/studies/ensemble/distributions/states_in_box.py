"""States of a constrained problem in a box: positions of a walk, each with momenta drawn in the plane that belongs to it."""

from dataclasses import dataclass, replace

import numpy as np

from daebench.runs.ivp import Array
from daebench.studies.ensemble.distributions.box import excess
from daebench.studies.ensemble.distributions.linear import Rows, gram, log_det, product, solved, times, transposed_times
from daebench.studies.ensemble.distributions.search import Positions

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

    Parameters
    ----------
    mechanics : Mechanics
        The problem.
    of_p, of_q : (ndarray, ndarray), each shape(d,)
        Bounds of momenta and of positions.
    """

    of_p: tuple[Array, Array]
    of_q: tuple[Array, Array]

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
