"""A step of kick, drift and kick with its constraints, and each of its parts as codes have it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from daebench.runs.ivp import Array
from daebench.studies.diagnose.mechanics import Mechanics, State, iterated
from daebench.studies.diagnose.positions import Positions, along_first_gradient

Momenta = Callable[[Mechanics, Array, Array], Array]
"""Maps the momentum after the second kick, and q1, to p1."""


def tangent(mechanics: Mechanics, p: Array, q: Array, factor: float = 1.0) -> Array:
    """Return p - G^T mu with G M^-1 p1 = 0, RATTLE's, or with a multiple of this mu."""
    G, W = mechanics.gradient(q), mechanics.inverse_mass(q)
    return np.asarray(p - factor * G.T @ np.linalg.solve(G @ W @ G.T, G @ mechanics.velocity(p, q)))


def as_it_is(mechanics: Mechanics, p: Array, q: Array) -> Array:
    """Return p."""
    return p


def euclidean(mechanics: Mechanics, p: Array, q: Array) -> Array:
    """Return p - G^T mu with G p1 = 0: M^-1 is left out of the constraint."""
    G = mechanics.gradient(q)
    return np.asarray(p - G.T @ np.linalg.solve(G @ G.T, G @ p))


def wrong_matrix(mechanics: Mechanics, p: Array, q: Array) -> Array:
    """Return p - G^T (G G^T)^-1 G M^-1 p: M^-1 is left out of the matrix."""
    G = mechanics.gradient(q)
    return np.asarray(p - G.T @ np.linalg.solve(G @ G.T, G @ mechanics.velocity(p, q)))


def wrong_side(mechanics: Mechanics, p: Array, q: Array) -> Array:
    """Return p - G^T (G M^-1 G^T)^-1 G p: M^-1 is left out of the right-hand side."""
    G = mechanics.gradient(q)
    return np.asarray(p - G.T @ np.linalg.solve(G @ mechanics.inverse_mass(q) @ G.T, G @ p))


def orthogonal_velocity(mechanics: Mechanics, p: Array, q: Array) -> Array:
    """Return M times the velocity less its part along G^T: M^-1 is left out where the velocity is corrected."""
    G, v = mechanics.gradient(q), mechanics.velocity(p, q)
    return np.asarray(p - mechanics.mass(q) @ G.T @ np.linalg.solve(G @ G.T, G @ v))


def weighted_velocity(mechanics: Mechanics, p: Array, q: Array) -> Array:
    """Return M (v - G^T (G M^-1 G^T)^-1 G v): M^-1 is left out where a velocity is corrected by RATTLE's multipliers."""
    G, v = mechanics.gradient(q), mechanics.velocity(p, q)
    return np.asarray(p - mechanics.mass(q) @ G.T @ np.linalg.solve(G @ mechanics.inverse_mass(q) @ G.T, G @ v))


@dataclass(frozen=True)
class KickDriftKick:
    """A step, by default that of RATTLE, HLW (1.26).

    ::

        p_half = p0 - first h H_q(p_half, q0) - impulse
        q1, impulse = positions(...)
        p1 = momenta(p_half - second h H_q(p_half, q1))

    Parameters
    ----------
    first, second : float
        Parts of h in the two kicks.
    positions : callable
        See :data:`daebench.studies.diagnose.positions.Positions`.
    momenta : callable
        See :data:`Momenta`.
    old_force : bool
        Whether the second kick is computed at q0.
    impulse_at_end : float
        How much of the impulse, its multipliers along G(q1), is taken from p1 once more.
    """

    first: float = 0.5
    second: float = 0.5
    positions: Positions = along_first_gradient
    momenta: Momenta = tangent
    old_force: bool = False
    impulse_at_end: float = 0.0

    def __call__(self, mechanics: Mechanics, p0: Array, q0: Array, h: float) -> State:
        """Return p1 and q1."""
        q1 = q0

        def half(p: Array) -> Array:
            nonlocal q1
            kicked = p0 - self.first * h * mechanics.slope(p, q0)
            q1, impulse = self.positions(mechanics, kicked, q0, h)
            return kicked - impulse

        p = half(p0) if mechanics.separable else iterated(half, p0)
        kicked = p - self.second * h * mechanics.slope(p, q0 if self.old_force else q1)
        if self.impulse_at_end:
            lam = np.linalg.lstsq(mechanics.gradient(q0).T, p0 - self.first * h * mechanics.slope(p, q0) - p, rcond=None)[0]
            kicked = kicked - self.impulse_at_end * mechanics.gradient(q1).T @ lam
        return self.momenta(mechanics, kicked, q1), q1


RATTLE = KickDriftKick()
"""The right step."""
