"""The positions that a motion of an energy can reach, and the density of the Liouville measure at that energy on them."""

from dataclasses import dataclass

import numpy as np

from daebench.runs.ivp import Array
from daebench.studies.ensemble.distributions.box import excess
from daebench.studies.ensemble.distributions.linear import Rows, gram, log_det
from daebench.studies.ensemble.distributions.search import Positions


@dataclass(frozen=True)
class Reachable(Positions):
    """Positions with g = 0 and U <= E in a box.

    The density with respect to the Euclidean surface measure is ::

        (E - U)^(k/2 - 1) sqrt( det M det(G M^-1 G^T) / det(G G^T) )

    Parameters
    ----------
    mechanics : Mechanics
        The problem.
    E : float
        Energy.
    bounds : (ndarray, ndarray), each shape(d,)
        Bounds of positions.
    flat : bool
        Whether the density is one everywhere instead.
    """

    E: float
    bounds: tuple[Array, Array]
    flat: bool = False
    noise: int = 0

    def weighed(self, x: Array, C: Array, noise: Array, rows: Rows) -> tuple[Array, Array]:
        """Return the logarithm of the density, and nothing besides."""
        kinetic, nothing = self.E - self.mechanics.U(x, rows), np.empty((0, x.shape[1]))
        power = self.mechanics.k / 2 - 1
        density = np.where((kinetic >= 0) & (excess(x, self.bounds) <= 0), 0.0, -np.inf)
        if self.flat:
            return density, nothing
        if power:
            density = density + power * np.log(np.maximum(kinetic, 0.0))
        return density + self.mechanics.volume(x, C, rows) - log_det(gram(C, C)) / 2, nothing


@dataclass(frozen=True)
class EnergyCurve:
    """The curve of (q, u), u = s / w, with g = 0 and s^2 / 2 + U = E: for a motion of one degree of freedom.

    What (E - U)^(-1/2) is to the surface measure of {g = 0}, which has no bound where s = 0, is here ::

        sqrt( det M det(G M^-1 G^T) / det(C C^T) ),      C = [[G, 0], [U_q / w^2, u]]

    to the Euclidean measure of the curve, for delta(s^2 / 2 + U - E) integrated over s is sqrt(2) (E - U)^(-1/2).

    Parameters
    ----------
    reachable : Reachable
        Positions and energy.
    w : float
        Rate by which s becomes a length, 1/s times the root of a mass.
    """

    reachable: Reachable
    w: float
    noise: int = 0

    def conditions(self, x: Array, rows: Rows) -> tuple[Array, Array]:
        """Return g and u^2 / 2 + (U - E) / w^2 at points of some members, and their Jacobian."""
        q, u = x[:-1], x[-1]
        g, G = self.reachable.conditions(q, rows)
        some, square = self.reachable.mechanics, self.w**2
        c = np.concatenate([g, [u**2 / 2 + (some.U(q, rows) - self.reachable.E) / square]])
        C = np.zeros((len(c), *x.shape))
        C[:-1, :-1], C[-1, :-1], C[-1, -1] = G, some.U_q(q, rows) / square, u
        return c, C

    def weighed(self, x: Array, C: Array, noise: Array, rows: Rows) -> tuple[Array, Array]:
        """Return the logarithm of the density, and nothing besides."""
        q, reachable = x[:-1], self.reachable
        density = np.where(excess(q, reachable.bounds) <= 0, 0.0, -np.inf)
        return density + reachable.mechanics.volume(q, C[:-1, :-1], rows) - log_det(gram(C, C)) / 2, np.empty((0, x.shape[1]))
